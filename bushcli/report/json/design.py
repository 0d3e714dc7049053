"""A design for target rates -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.report.json.common import cleaned, head, part
from bushcli.report.views.design import overrides
from bushcli.study.design import Design


def design_json(found: Design) -> dict[str, Any]:
    """Return a design as JSON-ready data."""
    document = head("design", found.case, found.conditions)
    document |= {
        **part(found, "converged evaluations"),
        "met": all(one.met for one in found.targets),
        "design": {key: part(one, "value lower upper start at_bound") for key, one in found.keys.items()},
        "set": overrides(found),
        "targets": {
            one.target.name: {
                "unit": one.target.unit,
                "wanted": one.wanted,
                "allowed": one.target.deviation * one.target.per_shown,
                "value": one.value,
                "deviation_percent": 100 * one.deviation,
                "met": one.met,
                "derivatives": one.slopes,
                **({"tolerances": one.spread} if one.spread else {}),
            }
            for one in found.targets
        },
    }
    return cleaned(document)
