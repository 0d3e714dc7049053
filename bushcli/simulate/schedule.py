"""From a recorded path to the steps of a march, and from the march back to the samples.

If the rubber has memory, the march has to follow the whole path, but neither every sample nor the sensor's noise: on
noisy displacements it would reverse at every sample. The path is replaced by a chain of straight lines in time, as few
as stay within the noise, fitted to all samples. The chain is cut at its turning points into legs, and each leg into
steps that are finest after the turn, where memory matters most. A leg that passes the largest earlier displacement is
cut there. Samples are interpolated within their leg.

References
----------
Douglas and Peucker (1973), Cartographica 10:112-122, doi:10.3138/FM57-6770-U75U-7727 (fewest points of a line).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.segment import displacement_noise
from bushcli.simulate.steps import FEWEST_OF_LEG, FEWEST_OF_LINE, HOLD, LEG
from cases.program import Program
from cases.six import SixPath

Array = NDArray[np.float64]

# The chain stays within this many standard deviations of the displacement's noise: 400 samples reach 3.
WITHIN = 5.0
# Without noise the chain stays within this share of the range.
RESOLUTION = 2e-4
# Exponent of the grading: the first of 12 steps of a leg is 1/24 of it.
GRADING = 1.3
# Where the rate changes by this factor, a path is cut into two legs even without a turn.
ABRUPT = 2.5
# Approximate length of the first step of a hold, as a share of the hold.
FIRST_HOLD = 1e-3
# A motion whose range is less than this many standard deviations of its noise stands still: 10,000 samples reach 8.
MOVES = 10.0
# Fewer samples than this do not show their noise: all of them are taken as they are. Of the 5 samples of two legs the
# estimate took the corner for noise, of 9 it did not.
FEW = 20
# A path that does not begin at rest is preceded by a motion from rest to its beginning, in this share of its time.
LEAD = 1e-3
# A hold shorter than this share of the leg before it is the rounding of a turning point: it has steps at corners only.
BRIEF = 0.1


@dataclass(frozen=True)
class Leg:
    """Nodes `first` to `last` (both included) of a stretch without a turn; in a hold the displacement stands still."""

    first: int
    last: int
    hold: bool


@dataclass(frozen=True)
class Schedule:
    """Steps through a recorded path.

    Attributes
    ----------
    time, displacement : shape (n,)
        Nodes, s and mm or rad; without recorded times the numbers of the samples replace them.
    legs : tuple of Leg
    timed : bool
        Whether `time` is in seconds.
    """

    time: Array
    displacement: Array
    legs: tuple[Leg, ...]
    timed: bool

    @cached_property
    def _clock(self) -> Array:
        """Position of each node within its leg: along the path, or for a hold in the logarithm of time."""
        clock = np.zeros(len(self.time))
        for leg in self.legs:
            inside = slice(leg.first + 1, leg.last + 1)
            clock[inside] = self._position(leg, self.time[inside])
        return clock

    def _position(self, leg: Leg, time: Array) -> Array:
        if leg.hold:
            since = np.maximum(time - self.time[leg.first], 0.0)
            return np.log1p(since / (self.time[leg.first + 1] - self.time[leg.first]))
        nodes = slice(leg.first, leg.last + 1)
        path = np.interp(time, self.time[nodes], self.displacement[nodes])
        return np.abs(path - self.displacement[leg.first])

    def interpolation(self, time: Array) -> Array:
        """Return the matrix (samples, nodes) from values at the nodes to values at other times."""
        from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

        matrix = np.zeros((len(time), len(self.time)))
        starts = np.array([self.time[leg.first] for leg in self.legs])
        place = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(self.legs) - 1)
        for number, leg in enumerate(self.legs):
            samples = np.flatnonzero(place == number)
            if not len(samples):
                continue
            size = leg.last - leg.first + 1
            if size < 2:
                matrix[samples, leg.first] = 1.0
                continue
            clipped = np.clip(time[samples], self.time[leg.first], self.time[leg.last])
            leg_clock = np.concatenate([[0.0], self._clock[leg.first + 1 : leg.last + 1]])
            spline = CubicSpline(leg_clock, np.eye(size), bc_type="not-a-knot" if size > 3 else "natural")
            matrix[np.ix_(samples, np.arange(leg.first, leg.last + 1))] = spline(self._position(leg, clipped))
        return matrix

    def path(self, time: Array) -> Array:
        """Return the displacement at other times: the path without the sensor's noise."""
        return np.interp(time, self.time, self.displacement)


