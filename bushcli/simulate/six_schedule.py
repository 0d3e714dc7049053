"""From a recorded path of six motions to the steps of a march.

As in `bushcli.simulate.schedule` for one motion, the path is replaced by a chain of straight lines in time, as few as
stay within the noise of every motion, fitted to all samples. Each line is cut into steps, and samples are interpolated
within it. A motion that does not exceed its noise counts as standing still.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.segment import displacement_noise
from bushcli.simulate.schedule import RESOLUTION, WITHIN, Leg, Schedule, fitted_corners
from bushcli.simulate.steps import FEWEST_OF_LINE, LEG
from cases.program import Program
from cases.six import SixPath

Array = NDArray[np.float64]

# A motion whose range is less than this many standard deviations of its noise stands still: 10,000 samples reach 8.
MOVES = 10.0
# Fewer samples than this do not show their noise: all of them are taken as they are. Of the 5 samples of two legs the
# estimate took the corner for noise, of 9 it did not.
FEW = 20
# A path that does not begin at rest is preceded by a motion from rest to its beginning, in this share of its time.
LEAD = 1e-3


def still(motion: Array, time: Array | None) -> NDArray[np.bool_]:
    """Return which motions (6,) stand still apart from noise.

    Parameters
    ----------
    motion : (n, 6) array
        mm and rad.
    time : (n,) array or None
        s.
    """
    found = np.ones(6, dtype=bool)
    for k in range(6):
        span = float(np.ptp(motion[:, k]))
        found[k] = span < 1e-9 or span < MOVES * _noise(motion[:, k], time)
    return found


def _noise(motion: Array, time: Array | None) -> float:
    return displacement_noise(motion, time) if len(motion) >= FEW else 0.0


def six_schedule(
    time: Array | None, motion: Array, free: tuple[int, ...], fineness: float = 1.0
) -> tuple[SixPath, Program, Schedule]:
    """Return path, steps and interpolation that follow a recorded path.

    The path's parameter is the time since its beginning; that of the interpolation is the recorded time.
    """
    clock = np.arange(len(motion), dtype=float) if time is None else np.asarray(time, dtype=float)
    values, tolerance = _quiet(motion, time)
    scaled = values / tolerance
    corners = _corners(clock, scaled)
    poses = fitted_corners(clock, values, corners)
    poses[0] = np.where(np.abs(poses[0]) <= tolerance, 0.0, poses[0])
    nodes, legs = _stepped(clock[corners], poses, fineness)
    schedule = Schedule(nodes, nodes, legs, time is not None)
    knots, begins = clock[corners], clock[0]
    # The march begins at rest; a path that begins elsewhere is preceded by a short motion from rest.
    lead = LEAD * float(np.ptp(clock)) if poses[0].any() else 0.0
    if lead:
        knots, poses = np.insert(knots, 0, begins - lead), np.concatenate([np.zeros((1, 6)), poses])
    path = SixPath(knots - knots[0], poses, free)
    q = nodes - knots[0]
    turns = frozenset(int(np.argmin(np.abs(q - one))) for one in path.time[1:-1])
    return path, Program(q, nodes if time is not None else None, turns), schedule


def _quiet(motion: Array, time: Array | None) -> tuple[Array, Array]:
    """Return motions and tolerances (6,); a motion that stands still is set to its mean, or zero if that is noise."""
    values, tolerance = np.array(motion), np.ones(6)
    for k, stands in enumerate(still(motion, time)):
        noise = _noise(motion[:, k], time)
        if stands:
            mean = float(motion[:, k].mean())
            values[:, k] = 0.0 if abs(mean) <= max(WITHIN * noise, 1e-9) else mean
        else:
            tolerance[k] = max(WITHIN * noise, RESOLUTION * float(np.ptp(motion[:, k])))
    return values, tolerance


def _corners(time: Array, scaled: Array) -> NDArray[np.intp]:
    """Return the fewest samples whose connecting lines stay within 1 of all samples (Douglas-Peucker)."""
    chosen, todo = {0, len(time) - 1}, [(0, len(time) - 1)]
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        inside = np.arange(first + 1, last)
        share = (time[inside] - time[first]) / (time[last] - time[first])
        line = scaled[first] + share[:, None] * (scaled[last] - scaled[first])
        away = np.abs(scaled[inside] - line).max(axis=1)
        worst = int(np.argmax(away))
        if away[worst] > 1.0:
            middle = int(inside[worst])
            chosen.add(middle)
            todo += [(first, middle), (middle, last)]
    return np.array(sorted(chosen))


def _stepped(times: Array, poses: Array, fineness: float) -> tuple[Array, tuple[Leg, ...]]:
    span = np.ptp(poses, axis=0)
    ranged = np.where(span > 0.0, span, 1.0)
    nodes, legs = [float(times[0])], []
    for (a, b), (p, q) in zip(pairwise(times), pairwise(poses), strict=True):
        length = float(np.abs((q - p) / ranged).max())
        count = max(int(np.ceil(FEWEST_OF_LINE * fineness)), int(np.ceil(LEG * fineness * length)))
        first = len(nodes) - 1
        nodes += map(float, np.linspace(a, b, count + 1)[1:])
        legs.append(Leg(first, len(nodes) - 1, False))
    return np.array(nodes), tuple(legs)
