"""CSV -> Recording: time, displacement and force in internal units; branches, cycles and noise.

Column names, units, delimiter, decimal sign and encoding are recognised from the file (see `text`,
`header`), or given by a `bushcli.recording.source.Source`.
"""

from bushcli.recording.read import (
    branches,
    cycle_mask,
    departure,
    displacement_noise,
    force_noise,
    matching,
    read_coupon,
    read_program,
    read_recording,
    select_cycles,
)
from bushcli.recording.recorded import RecordedPath, Recording
from bushcli.recording.samples import Repair
from bushcli.recording.segment import Branch
from bushcli.recording.write import write_curve_csv

__all__ = [
    "Branch",
    "RecordedPath",
    "Recording",
    "Repair",
    "branches",
    "cycle_mask",
    "departure",
    "displacement_noise",
    "force_noise",
    "matching",
    "read_coupon",
    "read_program",
    "read_recording",
    "select_cycles",
    "write_curve_csv",
]
