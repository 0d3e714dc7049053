"""Relaxation of the force while the displacement is held, with the uncertainty due to the noise.

The hold starts at its first sample. The force at the start is that of this sample: the force relaxes fastest there,
and a mean would hide that. A later force, at the standard times and at the end, is the value of a straight line in
the logarithm of time through the samples within a factor of 1.25 of that time, which averages the noise and follows
an exponential decay to 0.2 % of its amplitude; with fewer than 3 such samples it is interpolated between
neighbours. *Relaxation* is the ratio of the force lost since the start to the force at the start. It is not given
if the force at the start is less than 5 standard errors: no force was held.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.curve.cycles import NO_NOISE, Noise, Uncertain
from bushcli.curve.segment import Segment

Array = NDArray[np.float64]

#: Seconds after the start of a hold: decades, as relaxation is usually reported (ISO 3384 plots it over log time).
STANDARD_TIMES = (1.0, 10.0, 100.0, 1000.0, 10000.0, 100000.0)
_WINDOW = 1.25
_HELD = 5.0


@dataclass(frozen=True)
class Hold:
    """One hold.

    Attributes
    ----------
    number : int
        From 1, in the order of the recording.
    cycle : int
        Number of the cycle that it belongs to.
    start, stop : int
        Samples ``start:stop``.
    displacement : float
        Mean over the hold, mm or rad; stretch - 1 of a coupon.
    duration : float or None
        s; None without time.
    force_start, force_end : Uncertain
        N, N mm or MPa.
    relaxation : Uncertain
        Ratio of the force lost in the hold to the force at its start; negative where the force grows in absolute
        value, nan where no force is held.
    after
        Seconds -> relaxation after that time, for the `STANDARD_TIMES` that the hold reaches; empty without time.
    """

    number: int
    cycle: int
    start: int
    stop: int
    displacement: float
    duration: float | None
    force_start: Uncertain
    force_end: Uncertain
    relaxation: Uncertain
    after: Mapping[float, Uncertain] = field(default_factory=dict)


def holds(curve: Curve, noise: Noise = NO_NOISE) -> tuple[Hold, ...]:
    """Return every hold of a curve."""
    return tuple(hold for hold in holds_along(curve, curve.force, noise) if hold is not None)


def holds_along(
    path: Curve,
    force: Array,
    noise: Noise = NO_NOISE,
    segments: Sequence[Segment] | None = None,
    least_force: float = 0.0,
) -> tuple[Hold | None, ...]:
    """Return every hold of a path with another force, such as that simulated at the recorded samples.

    Parameters
    ----------
    path : Curve
        n samples; its force is not used.
    force : (n,) array
        nan where it is not known.
    noise : Noise
        Noise of the force.
    segments : sequence of Segment, optional
        Branches of the path, if it has been cut already.
    least_force : float
        Smallest held force for which a relaxation is given, in the unit of the force; for a simulation that is compared
        with a recording, the force that the recording's noise hides.

    Returns
    -------
    tuple
        One entry per hold of the path; None where the force is not known throughout the hold.
    """
    segments = path.branches if segments is None else segments
    sigma = noise.force
    least = max(least_force, _HELD * sigma)
    holds: list[Hold | None] = []
    for branch in (branch for branch in segments if branch.kind == "hold"):
        samples = slice(branch.start, branch.stop)
        held, time = force[samples], None if path.time is None else path.time[samples]
        if not np.isfinite(held).all():
            holds.append(None)
            continue
        # Without time, the sample numbers give the order but not the duration.
        since = np.arange(len(held), dtype=float) if time is None else time - time[0]
        end = float(since[-1])
        first, last = np.eye(1, len(held))[0], _weights(since, end)
        reached = [] if time is None else [at for at in STANDARD_TIMES if since[1] <= at <= end]
        holds.append(
            Hold(
                number=len(holds) + 1,
                cycle=branch.cycle,
                start=branch.start,
                stop=branch.stop,
                displacement=float(path.displacement[samples].mean()),
                duration=None if time is None else end,
                force_start=Uncertain(float(held[0]), sigma),
                force_end=Uncertain(float(last @ held), sigma * float(np.linalg.norm(last))),
                relaxation=_relaxation(first, last, held, sigma, least),
                after={at: _relaxation(first, _weights(since, at), held, sigma, least) for at in reached},
            )
        )
    return tuple(holds)


def _weights(since: Array, at: float) -> Array:
    """Return the weights (n,) of the samples in the force at a time since the start."""
    weights = np.zeros(len(since))
    near = np.flatnonzero((since >= at / _WINDOW) & (since <= at * _WINDOW) & (since > 0))
    if len(near) >= 3:
        x = np.log(since[near] / at)
        weights[near] = np.linalg.pinv(np.column_stack([np.ones_like(x), x]))[0]
        return weights
    after = min(int(np.searchsorted(since, at)), len(since) - 1)
    before = max(after - 1, 0)
    share = (at - since[before]) / (since[after] - since[before])
    weights[before], weights[after] = 1.0 - share, share
    return weights


def _relaxation(first: Array, then: Array, held: Array, sigma: float, least: float) -> Uncertain:
    start, end = float(first @ held), float(then @ held)
    if abs(start) <= least:
        return Uncertain(float("nan"), float("nan"))
    # Both forces are weighted sums of the same samples, so that their errors are not independent.
    by_sample = first * end / start**2 - then / start
    return Uncertain(1.0 - end / start, sigma * float(np.linalg.norm(by_sample)))
