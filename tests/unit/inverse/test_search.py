"""Searches beside walls: where they end, and what they report."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.evidence.stopping_rule import StoppingRule
from bushcli.inverse.bounds import Bounds
from bushcli.inverse.edge import minimise_at_edge
from bushcli.inverse.local import FlatValley, Watched, minimise, predicted_decrease
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem, Stopping, differences
from bushcli.inverse.starts import OUTPERFORMED_AFTER, is_outperformed
from forms.law import law


def best_on(problem, normal, level):
    """Least squares on the line normal . x = level, in closed form."""
    x, covariance = problem.minimum()
    return x + covariance @ normal * (level - normal @ x) / (normal @ covariance @ normal)


def test_without_a_wall_the_minimum_is_found(linear):
    problem = linear()
    found = search(problem, np.array([1.0, 1.0]))
    assert found.converged
    assert not found.beside_failure
    assert found.x == pytest.approx(problem.minimum()[0], rel=1e-5)


@pytest.mark.parametrize("normal", [(0.0, 1.0), (1.0, 0.0), (0.3, 1.0), (1.0, -0.5), (-1.0, -1.0)], ids=str)
@pytest.mark.parametrize("start", [(1.0, 1.0), (3.0, -3.0)], ids=str)
def test_a_search_that_ends_beside_failures_says_so(linear, normal, start):
    """Half the plane has no solution; the minimum lies three standard errors inside that half."""
    problem, normal, start = linear(), np.array(normal), np.array(start)
    x, covariance = problem.minimum()
    # The wall faces the start.
    normal = normal * np.sign(normal @ (start - x))
    level = normal @ x + 3.0 * np.sqrt(normal @ covariance @ normal)
    problem.wall = lambda p: normal @ p < level
    found = search(problem, start)
    assert normal @ found.x >= level
    assert found.beside_failure
    assert not found.converged


def test_a_search_ends_after_so_many_failures(linear):
    """Beside a wall some trials fail, but not in succession."""
    problem = linear()
    x, covariance = problem.minimum()
    normal = np.array([0.3, 1.0])
    level = normal @ x + 3.0 * np.sqrt(normal @ covariance @ normal)
    problem.wall, problem.stopping = (lambda p: normal @ p < level), Stopping()
    whole = minimise(problem, np.array([1.0, 1.0]))
    failed = sum(np.isnan(one.cost) for one in problem.evaluations)
    assert failed > 3
    problem = linear(wall=problem.wall)
    problem.stopping = Stopping(failures=3)
    found = minimise(problem, np.array([1.0, 1.0]))
    assert sum(np.isnan(one.cost) for one in problem.evaluations) == 3
    assert found.message == "too many trials could not be solved"
    assert not found.converged
    # It ends with the best point of all.
    # A copy, because `cost` adds to the list.
    assert found.cost == min(one for one in map(problem.cost, list(problem.asked)) if np.isfinite(one))
    assert found.cost >= whole.cost


def test_an_edge_of_stability_is_followed_to_its_lowest_point(linear):
    problem = linear()
    x, covariance = problem.minimum()
    normal = np.array([0.3, 1.0])
    level = normal @ x + 3.0 * np.sqrt(normal @ covariance @ normal)
    problem.edge = lambda p: 30.0 * max(level - normal @ p, 0.0)
    found = search(problem, np.array([1.0, 1.0]))
    assert found.converged
    assert found.at_edge
    assert found.x == pytest.approx(best_on(problem, normal, level), abs=0.1 * np.sqrt(covariance[1, 1]))


def test_a_search_beside_a_steep_edge_goes_on_along_it(linear):
    # A start so near the edge that the trust region rejects each trial beyond it, and ends where it began.
    problem = linear()
    x, covariance = problem.minimum()
    normal = np.array([0.3, 1.0])
    deviation = np.sqrt(normal @ covariance @ normal)
    level = normal @ x + 3.0 * deviation
    problem.margin = lambda p: normal @ p - level
    problem.edge = lambda p: 1e5 * max(-problem.margin(p), 0.0)
    along = np.array([1.0, -0.3]) / np.hypot(1.0, 0.3)
    lowest = best_on(problem, normal, level)
    start = lowest + 0.4 * along + 1e-6 * normal
    stuck = minimise(problem, start)
    assert stuck.rejected
    assert np.linalg.norm(stuck.x - start) < 0.01 * np.linalg.norm(lowest - start)
    found = search(problem, start)
    assert found.x == pytest.approx(lowest, abs=0.01 * np.sqrt(covariance[1, 1]))
    assert found.converged
    assert problem.margin(found.x) >= -1e-9


def test_a_search_that_keeps_little_of_its_promise_beside_an_edge_goes_along_it_at_once(linear):
    """A diagnosis does not wait until the steps of the trust region, each cut by the edge, have become small."""
    problem = linear()
    x, covariance = problem.minimum()
    normal = np.array([0.3, 1.0])
    level = normal @ x + 3.0 * np.sqrt(normal @ covariance @ normal)
    problem.margin = lambda p: normal @ p - level
    problem.edge = lambda p: 1e5 * max(-problem.margin(p), 0.0)
    problem.unit, problem.variances = problem.samples**-0.5, (1.0,)
    lowest = best_on(problem, normal, level)
    start = lowest + 4.0 * np.array([1.0, -0.3]) / np.hypot(1.0, 0.3) + 0.01 * normal
    asked = []
    for ends in (None, StoppingRule(problem, [0.0, 0.0], None).ends):
        problem.asked = []
        found = search(problem, start, ends=ends)
        assert found.x == pytest.approx(lowest, abs=0.1 * np.sqrt(covariance[1, 1]))
        asked.append(len({point.tobytes() for point in problem.asked}))
    assert asked[1] < asked[0]


def test_an_end_on_the_edge_without_a_lower_misfit_along_it_stays(linear):
    problem = linear()
    x, covariance = problem.minimum()
    normal = np.array([0.3, 1.0])
    level = normal @ x + 3.0 * np.sqrt(normal @ covariance @ normal)
    problem.margin = lambda p: normal @ p - level
    problem.edge = lambda p: 1e5 * max(-problem.margin(p), 0.0)
    ended = minimise(problem, best_on(problem, normal, level))
    assert minimise_at_edge(problem, ended) is ended


def test_steps_along_the_edge_that_promise_next_to_nothing_end_in_a_minimum(linear, monkeypatch):
    """Where the march's own error hides what is left to gain, a good fit does not end as "not converged"."""
    problem = linear()
    least, _ = problem.minimum()
    away = least + np.array([0.1, 0.0])
    steps = iter([least, *[least + 1e-2] * 20])
    left = iter([problem.cost(least), *[problem.cost(least) * (1 - 1e-5)] * 20])
    monkeypatch.setattr(
        "bushcli.inverse.edge.LinearisedProblem.step", lambda at, *_: (next(steps), next(left))
    )
    ended = minimise(problem, away, most_in_row=1)
    found = minimise_at_edge(problem, replace(ended, x=away, cost=problem.cost(away), converged=False))
    assert found.cost == pytest.approx(problem.cost(least))
    assert found.converged, found.message


