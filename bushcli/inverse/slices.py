"""Along a wall of parameters that cannot be solved: slices through the point where a search ended beside it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bushcli.inverse.local import STATIONARY, Loss, Minimum, Stopped, Watched, minimise
from bushcli.inverse.problem import Problem

Array = NDArray[np.float64]

# Evaluations of a slice, and failed ones in a row that end it: a trust region that finds its way needs half of them.
SLICE_EVALUATIONS = 12
PATIENCE = 3
ROUNDS = 3


def along_the_wall(
    problem: Problem,
    ended: Minimum,
    lower: Array,
    upper: Array,
    method: Literal["trf", "dogbox"],
    loss: Loss,
) -> Minimum:
    """Go on from where a search ended beside failures, with one direction held at a time, while that lowers the misfit.

    The directions are the parameters and, for walls across them, the singular directions of the Jacobian. A search with
    all parameters free follows every slice that got further. What remains is not called a minimum.
    """
    best = ended
    for _ in range(ROUNDS):
        before = best.cost
        for held in _directions(problem, best.x):
            x = _slice(problem, best.x, held, lower, upper)
            if problem.cost(x) < best.cost * (1 - STATIONARY):
                found = minimise(problem, x, lower, upper, method, loss)
                if found.cost < best.cost:
                    best = replace(found, iterations=best.iterations + found.iterations)
                if not best.beside_failure:
                    return best
        if best.cost > before * (1 - STATIONARY):
            break
    return best


def _directions(problem: Problem, x: Array) -> Array:
    """Unit vectors in the parameters' scales, shape (n, parameters)."""
    if len(x) == 1:
        return np.zeros((0, 1))
    slope = problem.jacobian(x)
    _, _, rows = np.linalg.svd(slope / _norms(slope), full_matrices=False)
    return np.vstack([np.eye(len(x)), rows])


def _norms(slope: Array) -> Array:
    norms = np.linalg.norm(slope, axis=0)
    return np.asarray(np.where(norms == 0, 1.0, norms))


def _slice(problem: Problem, x: Array, held: Array, lower: Array, upper: Array) -> Array:
    """Best solvable point that differs from `x` across the held direction only."""
    norms = _norms(problem.jacobian(x))
    # Columns: a basis of what is left free, in the parameters' own units.
    basis = np.linalg.svd(held[None, :])[2][1:].T / norms[:, None]

    def at(y: Array) -> Array:
        # Outside the bounds there is nothing to ask: the nearest point within answers, and is taken if it is better.
        return np.asarray(np.clip(x + basis @ y, lower, upper))

    watched = Watched(problem, None, PATIENCE)
    with suppress(Stopped):
        least_squares(
            lambda y: watched.residual(at(y)),
            np.zeros(basis.shape[1]),
            jac=lambda y: problem.jacobian(at(y)) @ basis,
            xtol=problem.tolerance,
            ftol=STATIONARY,
            max_nfev=SLICE_EVALUATIONS,
        )
    problem.trial = None
    return watched.best[1]
