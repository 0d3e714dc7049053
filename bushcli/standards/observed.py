"""Contents of a recording: cycles and their amplitudes, rates, holds, whether it begins at rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from bushcli.recording import Branch, Recording, branches, departure

#: Cycles are alike that differ by less than this share of the largest amplitude.
ALIKE = 0.1
#: Rates are different from this ratio on: a tenth of a decade and more would be lost in the control of a rig.
DIFFERENT_RATE = 2.0
#: A recording begins at rest within this share of its range.
_AT_REST = 0.05
#: A branch shorter than this share of the largest amplitude is no ramp.
_RAMP = 0.2


@dataclass(frozen=True)
class Observed:
    """Contents of a recording.

    Attributes
    ----------
    channel, mode : str
    amplitudes : tuple of float
        Largest distance from rest of each cycle that is compared: mm, rad, or stretch - 1.
    conditioning : int
        Cycles before these that condition the specimen.
    rates : tuple of float
        Speeds of the ramps, mm/s, rad/s or 1/s, one for each that differs by a factor of `DIFFERENT_RATE`, the slowest
        first; empty without time.
    holds : tuple of float
        Durations of the holds away from rest, s; empty without time.
    rests : tuple of float
        Durations of the holds at rest, s.
    timed : bool
        Whether there is a time.
    from_rest : bool
        Whether it begins at rest.
    unloads : bool
        Whether the load is taken back.
    """

    channel: str
    mode: str
    amplitudes: tuple[float, ...]
    conditioning: int
    rates: tuple[float, ...]
    holds: tuple[float, ...]
    rests: tuple[float, ...]
    timed: bool
    from_rest: bool
    unloads: bool

    @property
    def alike(self) -> int:
        """Number of cycles, with those of the conditioning, that are as large as the largest."""
        largest = max(self.amplitudes, default=0.0)
        return self.conditioning + sum(a >= (1.0 - ALIKE) * largest for a in self.amplitudes)


def observe(recording: Recording) -> Observed:
    """Return what is in a recording."""
    q, found = recording.displacement, branches(recording)
    span = float(np.ptp(q))
    amplitudes = tuple(
        float(max(np.abs(q[branch.start : branch.stop]).max() for branch in group))
        for _, group in groupby(found, lambda branch: branch.cycle)
    )
    held = list(_holds(recording, found))
    return Observed(
        channel=recording.name,
        mode=recording.mode,
        amplitudes=amplitudes,
        conditioning=recording.conditioning,
        rates=_distinct(list(_speeds(recording, found, _RAMP * max(amplitudes)))),
        holds=tuple(seconds for seconds, at in held if abs(at) > _AT_REST * span),
        rests=tuple(seconds for seconds, at in held if abs(at) <= _AT_REST * span),
        timed=recording.time is not None,
        from_rest=bool(abs(q[0]) <= _AT_REST * span),
        unloads=any(branch.kind == "unloading" for branch in found),
    )


def _holds(recording: Recording, found: Sequence[Branch]) -> Iterator[tuple[float, float]]:
    """Yield duration (s) and displacement of each hold."""
    if recording.time is None:
        return
    for branch in found:
        if branch.kind == "hold":
            cut = slice(branch.start, branch.stop)
            yield float(np.ptp(recording.time[cut])), float(recording.displacement[cut].mean())


def _speeds(recording: Recording, found: Sequence[Branch], least: float) -> Iterator[float]:
    """Yield the mean speed of each branch that is longer than `least`."""
    if recording.time is None:
        return
    for i, branch in enumerate(found):
        begin = max(departure(found, i), 0)
        way = abs(recording.displacement[branch.stop - 1] - recording.displacement[begin])
        seconds = recording.time[branch.stop - 1] - recording.time[begin]
        if branch.kind != "hold" and way > least and seconds > 0:
            yield float(way / seconds)


def _distinct(speeds: Sequence[float]) -> tuple[float, ...]:
    """Return one speed, the median, of each group that differs from the next slower one by the ratio."""
    groups: list[list[float]] = []
    for speed in sorted(speeds):
        if groups and speed < DIFFERENT_RATE * groups[-1][0]:
            groups[-1].append(speed)
        else:
            groups.append([speed])
    return tuple(float(np.median(group)) for group in groups)
