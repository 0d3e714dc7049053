"""Faults of the data in words."""

from __future__ import annotations

from collections.abc import Sequence

from bushcli.faults import DataFault
from bushcli.report.quantity import listed

# Conditions that repeat the faults of the data.
FAULTS = frozenset({"faulty_data", "doubtful_data", "bad_samples"})
_KINDS = {
    "sign": "wrong sign",
    "position": "displacement from another zero",
    "unit": "wrong unit",
    "swapped": "columns or channels swapped",
    "clipped": "values clipped",
    "extremes": "extremes in place of samples",
    "spikes": "single bad samples",
    "stuck": "values stuck",
    "time": "wrong times",
    "no_signal": "noise in place of a force",
    "temperature": "two sweeps at one temperature",
}


def fault_kind(fault: DataFault) -> str:
    """Return the kind of a fault in two or three words."""
    return _KINDS.get(fault.kind, fault.kind)


def faulty_data(faults: Sequence[DataFault]) -> str:
    """Return a headline without its full stop: the faults that must be corrected before anything else, and where.

    Parameters
    ----------
    faults : sequence of DataFault
        If none is fatal, all are named.
    """
    fatal = [one for one in faults if one.fatal] or list(faults)
    named = dict.fromkeys(f"{fault_kind(one)} in the {one.channel} channel" for one in fatal)
    return f"Faulty data: {listed(list(named))}, to be corrected first"


def fault_lines(faults: Sequence[DataFault]) -> list[str]:
    """Return a line for each fault of the recordings: place and remedy; the fatal faults first.

    Parameters
    ----------
    faults : sequence of DataFault
    """
    lines = []
    for one in sorted(faults, key=lambda one: not one.fatal):
        remedy = one.remedy.rstrip(".")
        lines.append(f"{one.channel}: {fault_kind(one)}, {one.where.rstrip('.')}. What to do: {remedy}")
    return lines
