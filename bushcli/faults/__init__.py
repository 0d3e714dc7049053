"""Faults of the data: damage by a rig or its logger, found before any law is fitted to the recording.

A fault is not physical: no law and no effect may be fitted to it. Some contradict what else the case and its
recordings say (the force has the other sign, two channels are exchanged) and make every fit meaningless; they are
*fatal* and must be corrected first. A unit that is probably wrong is a warning. Others touch a few samples (spikes,
stuck samples, a clipped load cell), which a fit leaves out.

The search for faults is loaded when it is first used: a simulation without recordings does not need it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bushcli.faults.fault import DataFault, condition, masks

if TYPE_CHECKING:
    from bushcli.faults.find import bad_samples, find_faults, sample_faults

__all__ = ["DataFault", "bad_samples", "condition", "find_faults", "masks", "sample_faults"]

_FIND = ("bad_samples", "find_faults", "sample_faults")


def __getattr__(name: str) -> Any:
    if name not in _FIND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.find"), name)
