"""Dissipated energy and stiffness of each cycle of a curve, with the uncertainty due to the noise.

- *Path* of a cycle: its samples (`bushcli.curve.segment` cuts) and the one before them, from which it starts.
- *Closed*: the displacement comes back to where the cycle began, within 8 standard deviations of its noise or
  1 % of the cycle's range. Where samples are coarse the path begins and ends at points interpolated between two
  samples: at zero where the motion goes through it, else at the displacement of its first sample.
- *Hysteresis energy*: the net work over the path, the integral of force by displacement, by the trapezoidal
  rule; positive is dissipated. For a closed cycle it is the area of the loop. For an *open* cycle it includes the
  energy that the rubber still stores.
- *Loss*: hysteresis energy over the work done while loading. An elastic cycle has 0.
- *Secant stiffness*: defined as for a whole curve (`Curve.secant_stiffness`), over the cycle. Only the first
  sample of a hold counts: the relaxed force belongs to another displacement history.

Standard errors are those of independent noise in force and displacement: the trapezoidal rule is linear in the
force with weights (q[i+1] - q[i-1])/2, and in the displacement with corresponding differences of the force.
Systematic errors, such as a force that is logged late, are not included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.curve.segment import AT_THE_TURN, OVERSHOOT, TURN, Segment
from bushcli.curve.signals import departure

Array = NDArray[np.float64]

# Share of the travel within which a cycle closes where noise is smaller: judgement.
_CLOSED_SHARE = 0.01
_END = 0.01  # as `Curve.secant_stiffness`


@dataclass(frozen=True)
class Uncertain:
    """A value and its standard error, in the same unit."""

    value: float
    std: float = 0.0


@dataclass(frozen=True)
class Noise:
    """Standard deviations of force (N, N mm, MPa) and displacement (mm, rad, 1)."""

    force: float = 0.0
    displacement: float = 0.0


NO_NOISE = Noise()


@dataclass(frozen=True)
class Cycle:
    """One full reversal, or one excursion to one side (`bushcli.curve.segment`).

    Attributes
    ----------
    number : int
        From 1.
    lowest, highest : float
        Extreme displacements, mm or rad; stretch - 1 of a coupon.
    rate : float or None
        Mean speed of the motion without holds, mm/s or rad/s or 1/s; None without time.
    closed : bool
        Whether it ends at the displacement at which it began.
    energy : Uncertain
        Hysteresis energy, N mm; MPa (energy per volume) of a coupon. Of an open cycle the net work.
    loss : Uncertain
        Hysteresis energy over the work done while loading, dimensionless; nan where no work was done. An open cycle is
        closed by the straight line to where it began; if it does not come back at all, the loss is nan.
    secant : Uncertain
        Secant stiffness, N/mm, N mm/rad or MPa.
    peak_force : Uncertain
        Force of largest absolute value, with its sign, N, N mm or MPa.
    """

    number: int
    lowest: float
    highest: float
    rate: float | None
    closed: bool
    energy: Uncertain
    loss: Uncertain
    secant: Uncertain
    peak_force: Uncertain


def noise_of(curve: Curve) -> Noise:
    """Return the noise of a recorded curve, estimated from the curve itself."""
    return Noise(curve.force_noise, curve.displacement_noise)


def cycles(curve: Curve, noise: Noise = NO_NOISE) -> tuple[Cycle, ...]:
    """Return every cycle of a curve."""
    return tuple(cycle for cycle in cycles_along(curve, curve.force, noise) if cycle is not None)


def cycles_along(
    path: Curve, force: Array, noise: Noise = NO_NOISE, segments: Sequence[Segment] | None = None
) -> tuple[Cycle | None, ...]:
    """Return every cycle of a path with another force, such as that simulated at the recorded samples.

    Parameters
    ----------
    path : Curve
        n samples; its force is not used.
    force : (n,) array
        nan where it is not known.
    noise : Noise
        Noise of path and force.
    segments : sequence of Segment, optional
        Branches of the path, if it has been cut already.

    Returns
    -------
    tuple
        One entry per cycle of the path; None where the force is not known throughout the cycle, or nothing moves.
    """
    segments = path.branches if segments is None else segments
    cycles: list[Cycle | None] = []
    for _, group in groupby(enumerate(segments), lambda item: item[1].cycle):
        numbers, part = zip(*group, strict=True)
        start = departure(segments, numbers[0])
        known = np.isfinite(force[start : part[-1].stop]).all()
        moves = any(branch.kind != "hold" for branch in part)
        cycles.append(_cycle(part, start, path, force, noise) if known and moves else None)
    return tuple(cycles)


def _cycle(part: Sequence[Segment], start: int, path: Curve, force: Array, noise: Noise) -> Cycle:
    """Return a cycle that starts from the sample `start`: the one before it, unless cycles between are left out."""
    end = part[-1].stop
    q = path.displacement[start:end]
    near = max(TURN * path.displacement_noise, _CLOSED_SHARE * float(np.ptp(q)))
    closed, q_loop, force_loop = _loop(path.displacement, force, start, end, near)
    if not closed:
        # The way back to rest, or to a preload, may follow the loop.
        distance = np.abs(q - q[0])
        for branch in part[-2::-1]:
            rest = branch.stop - start
            if distance[rest - 1] <= near and distance[rest:].max() < AT_THE_TURN * distance.max():
                closed, q_loop, force_loop = _loop(path.displacement, force, start, branch.stop, near)
                break
    x, y = (np.append(signal, signal[0]) if closed else signal for signal in (q_loop, force_loop))
    by_force, by_q = _weights(x, closed), _weights(y, closed)
    variance = noise.force**2 * float(by_force @ by_force) + noise.displacement**2 * float(by_q @ by_q)
    energy = Uncertain(float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x))), float(np.sqrt(variance)))
    loading = [slice(max(b.start - 1, start), b.stop) for b in part if b.kind == "loading"]
    work = sum(float(np.trapezoid(force[segment], path.displacement[segment])) for segment in loading)
    known = work > 0 and (closed or any(branch.kind == "unloading" for branch in part))
    stored = 0.0 if closed else 0.5 * float((force_loop[0] + force_loop[-1]) * (q_loop[-1] - q_loop[0]))
    loss = Uncertain(np.nan, np.nan)
    if known:
        loss = Uncertain((energy.value - stored) / work, energy.std / work)
    rate = None
    if path.time is not None:
        moving = [(max(b.start - 1, start), b.stop - 1) for b in part if b.kind != "hold"]
        distance = sum(abs(path.displacement[last] - path.displacement[first]) for first, last in moving)
        seconds = sum(path.time[last] - path.time[first] for first, last in moving)
        rate = float(distance / seconds) if seconds > 0 else None
    # Of each hold only the first sample.
    pieces = [np.arange(b.start, b.start + 1 if b.kind == "hold" else b.stop) for b in part]
    counted = np.unique(np.concatenate([[start], *pieces]))
    chord = Curve(path.mode, path.displacement[counted], force[counted])
    secant, x = chord.secant_stiffness(), chord.displacement
    lowest, highest = float(x.min()), float(x.max())
    span = (highest - lowest) or np.nan
    ends = [np.count_nonzero(near) for near in (x <= lowest + _END * span, x >= highest - _END * span)]
    means = np.sqrt(1 / max(ends[0], 1) + 1 / max(ends[1], 1))
    peak = float(force[start:end][np.argmax(np.abs(force[start:end]))])
    return Cycle(
        number=part[0].cycle,
        lowest=float(q.min()),
        highest=float(q.max()),
        rate=rate,
        closed=closed,
        energy=energy,
        loss=loss,
        secant=Uncertain(secant, float(np.hypot(noise.force, secant * noise.displacement) * means / span)),
        peak_force=Uncertain(peak, noise.force),
    )


def _loop(q: Array, force: Array, begin: int, end: int, slack: float) -> tuple[bool, Array, Array]:
    """Return whether a path closes, and its points; ends are interpolated where samples are coarse."""
    q_path, force_path = q[begin:end], force[begin:end]
    # A motion through zero is cut at the sample next to zero, but the loops of both sides have to end at zero itself.
    through = 0 < begin < end - 1 and (q[begin] - q[begin - 1]) * (q[begin + 1] - q[begin]) > 0
    if through and abs(q[begin]) > slack:
        for i in (begin, begin + 1):
            there = _force_at(0.0, q, force, i)
            if there is not None:
                q_path, force_path = np.append(0.0, q[i:end]), np.append(there, force[i:end])
                break
    start = float(q_path[0])
    if abs(q_path[-1] - start) <= slack:
        return True, q_path, force_path
    # The end is between the last sample and the next cycle's first, between the last two, or a little earlier where the
    # motion passed the start before it turned.
    near = OVERSHOOT * float(np.ptp(q_path))
    for i in range(end, begin + 1, -1):
        there = _force_at(start, q, force, i)
        if there is not None:
            count = len(q_path) - (end - i)
            return True, np.append(q_path[:count], start), np.append(force_path[:count], there)
        if i < end and abs(q[i] - start) > near:
            break
    return False, q_path, force_path


def _force_at(target: float, q: Array, force: Array, i: int) -> float | None:
    """Return the force where the displacement passes a target between samples i - 1 and i; None if it does not."""
    if (
        not (0 < i < len(q))
        or (q[i - 1] - target) * (q[i] - target) >= 0
        or not np.isfinite(force[i - 1 : i + 1]).all()
    ):
        return None
    share = (target - q[i - 1]) / (q[i] - q[i - 1])
    return float((1 - share) * force[i - 1] + share * force[i])


def _weights(x: Array, closed: bool) -> Array:
    """Return half the difference between the next and the previous point, for each point of a path."""
    if closed:
        ring = x[:-1]
        return np.asarray(0.5 * (np.roll(ring, -1) - np.roll(ring, 1)))
    padded = np.concatenate([x[:1], x, x[-1:]])
    return np.asarray(0.5 * (padded[2:] - padded[:-2]))
