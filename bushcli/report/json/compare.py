"""A comparison of results -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.report.json.common import cleaned, part, versions
from bushcli.study.compare import Comparison


def compare_json(found: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON-ready data."""
    return cleaned(
        {
            "command": "compare",
            "case": found.items[0].result["case"],
            "versions": versions(),
            "timings_s": {},
            "results": [
                {"name": item.name, "command": item.result.get("command"), "problems": list(names)}
                for item, names in zip(found.items, found.problems, strict=True)
            ],
            "keys": {one.key: part(one, "values percent") for one in found.keys},
            "numbers": {one.key: part(one, "values percent") for one in found.numbers},
            "curves": found.curves,
            "problems": [],
        }
    )
