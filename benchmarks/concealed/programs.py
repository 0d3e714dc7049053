"""Programs of the rig: rich ones, which reveal much, and poor ones, which reveal little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Leg:
    """One straight leg of a program.

    Attributes
    ----------
    to : float
        End of the leg, over the amplitude.
    pace : float
        Rate over the slow rate; for a hold its duration over the time of a slow leg to the amplitude.
    """

    to: float
    pace: float


def rich(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Growing cycles to both sides, farther to one; a hold; then the same cycle twice, fast."""
    a, b, c, d, back = (float(x) for x in rng.uniform(0.92, 1.08, 5) * [0.45, 0.25, 0.7, 0.4, 0.5])
    fast = float(rng.uniform(5.0, 10.0))
    slow = [Leg(a, 1), Leg(-b, 1), Leg(c, 1), Leg(-d, 1), Leg(1.0, 1), Leg(1.0, 1.2), Leg(-back, 1)]
    return (*slow, Leg(1.0, fast), Leg(-back, fast), Leg(1.0, fast), Leg(0.0, fast))


def short(rng: np.random.Generator) -> tuple[Leg, ...]:
    """A shorter rich program for a second channel: two amplitudes, a hold, two rates."""
    a, back = (float(x) for x in rng.uniform(0.92, 1.08, 2) * [0.5, 0.6])
    fast = float(rng.uniform(5.0, 10.0))
    slow = [Leg(a, 1), Leg(-a, 1), Leg(1.0, 1), Leg(1.0, 0.8)]
    return (*slow, Leg(-back, fast), Leg(1.0, fast), Leg(0.0, fast))


def ramp(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Loading only, at one rate."""
    return (Leg(1.0, 1),)


def loop(rng: np.random.Generator) -> tuple[Leg, ...]:
    """Loading and unloading, at one rate."""
    return (Leg(1.0, 1), Leg(0.0, 1))


PROGRAMS = {"rich": rich, "short": short, "ramp": ramp, "loop": loop}
SAMPLES = {"rich": 170, "short": 120, "ramp": 120, "loop": 130}
# Share of the samples in a hold.
HOLD = 0.09


def path(legs: tuple[Leg, ...], amplitude: float, slow: float, samples: int) -> tuple[Array, Array]:
    """Time (s) and displacement at samples that are even along the legs and even in time in a hold.

    Parameters
    ----------
    legs
    amplitude
        mm or rad.
    slow
        Seconds of a slow leg from rest to the amplitude.
    samples
        Approximate number of samples.
    """
    ways = np.abs(np.diff([0.0, *(leg.to for leg in legs)]))
    holds = int(np.sum(ways == 0.0))
    density = (samples - holds * HOLD * samples) / ways.sum()
    time, q = [0.0], [0.0]
    for leg, way in zip(legs, ways, strict=True):
        n = max(6, round(HOLD * samples if way == 0.0 else density * way))
        duration = slow * (leg.pace if way == 0.0 else way / leg.pace)
        share = np.arange(1, n + 1) / n
        time += list(time[-1] + duration * share)
        q += list(q[-1] + (amplitude * leg.to - q[-1]) * share)
    return np.array(time), np.array(q)
