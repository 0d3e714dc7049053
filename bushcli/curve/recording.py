"""Recording: a measured curve in internal units, and its origin."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.curve.segment import Segment

Array = NDArray[np.float64]

# A rig's counter changes some samples before or after the turn: an end of a cycle this near to an end of a branch, in
# samples and as a share of the branch, is that end. Judgement.
_LATE, _LATE_SHARE = 3, 0.1


@dataclass(frozen=True)
class Repair:
    """A change to a recording when it was read, or a remark.

    Attributes
    ----------
    kind : {"time", "stuck", "columns"}
        "columns" says how a column was found; the others are faults of the data.
    text : str
        A sentence with the number of samples concerned.
    """

    kind: Literal["time", "stuck", "columns"]
    text: str


@dataclass(frozen=True)
class ReadColumn:
    """A column of the file as it was read.

    Attributes
    ----------
    quantity : {"time", "displacement", "force", "cycle"}
    number : int
        From 1.
    name : str
        As in the file; empty without a header.
    unit : str
        In which its numbers were read; empty for a count of cycles.
    assumed : bool
        Whether neither the file nor the case file gives the unit.
    """

    quantity: str
    number: int
    name: str
    unit: str
    assumed: bool


@dataclass(frozen=True, eq=False)
class RecordedProgram:
    """The program of a load case as a file contains it, in internal units.

    Attributes
    ----------
    name : str
        Name of the load case, or of its mode.
    time : shape (n,) or None
        s.
    displacement : shape (n,)
        mm, rad or stretch - 1.
    columns : tuple of ReadColumn
        Columns that were read.
    unused : tuple of str
        Names of the file's other columns, those without a name left out.
    repairs : tuple of Repair
        Remarks on how the file was read.
    """

    name: str
    mode: str
    time: Array | None
    displacement: Array
    columns: tuple[ReadColumn, ...] = ()
    unused: tuple[str, ...] = ()
    repairs: tuple[Repair, ...] = ()


@dataclass(frozen=True, eq=False)
class RecordedPath:
    """Six motions of the inner sleeve as recorded.

    Attributes
    ----------
    time : shape (n,) or None
        s.
    motion : shape (n, 6)
        mm and rad.
    free : tuple of int
        Indices of motions that were free of force.
    number : int
        Index of the motion and reaction in this recording.
    name : str
        Name of the whole recording, whose channels share this path.
    """

    time: Array | None
    motion: Array
    free: tuple[int, ...]
    number: int
    name: str


@dataclass(frozen=True)
class Recording(Curve):
    """A measured curve, in internal units.

    ``displacement`` (n,) is in mm or rad and ``force`` (n,) in N or N mm; of a coupon, ``displacement`` is
    stretch - 1 (the nominal strain) and ``force`` the nominal stress in MPa, so that a coupon is recorded
    like a bushing. ``time`` (n,) is in s, or None.

    Attributes
    ----------
    name : str
        Name of the channel.
    source : Path, optional
        The file.
    cycles : tuple of int
        Numbers, in the file, of the selected cycles; empty if all are used.
    units : (str, str)
        Units of displacement and force in the file (`bushcli.recording.header.units`); empty where they are not known.
    repeated : tuple of int
        Lines of the file that repeat the row before them, time included; they were left out.
    repairs : tuple of Repair
        Other repairs and remarks.
    conditioning : int
        Number of first cycles of the file that only condition the specimen.
    columns : tuple of ReadColumn
        Columns that were read; empty if the recording is not from a file.
    unused : tuple of str
        Names of the file's other columns, those without a name left out.
    six : RecordedPath, optional
        The path of six motions; displacement and force are one of its motions and the reaction to it.
    numbers : (n,) array of int, optional
        Number of the cycle of each sample, as the rig or a selection counts them; None where they are counted from the
        displacement (`bushcli.curve.segment`).
    temperature : (n,) array, optional
        Degrees C at each sample, where the file has it.
    selected_from : Recording, optional
        The whole record of which these samples were selected: its earlier cycles are their history.
    selected : (n,) array of int, optional
        Their indices in the whole record.
    accepted_faults : tuple of str
        Kinds of data faults that the user has looked at and that are none.
    """

    name: str = ""
    source: Path | None = None
    cycles: tuple[int, ...] = ()
    units: tuple[str, str] = ("", "")
    repeated: tuple[int, ...] = ()
    repairs: tuple[Repair, ...] = ()
    conditioning: int = 0
    columns: tuple[ReadColumn, ...] = ()
    unused: tuple[str, ...] = ()
    six: RecordedPath | None = None
    numbers: NDArray[np.int_] | None = None
    temperature: Array | None = None
    selected_from: Recording | None = None
    selected: NDArray[np.int_] | None = None
    accepted_faults: tuple[str, ...] = ()

    @cached_property
    def branches(self) -> tuple[Segment, ...]:
        """The segments, with the numbers of the rig's or the selected cycles; cut where a cycle ends within one."""
        if self.numbers is None:
            return self.segments
        parts = []
        for branch in self.segments:
            numbers = self.numbers[branch.start : branch.stop]
            least = max(_LATE, _LATE_SHARE * len(numbers))
            cuts = [
                int(sample) + 1
                for sample in np.flatnonzero(np.diff(numbers))
                if least <= sample + 1 <= len(numbers) - least
            ]
            for first, last in pairwise([0, *cuts, len(numbers)]):
                start, stop = branch.start + first, branch.start + last
                parts.append(replace(branch, start=start, stop=stop, cycle=int(numbers[(first + last) // 2])))
        return tuple(parts)

    def with_cycle_numbers(
        self, numbers: NDArray[np.int_], columns: tuple[ReadColumn, ...], unused: tuple[str, ...]
    ) -> Recording:
        """Return the recording with the numbers of cycles that the rig counts; its motion is not segmented anew.

        Parameters
        ----------
        numbers : (n,) array of int
        columns, unused : tuple
            As among the attributes.
        """
        recording = replace(self, numbers=numbers, columns=columns, unused=unused)
        recording.__dict__.update(segments=self.segments, displacement_noise=self.displacement_noise)
        return recording

    @property
    def kind(self) -> Literal["static", "dynamic"]:
        """Kind of the channel: "static", along a path, or "dynamic", a table of dynamic stiffness."""
        return "static"

    @property
    def of_one_motion(self) -> bool:
        """Whether the sleeve is driven in one motion, and not along a path of six."""
        return self.six is None

    @property
    def has_time(self) -> bool:
        """Whether rates are known."""
        return self.time is not None

    @property
    def largest(self) -> tuple[float, float]:
        """Largest displacement, mm or rad, and largest force, N or N mm."""
        return float(np.abs(self.displacement).max()), float(np.abs(self.force).max())

    @property
    def span(self) -> tuple[float, float]:
        """Time between samples and that of the whole recording, s; (nan, nan) where it has no time."""
        if self.time is None:
            return math.nan, math.nan
        return float(np.median(np.diff(self.time))), float(self.time[-1] - self.time[0])

    @property
    def record(self) -> Recording:
        """All samples of the file, those of cycles that are not compared included."""
        return self.selected_from or self

    @property
    def places(self) -> NDArray[np.int_]:
        """Indices (n,) of the samples in the whole record."""
        return np.arange(len(self.displacement)) if self.selected is None else self.selected

    def with_gaps_interpolated(self, used: NDArray[np.bool_]) -> Recording:
        """Return the recording with straight lines in place of samples that do not count; as it is if none counts.

        Parameters
        ----------
        used : (n,) array of bool
            Samples that count.
        """
        if used.all() or not used.any():
            return self
        samples, sound = np.arange(len(used)), np.flatnonzero(used)
        return replace(
            self,
            displacement=np.interp(samples, sound, self.displacement[sound]),
            force=np.interp(samples, sound, self.force[sound]),
        )
