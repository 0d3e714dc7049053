"""Contents of a recording: cycles and their amplitudes, rates, holds, whether it begins at rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.earlier import earlier
from bushcli.recording import Recording, Segment, departure

#: Cycles are alike if their amplitudes differ by less than this share of the largest one.
ALIKE = 0.1
#: Smallest ratio of different rates: the control of a rig is uncertain by a tenth of a decade and more.
DIFFERENT_RATE = 2.0
#: A recording begins at rest within this share of its range.
_AT_REST = 0.05
#: A branch shorter than this share of the largest amplitude is no ramp.
_RAMP = 0.2
#: The logger paused between two samples if their interval is longer than this many of both intervals beside it, and the
#: travel changed by more than this share of its range; as in `recording.rasters`, but rates of one recording may differ
#: by more than that, and with them the intervals of a logger that samples by travel.
_PAUSE, _MOVED = 10.0, 0.01


@dataclass(frozen=True)
class Observed:
    """Contents of a recording: of its whole record, the cycles that are not compared included.

    Attributes
    ----------
    amplitudes : tuple of float
        Largest distance from rest of each cycle: mm, rad, or stretch - 1.
    compared : tuple of float
        The same of the cycles that are compared.
    conditioning : int
        Number of first cycles, which condition the specimen.
    rates : tuple of float
        Speeds of the ramps, mm/s, rad/s or 1/s, the slowest first; speeds that differ by less than a factor of
        `DIFFERENT_RATE` are represented by their median. Empty without time.
    holds : tuple of float
        Durations of the holds away from rest, s; empty without time.
    rests : tuple of float
        Durations of the holds at rest, s.
    pauses : tuple of float
        Durations of the pauses of the logger in which the specimen was moved, s.
    timed : bool
        Whether the recording has time.
    from_rest : bool
        Whether it begins at rest.
    unloads : bool
        Whether the specimen is unloaded.
    """

    channel: str
    mode: str
    amplitudes: tuple[float, ...]
    compared: tuple[float, ...]
    conditioning: int
    rates: tuple[float, ...]
    holds: tuple[float, ...]
    rests: tuple[float, ...]
    pauses: tuple[float, ...]
    timed: bool
    from_rest: bool
    unloads: bool

    @property
    def largest_cycles(self) -> int:
        """Number of cycles as large as the largest, those of the conditioning included."""
        largest = max(self.amplitudes, default=0.0)
        return sum(a >= (1.0 - ALIKE) * largest for a in self.amplitudes)


def observe(recording: Recording) -> Observed:
    """Return the contents of a recording, those that are not compared included."""
    selected, recording = recording.cycles, recording.record
    q, segments = recording.displacement, recording.branches
    span = float(np.ptp(q))
    by_cycle = {
        cycle: float(max(np.abs(q[branch.start : branch.stop]).max() for branch in group))
        for cycle, group in groupby(segments, lambda branch: branch.cycle)
    }
    amplitudes = tuple(by_cycle.values())
    times = np.zeros(len(q)) if recording.time is None else recording.time
    seconds, way = np.diff(times), np.abs(np.diff(q))
    neighbours = np.full((2, len(seconds)), np.inf)
    # The first and the last interval have a neighbour on one side only, which does not show a pause.
    neighbours[0, 1:-1], neighbours[1, 1:-1] = seconds[:-2], seconds[2:]
    paused = np.flatnonzero((seconds > _PAUSE * neighbours.max(axis=0)) & (way > _MOVED * span))
    held = [
        (float(np.ptp(times[branch.start : branch.stop])), float(q[branch.start : branch.stop].mean()))
        for branch in (segments if recording.time is not None else ())
        if branch.kind == "hold"
    ]
    # Speeds of a group differ by less than a factor of `DIFFERENT_RATE`.
    groups: list[list[float]] = []
    for speed in sorted(_speeds(recording, segments, paused, _RAMP * max(amplitudes))):
        if groups and speed < DIFFERENT_RATE * groups[-1][0]:
            groups[-1].append(speed)
        else:
            groups.append([speed])
    return Observed(
        channel=recording.name,
        mode=recording.mode,
        amplitudes=amplitudes,
        compared=tuple(by_cycle[cycle] for cycle in selected) if selected else amplitudes,
        conditioning=recording.conditioning,
        rates=tuple(float(np.median(group)) for group in groups),
        holds=tuple(seconds for seconds, displacement in held if abs(displacement) > _AT_REST * span),
        rests=tuple(seconds for seconds, displacement in held if abs(displacement) <= _AT_REST * span),
        pauses=tuple(map(float, seconds[paused])),
        timed=recording.time is not None,
        from_rest=bool(abs(q[0]) <= _AT_REST * span) and earlier(recording) is None,
        unloads=any(branch.kind == "unloading" for branch in segments),
    )


def _speeds(
    recording: Recording, segments: Sequence[Segment], paused: NDArray[np.int64], least: float
) -> Iterator[float]:
    """Yield the mean speed of each branch that is longer than `least`, without the pauses of the logger."""
    if recording.time is None:
        return
    for i, branch in enumerate(segments):
        start, last = max(departure(segments, i), 0), branch.stop - 1
        pauses = paused[(paused >= start) & (paused < last)]
        missed = recording.displacement[pauses + 1] - recording.displacement[pauses]
        way = abs(recording.displacement[last] - recording.displacement[start] - missed.sum())
        seconds = recording.time[last] - recording.time[start]
        seconds -= (recording.time[pauses + 1] - recording.time[pauses]).sum()
        if branch.kind != "hold" and way > least and seconds > 0:
            yield float(way / seconds)
