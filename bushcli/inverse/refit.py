"""The best other parameters for a given value of one of them, with as few solutions as possible."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bushcli.inverse.local import Stopped, Watched
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.result import Limit

Array = NDArray[np.float64]

# Rise of the cost, in units of the observed noise, at the ends of a 95 % interval: chi square, one degree of freedom.
RISE_95 = 3.841
# A point is not solved if the penalty of instability alone exceeds this many times the rise that ends the interval.
FAR = 4.0
# A refit is close enough when a further step would lower the rise by less than this: under 1 % of the interval.
CLOSE = 0.02
# Largest number of steps on the linearised misfit (one or two usually suffice), then of evaluations by a trust region.
STEPS, EVALUATIONS = 3, 8
# Tolerance and largest number of iterations of one such step. A step needs no solution of the model; its tolerance is
# finer than `CLOSE`, because a law of many parameters has valleys.
FINE, MOST_ITERATIONS = 1e-6, 40


class Refit:
    """Refits all parameters but one.

    Parameters
    ----------
    problem
    index
        Index of the parameter that is held.
    unit
        Unit in which the rise of the cost is measured.
    """

    def __init__(self, problem: LeastSquaresProblem, index: int, unit: float) -> None:
        self.problem, self.unit = problem, unit
        self.rest = np.arange(len(problem.bounds.lower)) != index

    def rise_by_instability(self, x: Array) -> float:
        """Return the rise that the penalty of instability causes by itself."""
        rows = self.problem.instability(x)
        return float(rows @ rows) / len(self.problem.channels) / self.unit

    def minimum(self, known: Array, start: Array) -> Array | Limit:
        """Return the best other parameters for the value of the parameter in `start`, by steps from a solved point.

        Curves are nearly linear over such a step, and the law's stability is cheap to evaluate. A step therefore
        minimises the linearised misfit plus the exact penalty of instability. One or two steps are usually enough; the
        gain of a further one is predicted without another evaluation. Where steps fail, a trust region takes over.
        """
        x, moved = known, self._step(known, start)
        if self.rise_by_instability(moved) > FAR * RISE_95:
            return "stability"
        for _ in range(STEPS):
            if not np.isfinite(self.problem.residual(moved)).all():
                return "unsolvable"
            if x is not known and self.problem.cost(moved) >= self.problem.cost(x):
                break
            x, moved = moved, self._step(moved, moved)
            if self.problem.cost(x) - self._expected(x, moved) < CLOSE * self.unit:
                return x
        return self._searched(x)

    def _step(self, known: Array, start: Array) -> Array:
        """Refit the other parameters to the misfit, linearised about `known`, plus the penalty of instability."""
        rest, samples = self.rest, self.problem.samples
        if not rest.any():
            return start
        value, slope = self.problem.residual(known)[:samples], self.problem.jacobian(known)[:samples]
        size = np.linalg.norm(slope[:, rest], axis=0)
        size[size == 0] = 1.0

        def whole(y: Array) -> Array:
            full = start.copy()
            full[rest] = y / size
            return full

        def rows(y: Array) -> Array:
            x = whole(y)
            return np.concatenate([value + slope @ (x - known), self.problem.instability(x)])

        def derivatives(y: Array) -> Array:
            return np.vstack([slope, self.problem.stability(whole(y))[1]])[:, rest] / size

        result = least_squares(
            rows,
            start[rest] * size,
            jac=derivatives,
            bounds=(self.problem.bounds.lower[rest] * size, self.problem.bounds.upper[rest] * size),
            x_scale="jac",
            ftol=FINE,
            xtol=FINE,
            max_nfev=MOST_ITERATIONS,
        )
        return whole(result.x)

    def _expected(self, known: Array, x: Array) -> float:
        """Return the cost at `x`, with the misfit linearised about `known`."""
        samples = self.problem.samples
        value, slope = self.problem.residual(known)[:samples], self.problem.jacobian(known)[:samples]
        rows = np.concatenate([value + slope @ (x - known), self.problem.instability(x)])
        return float(rows @ rows) / len(self.problem.channels)

    def _searched(self, start: Array) -> Array:
        rest = self.rest

        def whole(y: Array) -> Array:
            full = start.copy()
            full[rest] = y
            return full

        watched = Watched(self.problem, False, most_in_row=2)
        with suppress(Stopped):
            least_squares(
                lambda y: watched.residual(whole(y)),
                start[rest],
                jac=lambda y: self.problem.jacobian(whole(y))[:, rest],
                bounds=(self.problem.bounds.lower[rest], self.problem.bounds.upper[rest]),
                x_scale="jac",
                ftol=1e-4,
                xtol=self.problem.stopping.tolerance,
                max_nfev=EVALUATIONS,
            )
        return watched.best[1]
