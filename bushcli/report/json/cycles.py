"""Cycles and holds of a channel -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.curve.cycles import Cycle
from bushcli.curve.holds import Hold
from bushcli.report.cycles import ChannelHistory, shown_values
from bushcli.report.json.common import select
from bushcli.report.quantity import Quantities, quantities


def history_json(history: ChannelHistory) -> dict[str, Any]:
    """Return `cycles` and `holds` of a channel in the units of the case file."""
    units = quantities(history.mode)
    return {
        "cycles": [
            {
                **select(cycle, "number closed"),
                "displacement": [units.at(q) - units.rest for q in (cycle.lowest, cycle.highest)],
                "rate": None if cycle.rate is None else units.per_internal * cycle.rate,
                "recorded": _values(recorded, units, errors=True),
                "simulated": _values(simulated, units),
            }
            for cycle, recorded, simulated in history.cycles
        ],
        "holds": [
            {
                **select(hold, "number cycle"),
                "displacement": units.at(hold.displacement) - units.rest,
                "duration": hold.duration,
                "recorded": _values(recorded, units, errors=True),
                "simulated": _values(simulated, units),
            }
            for hold, recorded, simulated in history.holds
        ],
    }


def _values(segment: Cycle | Hold | None, units: Quantities, errors: bool = False) -> dict[str, Any] | None:
    if segment is None:
        return None
    values: dict[str, Any] = {}
    for key, estimate in shown_values(segment, units).items():
        values |= {key: estimate.value, f"{key}_std": estimate.std} if errors else {key: estimate.value}
    if isinstance(segment, Hold):
        for ending, field in (("", "value"), ("_std", "std"))[: 2 if errors else 1]:
            after = {f"{time:g}": 100 * getattr(loss, field) for time, loss in segment.after.items()}
            values[f"relaxation_percent_after{ending}"] = after
    return values