def schedule(time: Array | None, displacement: Array, noise: float, fineness: float = 1.0) -> Schedule:
    """Return the steps that follow a recorded path.

    Parameters
    ----------
    time : (n,) array or None
        Seconds, increasing; None where the rate does not matter.
    displacement : (n,) array
        mm or rad, as recorded.
    noise : float
        Standard deviation of the displacement's noise, mm or rad.
    fineness : float
        Factor on the number of steps: 2 for twice as many.
    """
    clock = np.arange(len(displacement), dtype=float) if time is None else np.asarray(time, dtype=float)
    # Of a hold alone the displacement at which it is held.
    span = float(np.ptp(displacement)) or float(np.abs(displacement).max())
    tolerance = max(WITHIN * noise, RESOLUTION * span)
    corners = _corners(clock, displacement, tolerance)
    values = _fitted_corners(clock, displacement, corners)
    if abs(values[0]) <= tolerance:
        values[0] = 0.0
    return _schedule_of_legs(clock[corners], values, span, tolerance, fineness, time is not None)


def prescribed_schedule(time: Array | None, displacement: Array) -> Schedule:
    """Return the steps of a prescribed program: its own points, cut into legs where it turns or stands still."""
    q = np.asarray(displacement, dtype=float)
    clock = np.arange(len(q), dtype=float) if time is None else np.asarray(time, dtype=float)
    kinds = np.sign(np.diff(q))
    edges = [0, *map(int, np.flatnonzero(np.diff(kinds)) + 1), len(q) - 1]
    legs = tuple(Leg(a, b, bool(kinds[a] == 0)) for a, b in pairwise(edges) if b > a)
    return Schedule(clock, q, legs, time is not None)


def _corners(time: Array, values: Array, tolerance: float) -> NDArray[np.intp]:
    """Return the fewest samples whose connecting lines stay within the tolerance of all samples (Douglas-Peucker).

    The samples are values (n,), or poses (n, 6) of which every motion has to stay within it.
    """
    corners, todo = {0, len(time) - 1}, [(0, len(time) - 1)]
    columns = values.reshape(len(time), -1)
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        inside = np.arange(first + 1, last)
        passed = (time[inside] - time[first])[:, None]
        line = columns[first] + (columns[last] - columns[first]) * passed / (time[last] - time[first])
        away = np.abs(columns[inside] - line).max(axis=1)
        worst = int(np.argmax(away))
        if away[worst] > tolerance:
            middle = int(inside[worst])
            corners.add(middle)
            todo += [(first, middle), (middle, last)]
    return np.array(sorted(corners))


def _fitted_corners(time: Array, q: Array, corners: NDArray[np.intp]) -> Array:
    """Return the values at the corners of the chain of lines that is nearest to all samples."""
    hats = np.array([np.interp(time, time[corners], row) for row in np.eye(len(corners))]).T
    return np.asarray(np.linalg.lstsq(hats, q, rcond=None)[0])


def _schedule_of_legs(
    times: Array, values: Array, span: float, tolerance: float, fineness: float, timed: bool
) -> Schedule:
    moves = np.diff(values)
    # A line that moves no further than the noise is a hold or, if it is brief, the rounding of a corner.
    kinds = np.where(np.abs(moves) <= 2 * tolerance, 0.0, np.sign(moves))
    # A much faster or slower line is a leg of its own: viscous stress has a knee there.
    pace = np.abs(moves) / np.diff(times)
    abrupt = np.maximum(pace[1:], pace[:-1]) > ABRUPT * np.minimum(pace[1:], pace[:-1])
    abrupt &= kinds[1:] != 0.0  # in a hold the pace is noise
    nodes, stops = [float(times[0])], [float(values[0])]
    legs: list[Leg] = []
    first, amplitude = 0, 0.0
    while first < len(kinds):
        last = first
        while last + 1 < len(kinds) and kinds[last + 1] == kinds[first] and not abrupt[last]:
            last += 1
        t, q = times[first : last + 2], values[first : last + 2]
        hold = bool(kinds[first] == 0.0)
        brief = bool(legs) and t[-1] - t[0] < BRIEF * (nodes[-1] - nodes[legs[-1].first])
        for t_start, end in [(t[0], t[-1])] if hold else _cut(t, q, amplitude, 2 * tolerance):
            inside = (t > t_start) & (t < end)
            part = np.concatenate([[t_start], t[inside], [end]])
            path = np.interp(part, t, q)
            if not hold:
                leg_times = _leg_times(part, path, span, fineness)
            elif brief:
                leg_times = part[1:]
            else:
                count = max(FEWEST_OF_LEG, int(np.ceil(HOLD * fineness)))
                grown = np.geomspace(FIRST_HOLD, 1.0 + FIRST_HOLD, count + 1) - FIRST_HOLD
                leg_times = part[0] + (part[-1] - part[0]) * grown[1:]
            start = len(nodes) - 1
            nodes += map(float, leg_times)
            stops += map(float, np.interp(leg_times, t, q))
            legs.append(Leg(start, len(nodes) - 1, hold))
        amplitude = max(amplitude, float(np.abs(q).max()))
        first = last + 1
    return Schedule(np.array(nodes), np.array(stops), tuple(legs), timed)