def test_a_search_that_used_up_its_evaluations_in_a_minimum_has_converged(linear):
    problem = linear()
    problem.stopping = Stopping(1e-15, (100, 0.0), evaluations=3)
    found = search(problem, np.array([1.0, 1.0]))
    assert found.message == "The maximum number of function evaluations is exceeded."
    assert found.converged


def test_nothing_is_promised_at_a_minimum(linear):
    problem = linear()
    x, covariance = problem.minimum()
    assert predicted_decrease(problem, x) == pytest.approx(0.0, abs=1e-9)
    # Two standard errors away chi square falls by 4, of about 198 + 4.
    away = x + 2.0 * covariance[:, 1] / np.sqrt(covariance[1, 1])
    assert predicted_decrease(problem, away) == pytest.approx(4.0 / 202.0, rel=0.01)
    # Bounds that leave no room leave no decrease.
    problem.bounds = Bounds(away - 1e-12, away + 1e-12)
    assert predicted_decrease(problem, away) == pytest.approx(0.0, abs=1e-6)


def test_a_start_is_given_up_when_it_neither_comes_near_nor_gets_on():
    nan = float("nan")
    reference = 1.0
    falling = [1e6 * 0.25**k for k in range(20)]
    assert not any(is_outperformed(falling[:n], reference) for n in range(20))
    stuck = [500.0, 400.0, nan, 390.0, 380.0, nan, 370.0, 365.0, 361.0]
    assert not is_outperformed(stuck[: OUTPERFORMED_AFTER - 1], reference)
    assert is_outperformed(stuck, reference)
    # Twice the misfit is near enough for a second minimum that is worth finding.
    assert not is_outperformed([4.1] * 20, reference)
    assert is_outperformed([nan] * OUTPERFORMED_AFTER, reference)


def test_without_parameters_there_is_nothing_to_differentiate():
    """Coupons give the law, and nothing is left to fit: an unstable law still has its penalty."""
    assert differences(lambda x: np.ones(3), np.zeros(0)).shape == (3, 0)
    linear = differences(lambda x: np.array([x[0] - 2 * x[1], x[1]]), np.array([1.0, 2.0]))
    assert linear == pytest.approx(np.array([[1.0, -2.0], [0.0, 1.0]]), abs=1e-6)


