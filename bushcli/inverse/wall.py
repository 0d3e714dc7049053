"""Search along the boundary of the parameters for which the model can be solved, for the lowest misfit.

A wall has no derivative: only points on either side of it are known. Near the point where a search ended it is
approximated by the plane that separates solved points from failed points with the widest margin. A step lowers the
linearised misfit within that plane; a step that fails adds a failed point, which turns the plane.

References
----------
Lawson and Hanson (1995), Solving Least Squares Problems, SIAM, chapter 23, doi:10.1137/1.9781611971217 (least distance
programming, for the plane).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from bushcli.inverse.local import STATIONARY, Loss, Minimum, minimise
from bushcli.inverse.problem import LeastSquaresProblem

Array = NDArray[np.float64]

# Rounds, each of steps along the wall and a search in all directions; trials along the wall in one round.
ROUNDS, TRIALS = 4, 16
# Distance of a probe of the wall's direction, in the parameters' scales, as a share of the misfit.
PROBE = 0.05
# Nearest points of each kind that define the plane: further away the wall may bend.
NEAREST = 6
# Failed trials in a row that end the free search of a round: it approaches the wall, and need not explore it again.
PATIENCE = 3


def along_the_wall(
    problem: LeastSquaresProblem,
    ended: Minimum,
    loss: Loss,
) -> Minimum:
    """Continue a search that ended beside failures; its end counts as a minimum only away from the boundary."""
    best = ended
    for _ in range(ROUNDS):
        before = best.cost
        x = _steps(problem, best.x)
        if problem.cost(x) >= before:
            break
        found = minimise(problem, x, loss, PATIENCE)
        best = replace(found, iterations=best.iterations + found.iterations)
        if not best.beside_failure or best.cost > before * (1 - STATIONARY):
            break
    return best


def _steps(problem: LeastSquaresProblem, x: Array) -> Array:
    """Return the best point found by steps within the plane of the boundary; every failure turns the plane."""
    reach = np.inf
    for _ in range(TRIALS):
        value, slope = problem.residual(x), problem.jacobian(x)
        norms = np.linalg.norm(slope, axis=0)
        norms[norms == 0] = 1.0
        failed, solved = known(problem, x, norms)
        normal = plane(failed, solved)
        if normal is None:
            break
        # Within the plane: all directions but the normal, in the parameters' scales.
        basis = np.linalg.svd(normal[None, :])[2][1:].T
        step = basis @ np.linalg.lstsq(slope / norms @ basis, -value, rcond=None)[0]
        length = float(np.linalg.norm(step))
        predicted = value @ value - np.sum((value + slope / norms @ step) ** 2)
        if predicted < STATIONARY * (value @ value) or length == 0.0:
            # Nothing can be gained in this plane, but it may not be the wall's: probe where no point is known yet.
            side = _unknown(np.hstack([basis, -basis]).T, np.vstack([failed, solved]))
            if side is None:
                break
            step, length = PROBE * np.sqrt(value @ value) * side, 0.0
        share = min(1.0, reach / length) if length else 1.0
        trial = problem.bounds.clip(x + share * step / norms)
        after = problem.residual(trial)
        if np.isfinite(after).all() and after @ after < value @ value:
            x, reach = trial, 2.0 * reach
        elif length:
            reach = 0.5 * min(length, reach)
    return x


def _unknown(sides: Array, points: Array) -> Array | None:
    """Return the first of some directions that has no point within 25 degrees."""
    return next((side for side in sides if not (points @ side > 0.9).any()), None)


def known(problem: LeastSquaresProblem, x: Array, norms: Array) -> tuple[Array, Array]:
    """Directions from `x` to the nearest points that failed, and to those solved, shape (n, parameters), unit length.

    Of points in nearly the same direction only the nearest is used.

    Parameters
    ----------
    problem : LeastSquaresProblem
        The least-squares problem.
    x : Array
        Parameters, shape (parameters,), in the units of the law.
    norms : Array
        Sizes of the parameters, shape (parameters,), by which differences are divided.
    """
    failed: list[Array] = []
    solved: list[Array] = []
    for evaluation in problem.evaluations:
        away = (np.array([evaluation.parameters[name] for name in problem.names]) - x) * norms
        if away.any():
            (solved if np.isfinite(evaluation.cost) else failed).append(away)
    found = []
    for points in (failed, solved):
        apart: list[Array] = []
        for point in sorted(points, key=lambda p: float(np.linalg.norm(p))):
            direction = point / np.linalg.norm(point)
            if len(apart) < NEAREST and all(direction @ other < 0.999 for other in apart):
                apart.append(direction)
        found.append(np.array(apart).reshape(-1, len(x)))
    return found[0], found[1]


def plane(failed: Array, solved: Array) -> Array | None:
    """Normal of the plane through the origin with the failed points behind it, by a margin, and the solved in front.

    If the solved points cannot all be separated from the failed ones, the farthest are left out one by one. None where
    nothing failed.

    Parameters
    ----------
    failed : Array
        Directions to points without a solution, shape (n, parameters), of unit length.
    solved : Array
        Directions to points with a solution, shape (m, parameters), of unit length.
    """
    if not len(failed):
        return None
    for count in range(len(solved), -1, -1):
        rows = np.vstack([-failed, solved[:count]])
        wanted = np.concatenate([np.ones(len(failed)), np.zeros(count)])
        matrix = np.vstack([rows.T, wanted])
        target = np.append(np.zeros(rows.shape[1]), 1.0)
        rest = matrix @ nnls(matrix, target)[0] - target
        if np.linalg.norm(rest) > 1e-9:
            normal = rest[:-1] / -rest[-1]
            return np.asarray(normal / np.linalg.norm(normal))
    return np.asarray(-failed[0])
