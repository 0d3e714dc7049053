"""Several starts: a Latin hypercube or differential evolution on a coarse mesh, then refined.

Starts are spread around the scale that the recordings themselves give, not over bounds of nine decades. The work is
shared among processes; the result does not depend on their number.

References
----------
McKay, Beckman and Conover (1979), Technometrics 21:239-245, doi:10.2307/1268522.
Storn and Price (1997), J. Global Optim. 11:341-359, doi:10.1023/A:1008202821328.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.problem import Bounds

Array = NDArray[np.float64]
Costs = Callable[[Sequence[Array]], list[float]]

# Starts are spread within this factor of the scaled start.
SPREAD = 10.0
# Candidates screened for each start that is refined.
SCREENED = 8
POPULATION, GENERATIONS = 6, 12


def box(start: Array, bounds: Bounds, shear: float) -> tuple[Array, Array]:
    """Return the box of starts: a factor `SPREAD` about the start, and both signs where the bounds allow them.

    `shear` (MPa) is the scale of a parameter whose start says little because it is near zero.
    """
    size = np.maximum(np.abs(start), 0.01 * shear)
    low = np.where(bounds.lower >= 0, start / SPREAD, -SPREAD * size)
    high = np.where(bounds.lower >= 0, start * SPREAD, SPREAD * size)
    return np.maximum(low, bounds.lower), np.minimum(high, bounds.upper)


def hypercube(count: int, low: Array, high: Array, seed: int) -> Array:
    """Return a Latin hypercube in the box, shape (count, parameters); logarithmic where the box is positive."""
    from scipy.stats import qmc  # 0.3 s: not for commands that only simulate

    unit = qmc.LatinHypercube(len(low), rng=np.random.default_rng(seed)).random(count)
    return from_unit(unit, low, high)


def from_unit(unit: Array, low: Array, high: Array) -> Array:
    """Map points of the unit cube to the box, logarithmically along parameters whose box is positive."""
    safe = np.where(low > 0, low, 1.0)
    ratio = np.where(low > 0, np.maximum(high, safe) / safe, 1.0)
    return np.asarray(np.where(low > 0, safe * ratio**unit, low + unit * (high - low)))


def screen_starts(costs: Costs, count: int, low: Array, high: Array, seed: int) -> list[Array]:
    """Return the `count` points of a larger hypercube that have the lowest cost on the coarse mesh."""
    candidates = list(hypercube(SCREENED * count, low, high, seed))
    screened = costs(candidates)
    order = sorted((cost, i) for i, cost in enumerate(screened) if np.isfinite(cost))
    return [candidates[i] for _, i in order[:count]]


def evolve_start(costs: Costs, low: Array, high: Array, seed: int) -> Array:
    """Return the best point of differential evolution on the coarse mesh; points that cannot be solved always lose.

    Each generation is evaluated as a whole, so that any number of processes can share it without changing the result.
    """
    from scipy.optimize import differential_evolution

    def mapped(_: object, units: Iterable[Array]) -> list[float]:
        screened = costs([from_unit(np.asarray(unit), low, high) for unit in units])
        return [cost if np.isfinite(cost) else float("inf") for cost in screened]

    evolved = differential_evolution(
        # `mapped` evaluates generations as a whole.
        lambda unit: float("nan"),
        [(0.0, 1.0)] * len(low),
        rng=np.random.default_rng(seed),
        popsize=POPULATION,
        maxiter=GENERATIONS,
        init="latinhypercube",
        polish=False,
        tol=1e-3,
        updating="deferred",
        workers=mapped,
    )
    return from_unit(np.asarray(evolved.x), low, high)