@pytest.mark.parametrize("start", [0.03, 30.0])
def test_a_time_is_searched_in_its_logarithm(start):
    """It stays positive, and within its bounds, on the way from a thirtieth or thirty times its value."""
    t = np.linspace(0.0, 5.0, 40)

    class Decay:
        law, channels, samples, states = None, [0], len(t), np.zeros((0, 3))
        stopping, bounds = Stopping(), Bounds(np.array([0.0]), np.array([1e9]), np.array([True]))

        def residual(self, x):
            return np.exp(-t / x[0]) - np.exp(-t)

        def jacobian(self, x):
            return (t / x[0] ** 2 * np.exp(-t / x[0]))[:, None]

        def answers(self, x, iteration=0):
            assert (x > 0.0).all()

        def stiffness_shares(self, x):
            return np.zeros(1), np.zeros((1, 1))

        def instability(self, x, states=None):
            return np.zeros(0)

        def cost(self, x):
            return float(np.sum(self.residual(x) ** 2))

    assert minimise(Decay(), np.array([start])).x == pytest.approx([1.0], rel=1e-5)


def test_coordinates_of_a_search_lead_back_to_its_origin_and_bounds():
    bounds = Bounds(np.array([0.0, -1.0]), np.array([10.0, np.inf]), np.array([True, False]))
    origin = np.array([2.0, 0.3])
    limits, point, derivative = bounds.about(origin, lambda x: (np.zeros(2), np.zeros((2, 2))))
    assert (point(np.zeros(2)) == origin).all()
    assert point(np.array([np.log(2.0), 0.2])) == pytest.approx([4.0, 0.5])
    assert (derivative(np.zeros(2)) == np.diag([2.0, 1.0])).all()
    assert limits.lower == pytest.approx([np.log(1e-9), -1.3])
    assert limits.upper == pytest.approx([np.log(5.0), np.inf])


@pytest.mark.parametrize(
    ("name", "origin"),
    [("ogden", [0.4, 1.3, -0.02, -2.0]), ("arruda_boyce", [0.3, 2.0]), ("gent", [0.3, 9.0])],
)
def test_a_modulus_keeps_its_part_of_the_stiffness_where_an_exponent_changes(name, origin):
    """An exponent of Ogden's law may change its sign on the way, and the modulus with it."""
    rubber, x = law(name), np.array(origin)
    names = [parameter.name for parameter in rubber.parameters][: len(x)]
    bounds = Bounds(np.full(len(x), -1e3), np.full(len(x), 1e3))
    problem = LeastSquaresProblem([], rubber, names, {}, bounds, np.zeros((0, 3)))
    _, point, derivative = bounds.about(x, problem.stiffness_shares)
    stiffness = rubber.shear_modulus(**dict(zip(names, x, strict=True)))
    np.testing.assert_allclose(point(np.zeros(len(x))), x)
    for change in (0.5, -1.8) if name == "ogden" else (0.5,):
        y = np.where([one in rubber.linear for one in names], 0.0, change)
        after = point(y)
        assert rubber.shear_modulus(**dict(zip(names, after, strict=True))) == pytest.approx(stiffness)
        np.testing.assert_allclose(derivative(y), differences(point, y), rtol=1e-4, atol=1e-5)


def test_a_run_of_failed_trials_is_one_evaluation_that_gained_nothing():
    """Beside a wall each small success is bracketed by failures: four evaluations have to gain 1 % together."""
    nan = math.nan
    for trials, is_flat in (
        ([10.0, nan, nan, 9.99, nan, 9.98], True),
        ([10.0, nan, nan, nan, 9.99, 9.98], False),
    ):
        remaining = iter(trials)
        problem = SimpleNamespace(
            samples=1,
            states=(),
            stopping=Stopping(valley=(4, 0.01)),
            answers=lambda *given: None,
            instability=lambda x: np.zeros(0),
            residual=lambda x, remaining=remaining: np.array([next(remaining)]),
        )
        watched = Watched(problem, squares=True, most_in_row=9)
        for _ in trials[:-1]:
            watched.residual(np.zeros(1))
        with pytest.raises(FlatValley) if is_flat else nullcontext():
            watched.residual(np.zeros(1))


def test_margins_of_a_linear_law_are_concave_and_finite_where_its_shear_modulus_vanishes():
    """Least eigenvalues of sums are no less than the sums of least eigenvalues."""
    rubber = law("yeoh")
    stretches = np.linspace(0.6, 1.9, 12)
    states = np.column_stack([stretches, np.ones(12), 1.0 / stretches])
    names = tuple(parameter.name for parameter in rubber.parameters)
    bounds = Bounds(np.full(3, -np.inf), np.full(3, np.inf))
    problem = LeastSquaresProblem([], rubber, names, {}, bounds, states)
    vanishing, sound = np.array([1e-9, 3.5, -1.2]), np.array([0.4, -0.03, 0.012])
    ends = [problem.penalty_and_margins(x)[1] for x in (vanishing, sound)]
    between = problem.penalty_and_margins(0.5 * (vanishing + sound))[1]
    assert (between >= 0.5 * (ends[0] + ends[1]) - 1e-12).all()
    assert max(np.abs(ends[0]).max(), np.abs(ends[1]).max()) < 1e3
