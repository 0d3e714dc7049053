"""Cycles and holds of a channel -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.curve.cycles import Cycle
from bushcli.curve.holds import Hold
from bushcli.report.cycles import ChannelHistory, shown_values
from bushcli.report.json.common import part
from bushcli.report.quantity import Quantities, quantities


def history_json(history: ChannelHistory) -> dict[str, Any]:
    """Return `cycles` and `holds` of a channel in the units of the case file."""
    shown = quantities(history.mode)
    return {
        "cycles": [
            {
                **part(known, "number closed"),
                "displacement": [shown.at(q) - shown.rest for q in (known.lowest, known.highest)],
                "rate": None if known.rate is None else shown.per_internal * known.rate,
                "recorded": _values(recorded, shown, errors=True),
                "simulated": _values(simulated, shown),
            }
            for known, recorded, simulated in history.cycles
        ],
        "holds": [
            {
                **part(held, "number cycle"),
                "displacement": shown.at(held.displacement) - shown.rest,
                "duration": held.duration,
                "recorded": _values(before, shown, errors=True),
                "simulated": _values(after, shown),
            }
            for held, before, after in history.holds
        ],
    }


def _values(segment: Cycle | Hold | None, shown: Quantities, errors: bool = False) -> dict[str, Any] | None:
    if segment is None:
        return None
    values: dict[str, Any] = {}
    for key, estimate in shown_values(segment, shown).items():
        values |= {key: estimate.value, f"{key}_std": estimate.std} if errors else {key: estimate.value}
    if isinstance(segment, Hold):
        for ending, what in (("", "value"), ("_std", "std"))[: 2 if errors else 1]:
            after = {f"{at:g}": 100 * getattr(relaxation, what) for at, relaxation in segment.after.items()}
            values[f"relaxation_percent_after{ending}"] = after
    return values
