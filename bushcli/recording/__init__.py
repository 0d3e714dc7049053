"""CSV -> Recording: time, displacement and force in internal units; branches, cycles and noise.

Column names, units, delimiter, decimal sign and encoding are recognised from the file (see `text_file`,
`header.columns`), or given by a `bushcli.recording.source.Source`. What reads and writes files is loaded when it is
first used: a simulation without recordings does not need it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bushcli.curve.recording import RecordedPath, RecordedProgram, Recording, Repair
from bushcli.curve.segment import Segment
from bushcli.curve.signals import cycle_mask, departure, on_branch, select_cycles

if TYPE_CHECKING:
    from bushcli.recording.read import read_program, read_recording
    from bushcli.recording.write import write_curve_csv

__all__ = [
    "RecordedPath", "RecordedProgram", "Recording", "Repair", "Segment", "cycle_mask", "departure", "on_branch",
    "read_program", "read_recording", "select_cycles", "write_curve_csv",
]  # fmt: skip
_HOME = {"read_program": "read", "read_recording": "read", "write_curve_csv": "write"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
