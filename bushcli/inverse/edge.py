"""Search along the edge of the law's stability, for the lowest misfit within it.

A trust region shrinks after every trial beyond the edge. A search that has reached the edge therefore stops there,
even if the misfit decreases along it. Unlike the misfit, the law's stability costs no solution of the model. Each step
here minimises the linearised misfit subject to the exact stability in all watched states: a Gauss-Newton method with
nonlinear constraints, whose steps are bounded by a trust region.

References
----------
Nocedal and Wright (2006), Numerical Optimization, Springer, doi:10.1007/978-0-387-40065-5, section 18.5.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bushcli.inverse.local import NOTHING, SHORT, STATIONARY, WALL, Minimum
from bushcli.inverse.problem import ACTIVE, LeastSquaresProblem, differences

Array = NDArray[np.float64]

# Largest number of steps: a bump stop, whose knee hinders a search, took 12 from the edge (own 019, benchmarks/decks).
STEPS = 15
# Rules of SciPy's trust region (trf): after a step that lowers the cost by less than a quarter of the prediction, the
# radius is a quarter of that step; after one that lowers it by more than three quarters it is doubled.
POOR, SHRINK, GOOD, GROW = 0.25, 0.25, 0.75, 2.0


def minimise_at_edge(problem: LeastSquaresProblem, ended: Minimum) -> Minimum:
    """Continue a search that the law's stability held back, to a minimum within the edge of stability."""
    x, steps, settled = descend(problem, ended.x, min(STATIONARY, problem.stopping.tolerance))
    if not steps or not problem.cost(x) < ended.cost:
        return ended
    return replace(
        ended,
        x=x,
        cost=problem.cost(x),
        iterations=ended.iterations + steps,
        converged=settled,
        message="a minimum within the edge of stability" if settled else "no further step lowers the misfit",
        beside_failure=ended.beside_failure and not settled,
        at_edge=bool(problem.instability(x).max(initial=0.0) > ACTIVE),
        stationary=False,
    )


def descend(
    problem: LeastSquaresProblem, x: Array, enough: float, held: int | None = None
) -> tuple[Array, int, bool]:
    """Lower the misfit from a solvable point, within the edge of stability, with one parameter held, if any.

    Returned are the point (p,), the number of trials, and whether it is a minimum: no step is predicted to remove a
    share of more than `enough` of the sum of squares.
    """
    radius, steps, rejected, predicted, settled = np.inf, 0, 0, np.inf, False
    value, slope = problem.residual(x), problem.jacobian(x)
    least = NOTHING * len(problem.channels)
    while steps < STEPS and rejected < WALL and not settled:
        before = float(value @ value)
        # Steps are measured by the misfit: the rows of stability change too fast.
        linearised = LinearisedProblem(problem, x, value, slope)
        trial, remaining = linearised.step(radius, held)
        predicted = before - remaining
        length = float(np.linalg.norm((trial - x) * linearised.norms))
        if predicted <= enough * max(before, least):
            settled = True
            break
        if length <= min(problem.stopping.tolerance, SHORT) * float(np.linalg.norm(x * linearised.norms)):
            break
        after = problem.residual(trial)
        steps += 1
        fell = before - float(after @ after) if np.isfinite(after).all() else -np.inf
        # A small decrease where a larger one was predicted does not show a minimum.
        settled = POOR * predicted < fell < enough * before
        rejected = 0 if fell > 0.0 else rejected + 1
        if fell > 0.0:
            x, value, slope = trial, after, problem.jacobian(trial)
        if fell < POOR * predicted:
            radius = SHRINK * length
        elif fell > GOOD * predicted:
            radius = GROW * max(radius, length)
    # Where trials no longer fall by what is predicted, which is next to nothing, the march's own error hides the rest.
    settled = settled or predicted <= STATIONARY * max(float(value @ value), least)
    return x, steps, settled


class LinearisedProblem:
    """The linearised misfit about a point, and the exact stability beside it, by changes s in units of their columns.

    Parameters
    ----------
    problem : LeastSquaresProblem
        The least-squares problem.
    x : (p,) array
        Parameters, each in its unit.
    value : (rows,) array
        Weighted misfit at `x`, with the rows of stability at its end.
    slope : (rows, p) array
        Its derivative.
    """

    def __init__(self, problem: LeastSquaresProblem, x: Array, value: Array, slope: Array) -> None:
        samples = len(value) - len(problem.states)
        norms = np.linalg.norm(slope[:samples], axis=0)
        self.problem, self.x, self.norms = problem, x, np.where(norms > 0.0, norms, 1.0)
        self._misfit, self._slope = value[:samples], slope[:samples] / self.norms
        self._known: dict[bytes, tuple[Array, Array]] = {}

    def cost(self, s: Array) -> tuple[float, Array]:
        """Half the sum of squares, of the misfit to first order and of the exact penalty; and its derivative."""
        residual = self._misfit + self._slope @ s
        values, slopes = self.stability(s)
        return 0.5 * float(residual @ residual + values[0]), self._slope.T @ residual + 0.5 * slopes[0]

    def stability(self, s: Array) -> tuple[Array, Array]:
        """Sum of squares of the penalty, then the margin in each state, MPa; and their derivative."""
        key = s.tobytes()
        if key not in self._known:
            x = self.x + s / self.norms
            self._known[key] = self._values(x), differences(self._values, x) / self.norms
        return self._known[key]

    def _values(self, x: Array) -> Array:
        rows, margins = self.problem.penalty_and_margins(x)
        return np.concatenate([[rows @ rows], margins])

    def step(
        self, radius: float = np.inf, held: int | None = None, value: float = 0.0
    ) -> tuple[Array, float]:
        """Return the point (p,) with the least linearised misfit within edge, bounds and radius, and what it leaves.

        A parameter that is held, by index, changes by a value.
        """
        start, bounds = np.zeros(len(self.x)), self.problem.bounds
        low = np.maximum((bounds.lower - self.x) * self.norms, -radius)
        high = np.minimum((bounds.upper - self.x) * self.norms, radius)
        if held is not None:
            start[held] = low[held] = high[held] = value * self.norms[held]
        margins = {
            "type": "ineq",
            "fun": lambda s: self.stability(s)[0][1:],
            "jac": lambda s: self.stability(s)[1][1:],
        }
        limits, options = list(zip(low, high, strict=True)), {"maxiter": 100, "ftol": 1e-9}
        slsqp = {"method": "SLSQP", "jac": True, "bounds": limits, "constraints": margins, "options": options}
        with warnings.catch_warnings():
            # Steps onto a bound pass it by rounding; SciPy clips them.
            warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
            end = minimize(self.cost, start, **slsqp)
        s = np.clip(end.x, low, high) if np.isfinite(end.x).all() else start
        return bounds.clip(self.x + s / self.norms), 2.0 * self.cost(s)[0]
