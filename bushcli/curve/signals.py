"""Samples of some branches or cycles of a curve."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.curve.recording import Recording
from bushcli.curve.segment import Segment, per_sample
from bushcli.errors import Problem, RecordingError, count_of

# Points of the cycles that are selected, as of a coupon: fewer are no curve.
_FEWEST = 3


def departure(segments: Sequence[Segment], i: int) -> int:
    """Return the sample from which a branch starts: the last before it, unless cycles between are left out.

    Parameters
    ----------
    segments : Sequence[Segment]
        Branches of a recording, in order.
    i : int
        Index of the branch.
    """
    first = segments[i].start
    return first - 1 if i > 0 and segments[i].cycle - segments[i - 1].cycle <= 1 else first


def cycle_mask(recording: Curve, cycles: Iterable[int]) -> NDArray[np.bool_]:
    """Return which samples (n,) belong to the given cycles, counted from 1.

    Parameters
    ----------
    recording : Curve
    cycles : iterable of int
        Numbers of cycles, from 1.

    Raises
    ------
    RecordingError
        When the recording has no such cycle.
    """
    wanted, segments = set(cycles), recording.branches
    last = max(branch.cycle for branch in segments)
    absent = sorted(cycle for cycle in wanted if not 1 <= cycle <= last)
    if absent:
        where = str(getattr(recording, "source", None) or recording.mode)
        what = f"cycles: there is no cycle {absent[0]}"
        raise RecordingError(
            Problem(where, what, "", f"the recording has {last}; a cycle is a full reversal: 0, a, 0, -a, 0")
        )
    return per_sample(segments, [branch.cycle in wanted for branch in segments])


def on_branch(recording: Recording, kind: Literal["loading", "unloading"]) -> NDArray[np.bool_]:
    """Return which samples (n,) belong to branches of one kind; holds belong to neither.

    Parameters
    ----------
    recording : Recording
    kind : {"loading", "unloading"}
        Away from zero displacement, or towards it.
    """
    return per_sample(recording.branches, [branch.kind == kind for branch in recording.branches])


def select_cycles(recording: Recording, cycles: Iterable[int]) -> Recording:
    """Return the samples of the given cycles, counted from 1, with their times.

    Parameters
    ----------
    recording : Recording
    cycles : iterable of int
        Their numbers.

    Raises
    ------
    RecordingError
        When there is no such cycle, or too few points are left.
    """
    cycles = tuple(cycles)
    mask = cycle_mask(recording, cycles)
    # A cycle begins at the last sample of the one before it, where the motion passes zero: its work needs both ends.
    first = np.flatnonzero(mask[1:] & ~mask[:-1])
    mask[first] = True
    what, force = "", recording.force[mask]
    if mask.sum() < _FEWEST or np.ptp(recording.displacement[mask]) == 0.0:
        what = f" hold only {count_of(mask.sum(), 'point')}"
    elif np.ptp(force) == 0.0:
        what = f": the force is {force[0]:g} throughout"
    if what:
        place = str(recording.source or recording.mode)
        raise RecordingError(Problem(place, f"cycles {', '.join(map(str, cycles))}{what}"))
    numbers = per_sample(recording.branches, [branch.cycle for branch in recording.branches])
    numbers[first] = numbers[first + 1]
    time = None if recording.time is None else recording.time[mask]
    return replace(
        recording,
        displacement=recording.displacement[mask],
        force=force,
        time=time,
        cycles=tuple(sorted(set(cycles))),
        numbers=numbers[mask],
        temperature=None if recording.temperature is None else recording.temperature[mask],
        selected_from=recording,
        selected=np.flatnonzero(mask),
    )
