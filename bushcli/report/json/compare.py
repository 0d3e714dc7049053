"""A comparison of results -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.report.json.common import json_value, select, versions
from bushcli.study.compare import Comparison


def compare_json(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON-ready data."""
    keys, numbers = (
        {difference.key: select(difference, "values percent") for difference in differences}
        for differences in (comparison.keys, comparison.numbers)
    )
    return json_value(
        {
            "command": "compare",
            "case": comparison.items[0].result["case"],
            "versions": versions(),
            "timings_s": {},
            "results": [
                {"name": item.name, "command": item.result.get("command"), "problems": list(names)}
                for item, names in zip(comparison.items, comparison.problems, strict=True)
            ],
            "keys": keys,
            "numbers": numbers,
            "curves": comparison.curves,
            "problems": [],
        }
    )
