"""Recordings that could be made next, as data: path, rates, holds, and cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.mode import modes

Array = NDArray[np.float64]

# Minutes to set up a program on a mounted specimen, and to mount it in another direction. Guesses: nothing but the
# order of costs depends on them.
SET_UP = 5.0
REMOUNT = 40.0


@dataclass(frozen=True)
class Proposal:
    """A candidate for the next recording.

    Attributes
    ----------
    name : str
        For readers: "axial, once to the largest amplitude and back".
    channel : str
        Mode.
    points : (k + 1,) tuple of float
        Displacements that the path goes through, mm or rad.
    rates : (k,) tuple of float
        From each point to the next, mm/s or rad/s.
    holds : (k + 1,) tuple of float
        Time spent at each point, s.
    cost : float
        Minutes.
    """

    name: str
    channel: str
    points: tuple[float, ...]
    rates: tuple[float, ...]
    holds: tuple[float, ...]
    cost: float

    @property
    def repeats(self) -> bool:
        """Whether it is one cycle twice, at one rate."""
        zero, first, back, *again = self.points
        return tuple(again) == (first, back) and zero == back and len(set(self.rates)) == 1

    def program(self, samples: int) -> tuple[Array, Array]:
        """Return time (n,) in s and displacement (n,), with `samples` points on the longest way and in each hold."""
        longest = max(abs(b - a) for a, b in zip(self.points[:-1], self.points[1:], strict=True))
        time, q = [np.zeros(1)], [np.array(self.points[:1])]

        def go_on(target: float, seconds: float, steps: int) -> None:
            time.append(time[-1][-1] + seconds * np.arange(1, steps + 1) / steps)
            q.append(np.linspace(q[-1][-1], target, steps + 1)[1:])

        ways = zip(self.points, (None, *self.rates), self.holds, strict=True)
        for target, rate, hold in ways:
            way = abs(target - float(q[-1][-1]))
            if rate is not None and way > 0:
                go_on(target, way / rate, max(3, round(samples * way / longest)))
            if hold > 0:
                go_on(target, hold, samples)
        return np.concatenate(time), np.concatenate(q)


def menu(
    amplitudes: Mapping[str, float], rate: Mapping[str, float], mounted: Sequence[str]
) -> tuple[Proposal, ...]:
    """Return the candidates for the next recording.

    `amplitudes` and `rate` give the largest displacement that may be proposed (mm or rad) and an ordinary rate (mm/s or
    rad/s) for every mode that can be tested; those that are `mounted` have been recorded and need no remounting.
    """
    proposals: list[Proposal] = []
    for channel, a in amplitudes.items():
        extra = 0.0 if channel in mounted else REMOUNT
        # A strip or a sheet cannot be pushed: it buckles, and its strain cannot be less than -1.
        coupon = modes()[channel].specimen == "coupon"
        for text, points, rates, holds in _plans(a, rate[channel]):
            if coupon and min(points) < 0:
                continue
            ways = zip(points[:-1], points[1:], rates, strict=True)
            seconds = sum(abs(end - start) / speed for start, end, speed in ways) + sum(holds)
            cost = SET_UP + extra + seconds / 60.0
            proposals.append(Proposal(f"{channel}, {text}", channel, points, rates, holds, cost))
    return tuple(sorted(proposals, key=lambda proposal: (proposal.cost, proposal.name)))


def _plans(
    a: float, v: float
) -> tuple[tuple[str, tuple[float, ...], tuple[float, ...], tuple[float, ...]], ...]:
    """Return programs to `a` (mm or rad) at a rate `v`: name, points, rate of each way, and hold at each point."""
    slow, fast = v / 10.0, v * 10.0
    minute, long = 60.0, 600.0
    return (
        ("once to the largest amplitude and back", (0.0, a, 0.0), (v, v), (0.0, 0.0, 0.0)),
        ("once to the largest amplitude and back, ten times as fast", (0.0, a, 0.0), (fast,) * 2, (0.0,) * 3),
        ("to both sides", (0.0, a, -a, 0.0), (v, v, v), (0.0,) * 4),
        ("twice to the same amplitude", (0.0, a, 0.0, a, 0.0), (v,) * 4, (0.0,) * 5),
        (
            "cycles of growing amplitude",
            (0.0, a / 3, 0.0, a / 3, 0.0, 2 * a / 3, 0.0, 2 * a / 3, 0.0, a, 0.0, a, 0.0),
            (v,) * 12,
            (0.0,) * 13,
        ),
        ("with a hold at the peak", (0.0, a, 0.0), (v, v), (0.0, long, 0.0)),
        (
            "with holds on the way up and down",
            (0.0, a / 2, a, a / 2, 0.0),
            (v,) * 4,
            (0, minute, minute, minute, 0),
        ),
        (
            "conditioned, then at two rates",
            (0.0, a, 0.0, a, 0.0, a, 0.0),
            (v, v, slow, slow, fast, fast),
            (0.0, 0.0, 0.0, 0.0, minute, 0.0, 0.0),
        ),
        (
            "small cycles about zero, to both sides",
            (0.0, a / 10, -a / 10, a / 10, 0.0),
            (v / 10,) * 4,
            (0.0,) * 5,
        ),
    )
