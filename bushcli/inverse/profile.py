"""Profile likelihood: the misfit along one parameter with all others refitted, and the interval that it gives.

Unlike a standard error, a profile accounts for a misfit that is not parabolic, for the law's stability, and for
parameters that cannot be solved. It goes outward from the best value on either side until the misfit has risen enough,
by steps that the profile's own slope suggests. Where a point cannot be solved, or the law is unstable in the states
that the rubber reaches there, the step is halved; the profile names what finally ended it.

References
----------
Venzon and Moolgavkar (1988), J. R. Stat. Soc. C 37:87-94, doi:10.2307/2347496 (profile likelihood).
Kent (1982), Biometrika 69:19-27, doi:10.1093/biomet/69.1.19 (its scale where the weights are not the noise's).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse import certainty
from bushcli.inverse.certainty import Uncertainty
from bushcli.inverse.edge import LinearisedProblem, descend
from bushcli.inverse.local import NOTHING, Minimum
from bushcli.inverse.minimum_search import is_unstable
from bushcli.inverse.problem import LeastSquaresProblem, weighted_misfits
from bushcli.inverse.result import NORMAL, POOR, Limit, Profile

Array = NDArray[np.float64]

# Rise of the cost, in units of the observed noise, at the ends of a 95 % interval: chi square, one degree of freedom.
RISE_95 = 3.841
# A point is not solved if the penalty of instability alone exceeds this many times the rise that ends the interval.
FAR = 4.0
# A refit is close enough when a further step would lower the rise by less than this: under 1 % of the interval.
CLOSE = 0.02
# Roots of the rise that steps aim at: half way, and a little beyond the end, so that the end can be interpolated.
AIMS = (1.1, 2.2)
# If the roots of the rise on both sides of the end are further apart than this, a point is added between them.
APART = 1.4
# A fall of the cost whose root exceeds this is more than rounding: the search had ended too early.
BETTER = 0.2
# Largest numbers per side of solved points, and of halvings towards a point that cannot be solved.
POINTS, HALVINGS = 8, 3
# Largest number of evaluations per side; even a difficult side needs only half of them.
MOST_OF_A_SIDE = 24
# Profiles are made only if the curves leave no more than this many combinations of parameters open.
OPEN = 1
# A halving that needed no solution counts as this share of one.
FREE = 0.25
# Largest factor by which a step may increase the distance from the best value.
GROWTH = 4.0


@dataclass(frozen=True)
class _Point:
    """A refitted point: value, root of the rise, and all parameters."""

    value: float
    root: float
    x: Array


def noise_unit(problem: LeastSquaresProblem, x: Array, uncertainty: Uncertainty, index: int) -> float:
    """Return the unit in which the cost rises by `RISE_95` at the end of a 95 % interval.

    It is the rise at one standard error of a parameter, which accounts for the correlation of neighbouring errors,
    enlarged where few independent samples make the interval wider than that of a normal distribution.
    """
    forces = problem.forces(x)
    assert forces is not None
    rows = np.vstack([slope for _, slope in weighted_misfits(problem.channels, forces)])
    inverse, _ = certainty.invert_information(rows.T @ rows / len(problem.channels))
    variance = float(uncertainty.covariance[index, index]) * (uncertainty.quantile / NORMAL) ** 2
    unit = variance / float(inverse[index, index]) if inverse[index, index] > 0 else 0.0
    # Curves that are reproduced exactly have no noise; the smallest number keeps the rise finite.
    return unit if np.isfinite(unit) and unit > 0 else max(problem.cost(x), 1e-300) / problem.samples


def parameters_to_profile(problem: LeastSquaresProblem, best: Minimum, uncertainty: Uncertainty) -> list[int]:
    """Return the parameters whose standard error would mislead.

    These are all parameters of the law if one of them is poorly determined, or if the search ended at the edge of
    stability or of the parameters that can be solved, which distorts them together. Effects have none: their
    amplitudes change the curves nearly in proportion, their times are searched in their logarithm, and where the curves
    leave them open, their profiles would take ten times the search. None if the curves leave several combinations open
    (three terms of Ogden on one curve): the other parameters can then follow any change of one, and the interval of a
    single parameter is meaningless.
    """
    x, law_parameters = best.x, problem.law_parameters(best.x)
    if len(x) < 2 or len(certainty.directions(problem, x)[1]) > OPEN:
        return []
    of_law = [i for i, name in enumerate(problem.names) if name in law_parameters]
    deviations = np.sqrt(np.abs(np.diag(uncertainty.covariance)))
    bent = best.beside_failure or best.at_edge or (deviations > POOR * np.abs(x))[of_law].any()
    return of_law if bent else []


def profiles_of(
    problem: LeastSquaresProblem, best: Minimum, uncertainty: Uncertainty, profiles: dict[int, Profile]
) -> Array | None:
    """Compute the profiles that are needed, by index; return a better point than the best as soon as one is found.

    States in which the law was found unstable on the way lead the later profiles around parameters that cannot be
    solved. Earlier profiles that ended at such parameters are computed again.
    """
    indices = list(parameters_to_profile(problem, best, uncertainty))
    while indices:
        count = len(problem.states)
        for index in indices:
            profiles[index], better = profile(problem, best.x, index, uncertainty)
            if better is not None:
                return better
        ended = {"stability", "unsolvable"} if len(problem.states) > count else set()
        indices = [index for index in indices if ended & {*profiles[index].limits}]
    return None


def profile(
    problem: LeastSquaresProblem, x: Array, index: int, uncertainty: Uncertainty
) -> tuple[Profile, Array | None]:
    """Return the cost along one parameter, all others refitted, and a point of lower misfit where one was met.

    The cost is in units of the observed noise, and goes to beyond the 95 % interval.
    """
    unit = noise_unit(problem, x, uncertainty, index)
    spread = float(np.sqrt(max(uncertainty.covariance[index, index], 0.0)))
    if not np.isfinite(spread) or spread == 0.0:
        spread = 0.05 * max(abs(float(x[index])), 1e-3)
    along = _Along(problem, x, index, unit)
    (below, down), (above, up) = (along.side(sign * spread) for sign in (-1.0, 1.0))
    points = [*reversed(below), _Point(float(x[index]), 0.0, x), *above]
    values = np.array([point.value for point in points])
    rise = np.array([np.sign(point.root) * point.root**2 for point in points])
    lowest = min(points, key=lambda point: point.root)
    result = Profile(problem.names[index], values, rise, (down, up))
    return result, lowest.x if lowest.root < -BETTER else None


class _Along:
    """The way outward along one parameter from the best point."""

    def __init__(self, problem: LeastSquaresProblem, x: Array, index: int, unit: float) -> None:
        self.problem, self.x, self.index, self.unit = problem, x, index, unit
        self.best = problem.cost(x)

    def side(self, spread: float) -> tuple[list[_Point], Limit]:
        """Return the points outward from the best one, and what ends them; the sign of `spread` selects the side."""
        points = [_Point(float(self.x[self.index]), 0.0, self.x)]
        end = float((self.problem.bounds.lower if spread < 0 else self.problem.bounds.upper)[self.index])
        failed_at, reason, halvings = None, None, 0.0
        initial = len(self.problem.evaluations)
        while len(points) <= POINTS and len(self.problem.evaluations) - initial < MOST_OF_A_SIDE:
            value = self._next(points, spread, failed_at)
            value = max(value, end) if spread < 0 else min(value, end)
            if value == points[-1].value:
                return points[1:], "bound"
            evaluations = len(self.problem.evaluations)
            refitted = self._refit(points, value)
            if isinstance(refitted, _Point):
                points.append(refitted)
                if refitted.root**2 >= RISE_95:
                    return self._close(points)
                continue
            # A point that is far from stable needed no solution, and counts less.
            solved = len(self.problem.evaluations) > evaluations
            failed_at, reason, halvings = value, refitted, halvings + (1.0 if solved else FREE)
            if halvings > HALVINGS:
                return points[1:], reason
        return points[1:], "open" if reason is None else reason

    def _next(self, points: list[_Point], spread: float, failed_at: float | None) -> float:
        """Return the next value, extrapolated from the points so far, at most half way to a value that failed."""
        last = points[-1]
        if len(points) == 1:
            value = last.value + AIMS[0] * spread
        else:
            gone = last.value - points[0].value
            slope = (last.root - points[-2].root) / (last.value - points[-2].value) * np.sign(spread)
            aim = next((a for a in AIMS if last.root < 0.8 * a), AIMS[-1])
            step = (aim - last.root) / slope if slope > 0 else np.inf
            value = last.value + np.sign(spread) * min(step, (GROWTH - 1) * abs(gone))
        if failed_at is None:
            return float(value)
        half = 0.5 * (last.value + failed_at)
        return float(min(value, half) if spread > 0 else max(value, half))

    def _close(self, points: list[_Point]) -> tuple[list[_Point], Limit]:
        """Add a point before the last if the rise is too steep to interpolate; return the points and their limit."""
        for _ in range(2):
            inner, outer = points[-2], points[-1]
            if outer.root - inner.root < APART:
                break
            between = self._refit(points[:-1], 0.5 * (inner.value + outer.value))
            if not isinstance(between, _Point):
                break
            points[-1:] = [between, outer] if between.root**2 < RISE_95 else [between]
        last = points[-1]
        return points[1:], "stability" if self._rise_by_instability(last.x) > 0.5 * last.root**2 else "misfit"

    def _refit(self, points: list[_Point], value: float) -> _Point | Limit:
        """Refit all other parameters, starting from the last point; return the reason if that fails."""
        for is_last in (False, True):
            end = self._minimum(points[-1].x, value)
            if isinstance(end, str):
                return end
            other = end
            states = self.problem.reached_stretches(other)
            if not is_unstable(self.problem, other, states):
                break
            # States in which the best point is unstable are not added, because they would change its cost.
            if is_last or is_unstable(self.problem, self.x, states):
                return "stability"
            self.problem.watch(states)
        rise = (self.problem.cost(other) - self.best) / self.unit
        return _Point(value, float(np.sign(rise) * np.sqrt(abs(rise))), other)

    def _minimum(self, minimum: Array, value: float) -> Array | Limit:
        """Return the parameters with the least misfit and this value of the parameter, by steps from a solved point.

        Curves are nearly linear over such a step, and the law's stability is cheap to evaluate: one or two evaluations
        are usually enough.
        """
        problem, index = self.problem, self.index
        linearised = LinearisedProblem(problem, minimum, problem.residual(minimum), problem.jacobian(minimum))
        x, _ = linearised.step(held=index, value=value - minimum[index])
        x[index] = value
        if self._rise_by_instability(x) > FAR * RISE_95:
            return "stability"
        if not np.isfinite(problem.residual(x)).all():
            return "unsolvable"
        return descend(problem, x, CLOSE * self.unit / max(problem.cost(x), NOTHING), index)[0]

    def _rise_by_instability(self, x: Array) -> float:
        """Return the rise that the penalty of instability causes by itself."""
        rows = self.problem.instability(x)
        return float(rows @ rows) / len(self.problem.channels) / self.unit


def interval(curve: Profile) -> tuple[float, float] | None:
    """95 % interval: its ends are where the profile crosses the limit, or stops at a bound, instability or a failure.

    An end that the profile did not reach is infinite; None where neither was reached.
    """
    good = np.isfinite(curve.rise)
    values, rise = curve.values[good], curve.rise[good]
    if len(values) < 2:
        return None
    middle = int(np.argmin(np.abs(rise)))
    down = _end(values[: middle + 1][::-1], rise[: middle + 1][::-1], curve.limits[0])
    up = _end(values[middle:], rise[middle:], curve.limits[1])
    if down is None and up is None:
        return None
    return float("-inf") if down is None else down, float("inf") if up is None else up


def _end(values: Array, rise: Array, limit: Limit) -> float | None:
    above = np.flatnonzero(rise >= RISE_95)
    if not len(above) or above[0] == 0:
        return None if limit in ("misfit", "open") else float(values[-1])
    i = int(above[0])
    # The root of the rise is close to a straight line.
    roots = np.sqrt(np.maximum(rise[[i - 1, i]], 0.0))
    share = (np.sqrt(RISE_95) - roots[0]) / (roots[1] - roots[0])
    return float(values[i - 1] + share * (values[i] - values[i - 1]))
