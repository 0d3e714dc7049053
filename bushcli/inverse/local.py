"""From one start to the nearest minimum: a bounded trust region with exact derivatives (SciPy's trf or dogbox)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear

from bushcli.inverse.problem import Problem

Array = NDArray[np.float64]
Method = Literal["trf", "dogbox", "dogleg"]
Loss = Literal["linear", "soft_l1", "huber", "cauchy", "arctan"]

# A relative change of the cost or of the parameters below this ends the search: far below what noise can tell.
TOLERANCE = 1e-7
MAX_EVALUATIONS = 200
# A misfit of this many standard deviations is where a robust loss begins to discount.
ROBUST_AT = 2.0


@dataclass(frozen=True)
class Minimum:
    """Where a search ended.

    Attributes
    ----------
    start, x : shape (parameters,)
    cost : float
        `Problem.cost` at the end.
    iterations : int
    converged : bool
    message : str
        What ended the search.
    """

    start: Array
    x: Array
    cost: float
    iterations: int
    converged: bool
    message: str


def minimise(
    problem: Problem,
    start: Array,
    lower: Array,
    upper: Array,
    method: Literal["trf", "dogbox"] = "trf",
    loss: Loss = "linear",
) -> Minimum:
    """Minimise the weighted misfit within bounds.

    Parameters
    ----------
    problem
        Its residual is not a number where a march fails, which the trust region answers by shrinking.
    start, lower, upper : shape (parameters,)
        The start must be solvable.
    method, loss
        As in `scipy.optimize.least_squares`.
    """
    mean_samples = problem.samples / len(problem.channels)
    result = least_squares(
        problem.residual,
        inside(start, lower, upper),
        jac=problem.jacobian,
        bounds=(lower, upper),
        x_scale="jac",
        method=method,
        loss=loss,
        f_scale=ROBUST_AT / np.sqrt(mean_samples),
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=1e-12,
        max_nfev=MAX_EVALUATIONS,
    )
    return Minimum(
        start,
        result.x,
        problem.cost(result.x),
        int(result.njev),
        bool(result.status > 0),
        str(result.message),
    )


def inside(x: Array, lower: Array, upper: Array) -> Array:
    """The point, moved off the bounds by a hair: the interior methods cannot start on them."""
    width = np.minimum(upper - lower, 1.0 + np.abs(x))
    return np.asarray(np.clip(x, lower + 1e-9 * width, upper - 1e-9 * width))


def scaled_start(problem: Problem, start: Array, lower: Array, upper: Array) -> Array:
    """The start with the parameters in which the energy is linear at the right scale.

    One evaluation takes out any error of scale. If the sleeves' motion prescribes the deformation (coupons), the force
    is linear in each of these parameters and all get their best values at once. In a bushing the deformation depends
    on their ratios, and a common factor is exact, to the rubber's compressibility.

    Where the start cannot be solved, the other parameters are enlarged: laws that lock then lock later.
    """
    free = np.array([name in problem.law.linear for name in problem.names])
    for enlarged in (1.0, 3.0, 10.0, 30.0):
        trial = inside(np.where(free, start, start * enlarged), lower, upper)
        forces = problem.forces(trial)
        if forces is not None:
            break
    else:
        return start
    if not free.any() or any(name in problem.law.linear for name in problem.fixed):
        return trial
    weights = [1.0 / (channel.scale * np.sqrt(len(channel.scale))) for channel in problem.channels]
    force = np.concatenate([f * w for (f, _), w in zip(forces, weights, strict=True)])
    wanted = np.concatenate([c.recording.force * w for c, w in zip(problem.channels, weights, strict=True)])
    factor = float(force @ wanted / (force @ force))
    candidates = []
    if factor > 0:
        candidates.append(np.where(free, trial * factor, trial))
    if all(channel.coupon for channel in problem.channels):
        slope = np.concatenate([s[:, free] * w[:, None] for (_, s), w in zip(forces, weights, strict=True)])
        size = np.linalg.norm(slope, axis=0)
        best = lsq_linear(slope / size, wanted, (lower[free] * size, upper[free] * size))
        whole = trial.copy()
        whole[free] = best.x / size
        candidates.append(whole)
    tried = [inside(candidate, lower, upper) for candidate in candidates]
    costs = [problem.cost(candidate) for candidate in tried]
    reached = [(cost, i) for i, cost in enumerate(costs) if np.isfinite(cost)]
    return tried[min(reached)[1]] if reached else trial
