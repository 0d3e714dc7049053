"""From one start to the nearest minimum: a bounded trust region with exact derivatives (SciPy's trf)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear

from bushcli.inverse.problem import ACTIVE, MOST_EVALUATIONS, LeastSquaresProblem

Array = NDArray[np.float64]
Loss = Literal["linear", "soft_l1", "huber", "cauchy", "arctan"]

# Largest relative step that may end a search: steps are short beside a failure, too, where it must not end.
SHORT = 1e-4
# A search has met a wall after this many failed trials in a row, each with a quarter of the step before it.
WALL = 6
# A robust loss begins to discount misfits of this many standard deviations.
ROBUST_AT = 2.0
# A search that a full step would still improve by more than this share of the cost has not ended in a minimum: a
# tenth of a unit of chi square in a hundred samples.
STATIONARY = 1e-3
# Relative change of all parameters below which a search has not left its start.
STAYED = 1e-6
# Cost below which there is nothing left to improve: a hundredth of the noise, or 0.001 % of the force range.
NOTHING = 1e-4


@dataclass(frozen=True)
class Minimum:
    """Where a search began and ended, points (parameters,) with the cost at the end, and what ended it."""

    start: Array
    x: Array
    cost: float
    iterations: int
    converged: bool
    message: str
    # Steps that would lower the misfit further lead to parameters that cannot be solved.
    beside_failure: bool = False
    # The law's stability holds the search back from a lower misfit.
    at_edge: bool = False
    # Its start is the minimum already: a law that is linear in its parameters is solved exactly before the search.
    stationary: bool = False
    # Trials were rejected because the law is unstable with their parameters.
    rejected: bool = False
    # The search was ended because its minimum cannot matter (`Ends`).
    hopeless: bool = False


class Stopped(Exception):
    """Raised by the misfit function to stop an optimiser early."""


class Hopeless(Stopped):
    """Raised where the search cannot reach a misfit low enough to matter."""


class Settled(Stopped):
    """Raised in a minimum, before another step confirms it."""


class HeldBack(Stopped):
    """Raised where the law's stability lets the search make small steps only (`bushcli.inverse.edge` makes larger)."""


class FlatValley(Stopped):
    """Raised in a flat valley, where the misfit no longer falls although the optimiser would continue."""


Ends = Callable[[Array, bool, bool], Stopped | None]
"""Why the search ends at one of its points although the optimiser would continue, or None.

Given are the point, shape (parameters,), whether a trial has failed since the last point, and whether the law was
unstable in any trial.
"""


class Watched:
    """The misfit function for an optimiser; it counts iterations and failures, and keeps the best point.

    `squares`: the optimiser minimises the sum of squares, as that of a robust loss does not. `explained` is called with
    the best point so far when a trial fails; it returns whether that point explains the failure, so that the search
    should begin again from there.
    """

    def __init__(
        self,
        problem: LeastSquaresProblem,
        squares: bool,
        most_in_row: int,
        explained: Callable[[Array], bool] | None = None,
        ends: Ends | None = None,
    ) -> None:
        self.problem, self.squares, self.most_in_row = problem, squares, most_in_row
        self.explained, self.ends = explained, ends
        self.failed = self.row = self.iterations = self.rejected = 0
        self.best: tuple[float, Array] = (np.inf, np.zeros(0))
        self._falling: list[float] = []
        # Whether a trial has failed since the last point of the search.
        self._met_failure = self.hopeless = False

    def residual(self, x: Array) -> Array:
        """`Problem.residual`."""
        if self.squares and self._is_surely_rejected(x):
            self.rejected += 1
            return np.full(self.problem.samples + len(self.problem.states), np.nan)
        self.problem.answers(x, self.iterations)
        rows = self.problem.residual(x)
        if not np.isfinite(rows).all():
            self.failed, self.row, self._met_failure = self.failed + 1, self.row + 1, True
            if self.row == 1:
                # A run of failures counts once among the evaluations that have to gain something.
                self._falling.append(self.best[0])
            if self.explained is not None and self.best[0] < np.inf and self.explained(self.best[1]):
                raise Stopped("the law is unstable in the states reached")
            if self.row >= self.most_in_row:
                raise Stopped("trials in a row could not be solved")
            if self.failed >= self.problem.stopping.failures:
                raise Stopped("too many trials could not be solved")
            return rows
        self.row = 0
        self.best = min(self.best, (float(rows @ rows), x.copy()), key=lambda pair: pair[0])
        self._falling.append(self.best[0])
        evaluations, share = self.problem.stopping.valley
        before = self._falling[-1 - evaluations] if len(self._falling) > evaluations else np.inf
        # A robust loss may fall while the sum of squares rises, so that a valley cannot be recognised here.
        if self.squares and self.best[0] > (1 - share) * before:
            raise FlatValley("the misfit no longer falls")
        return rows

    def _is_surely_rejected(self, x: Array) -> bool:
        """Whether the penalty of instability alone exceeds the cost of the best point: the trial would be rejected.

        Such a trial is not solved, which would take long or fail. The trust region treats a rejected trial like one
        that is not a number: the radius becomes a quarter of the step.
        """
        rows = self.problem.instability(x)
        return bool(self.best[0] < np.inf and rows @ rows > self.best[0])

    def jacobian(self, x: Array) -> Array:
        """`Problem.jacobian`."""
        # The optimiser may have moved a trial onto a bound, by rounding.
        self.problem.answers(x, self.iterations)
        slope = self.problem.jacobian(x)
        self.iterations += 1
        ended = None if self.ends is None else self.ends(x, self._met_failure, self.rejected > 0)
        self._met_failure = False
        if ended is not None:
            self.hopeless = isinstance(ended, Hopeless)
            raise ended
        return slope


