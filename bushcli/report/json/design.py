"""A design for target rates -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.report.json.common import result_json, select
from bushcli.report.views.design import overrides
from bushcli.study.design import Design


def design_json(design: Design) -> dict[str, Any]:
    """Return a design as JSON-ready data."""
    entries = {
        **select(design, "converged evaluations"),
        "met": all(goal.is_met for goal in design.targets),
        "design": {
            key: select(dimension, "value lower upper start at_bound")
            for key, dimension in design.keys.items()
        },
        "set": overrides(design),
        "targets": {
            goal.target.name: {
                "unit": goal.target.unit,
                "wanted": goal.target_value,
                "allowed": goal.target.deviation * goal.target.per_shown,
                "value": goal.value,
                "deviation_percent": 100 * goal.deviation,
                "met": goal.is_met,
                "derivatives": goal.slopes,
                **({"tolerances": goal.spread} if goal.spread else {}),
            }
            for goal in design.targets
        },
    }
    return result_json("design", design.case, design.conditions, entries)