def _cut(t: Array, q: Array, amplitude: float, apart: float) -> list[tuple[float, float]]:
    """Cut a leg where it passes the largest earlier displacement, beyond which softened rubber is stiffer."""
    end = float(q[-1])
    before = np.copysign(amplitude, end)
    if min(amplitude, abs(end) - amplitude, abs(before - q[0])) <= apart or q[0] * end > before * end:
        return [(float(t[0]), float(t[-1]))]
    order = np.argsort(q)
    knee = float(np.interp(before, q[order], t[order]))
    return [(float(t[0]), knee), (knee, float(t[-1]))]


def _leg_times(t: Array, q: Array, span: float, fineness: float) -> Array:
    """Return the times of a leg's nodes after the first: graded along the path, with a node at each corner."""
    length = abs(q[-1] - q[0])
    count = max(int(np.ceil(FEWEST_OF_LEG * fineness)), int(np.ceil(LEG * fineness * length / span)))
    graded = np.linspace(0.0, 1.0, count + 1)[1:] ** GRADING
    along = np.abs(q - q[0]) / length
    times = np.interp(graded, along, t)
    # A corner near a node replaces it.
    for corner in t[1:-1]:
        nearest = int(np.argmin(np.abs(times - corner)))
        gap = np.diff(np.concatenate([t[:1], times]))[nearest]
        if nearest < len(times) - 1 and abs(times[nearest] - corner) < 0.3 * gap:
            times[nearest] = corner
        else:
            times = np.sort(np.append(times, corner))
    return np.asarray(times)


def six_schedule(
    time: Array | None, motion: Array, free: tuple[int, ...], fineness: float = 1.0
) -> tuple[SixPath, Program, Schedule]:
    """Return path, steps and interpolation that follow a recorded path of six motions.

    A motion that does not exceed its noise counts as standing still. Each line is cut into steps of equal length.
    The path's parameter is the time since its beginning; that of the interpolation is the recorded time.
    """
    clock = np.arange(len(motion), dtype=float) if time is None else np.asarray(time, dtype=float)
    # A motion that stands still is set to its mean, or zero if that is noise.
    values, tolerance = np.array(motion), np.ones(6)
    for k, column in enumerate(motion.T):
        span, noise = float(np.ptp(column)), displacement_noise(column, time) if len(motion) >= FEW else 0.0
        if span < 1e-9 or span < MOVES * noise:
            mean = float(column.mean())
            values[:, k] = 0.0 if abs(mean) <= max(WITHIN * noise, 1e-9) else mean
        else:
            tolerance[k] = max(WITHIN * noise, RESOLUTION * span)
    corners = _corners(clock, values / tolerance, 1.0)
    poses = _fitted_corners(clock, values, corners)
    poses[0] = np.where(np.abs(poses[0]) <= tolerance, 0.0, poses[0])
    span = np.ptp(poses, axis=0)
    ranged = np.where(span > 0.0, span, 1.0)
    times, legs = [float(clock[corners[0]])], []
    for (a, b), (p, q) in zip(pairwise(clock[corners]), pairwise(poses), strict=True):
        length = float(np.abs((q - p) / ranged).max())
        count = max(int(np.ceil(FEWEST_OF_LINE * fineness)), int(np.ceil(LEG * fineness * length)))
        times += map(float, np.linspace(a, b, count + 1)[1:])
        legs.append(Leg(len(times) - 1 - count, len(times) - 1, False))
    nodes = np.array(times)
    schedule = Schedule(nodes, nodes, tuple(legs), time is not None)
    knots, begins = clock[corners], clock[0]
    # The march begins at rest; a path that begins elsewhere is preceded by a short motion from rest.
    lead = LEAD * float(np.ptp(clock)) if poses[0].any() else 0.0
    if lead:
        knots, poses = np.insert(knots, 0, begins - lead), np.concatenate([np.zeros((1, 6)), poses])
    path = SixPath(knots - knots[0], poses, free)
    q = nodes - knots[0]
    turns = frozenset(int(np.argmin(np.abs(q - turn))) for turn in path.time[1:-1])
    return path, Program(q, nodes if time is not None else None, turns), schedule