def minimise(
    problem: LeastSquaresProblem,
    start: Array,
    loss: Loss = "linear",
    most_in_row: int = MOST_EVALUATIONS,
    explained: Callable[[Array], bool] | None = None,
    ends: Ends | None = None,
) -> Minimum:
    """Minimise the weighted misfit within bounds."""
    watched = Watched(problem, loss == "linear", most_in_row, explained, ends)
    limits, point, derivative = problem.bounds.about(problem.bounds.inside(start), problem.stiffness_shares)

    try:
        result = least_squares(
            lambda y: watched.residual(point(y)),
            np.zeros(len(start)),
            jac=lambda y: watched.jacobian(point(y)) @ derivative(y),
            bounds=(limits.lower, limits.upper),
            x_scale="jac",
            loss=loss,
            f_scale=ROBUST_AT / np.sqrt(problem.samples / len(problem.channels)),
            ftol=problem.stopping.tolerance,
            xtol=min(problem.stopping.tolerance, SHORT),
            gtol=1e-12,
            max_nfev=problem.stopping.evaluations,
        )
        x, ended, message = point(result.x), result.status > 0, str(result.message)
    except Stopped as stopped:
        x, ended, message = watched.best[1], isinstance(stopped, FlatValley | Settled), str(stopped)
    linear = loss == "linear"
    is_minimum = linear and predicted_decrease(problem, x) <= STATIONARY
    beside_failure = linear and watched.failed > 0 and not is_minimum
    converged = (ended or is_minimum) and not beside_failure
    at_edge = bool(problem.instability(x).max(initial=0.0) > ACTIVE)
    stayed = bool(np.all(np.abs(x - start) <= STAYED * np.maximum(np.abs(start), 1e-12)))
    ending = watched.iterations, converged, message, beside_failure, at_edge
    rejected = watched.rejected > 0
    return Minimum(start, x, problem.cost(x), *ending, is_minimum and stayed, rejected, watched.hopeless)


def predicted_decrease(problem: LeastSquaresProblem, x: Array) -> float:
    """Return the share of the cost that a full Gauss-Newton step within the bounds would remove; zero at a minimum."""
    value = problem.residual(x)
    _, remaining = full_step(problem, x)
    return float(value @ value - remaining) / max(float(value @ value), NOTHING * len(problem.channels))


def full_step(problem: LeastSquaresProblem, x: Array) -> tuple[Array, float]:
    """Return the full Gauss-Newton step within the bounds, shape (parameters,), and the sum of squares that it leaves.

    Parameters
    ----------
    problem : LeastSquaresProblem
    x : shape (parameters,)
    """
    low, high = np.minimum(problem.bounds.lower - x, 0.0), np.maximum(problem.bounds.upper - x, 0.0)
    return bounded_step(problem.residual(x), problem.jacobian(x), low, high)


def bounded_step(value: Array, slope: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Return the step (p,) within bounds that is best for rows (n,) to first order, and the sum of squares left."""
    size = np.linalg.norm(slope, axis=0)
    size[size == 0] = 1.0
    linear = lsq_linear(slope / size, -value, (low * size, high * size))
    return linear.x / size, 2.0 * float(linear.cost)
