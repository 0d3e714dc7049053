"""Cycles and holds of a channel -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.curve.cycles import Cycle, Uncertain
from bushcli.curve.holds import Hold
from bushcli.report.cycles import ChannelHistory
from bushcli.report.quantity import Quantities, quantities


def history_json(history: ChannelHistory) -> dict[str, Any]:
    """Return `cycles` and `holds` of a channel in the units of the case file."""
    shown = quantities(history.mode)
    return {
        "cycles": [
            {
                "number": known.number,
                "closed": known.closed,
                "displacement": [shown.at(q) - shown.rest for q in (known.lowest, known.highest)],
                "rate": None if known.rate is None else shown.per_internal * known.rate,
                "recorded": _cycle_json(recorded, shown, errors=True),
                "simulated": _cycle_json(simulated, shown),
            }
            for known, recorded, simulated in history.cycles
        ],
        "holds": [
            {
                "number": known.number,
                "cycle": known.cycle,
                "displacement": shown.at(known.displacement) - shown.rest,
                "duration": known.duration,
                "recorded": _hold_json(recorded, errors=True),
                "simulated": _hold_json(simulated),
            }
            for known, recorded, simulated in history.holds
        ],
    }


def _cycle_json(cycle: Cycle | None, shown: Quantities, errors: bool = False) -> dict[str, Any] | None:
    if cycle is None:
        return None
    values = {
        "energy": (cycle.energy, 1.0),
        "loss_percent": (cycle.loss, 100.0),
        "secant_stiffness": (cycle.secant, 1.0 / shown.per_internal),
        "peak_force": (cycle.peak_force, 1.0),
    }
    return _values(values, errors)


def _hold_json(hold: Hold | None, errors: bool = False) -> dict[str, Any] | None:
    if hold is None:
        return None
    values = {
        "force_start": (hold.force_start, 1.0),
        "force_end": (hold.force_end, 1.0),
        "relaxation_percent": (hold.relaxation, 100.0),
    }
    after = {
        f"relaxation_percent_after{ending}": {
            f"{at:g}": 100 * getattr(found, what) for at, found in hold.after.items()
        }
        for ending, what in (("", "value"), ("_std", "std"))[: 2 if errors else 1]
    }
    return _values(values, errors) | after


def _values(values: Mapping[str, tuple[Uncertain, float]], errors: bool) -> dict[str, float]:
    found: dict[str, float] = {}
    for key, (one, factor) in values.items():
        found[key] = factor * one.value
        if errors:
            found[f"{key}_std"] = factor * one.std
    return found
