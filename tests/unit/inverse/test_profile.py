"""Profiles and intervals: parabolas in closed form, edges of stability, walls, and a best point that was not one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.certainty import Uncertainty
from bushcli.inverse.local import Minimum
from bushcli.inverse.profile import RISE_95, interval, parameters_to_profile, profile
from bushcli.inverse.result import Profile


@pytest.mark.parametrize("points", [5, 6, 9])
def test_interval_of_a_parabola_is_exact(points):
    """Rise ((v - m) / s)^2 crosses 3.841 at m +- 1.96 s; its root is linear, so interpolation is exact."""
    m, s = 0.7, 0.02
    values = np.unique(np.append(m + 2.5 * s * np.linspace(-1, 1, points), m))
    low, high = interval(Profile("C10", values, ((values - m) / s) ** 2))
    assert low == pytest.approx(m - np.sqrt(RISE_95) * s, rel=1e-12)
    assert high == pytest.approx(m + np.sqrt(RISE_95) * s, rel=1e-12)


def test_interval_that_is_open_on_one_side():
    values = np.linspace(-1.0, 1.0, 5)
    rise = np.where(values > 0, 16 * values**2, 0.1 * values**2)
    low, high = interval(Profile("C30", values, rise, ("open", "misfit")))
    assert low == -np.inf
    assert 0 < high < 1


def test_no_interval_where_nothing_is_crossed():
    values = np.linspace(-1.0, 1.0, 5)
    assert interval(Profile("C30", values, 0.1 * values**2)) is None


def test_points_that_could_not_be_refitted_do_not_count():
    values = np.linspace(-2.5, 2.5, 11)
    rise = values**2
    rise[[0, 10]] = np.nan
    low, high = interval(Profile("C20", values, rise))
    assert (low, high) == pytest.approx((-np.sqrt(RISE_95), np.sqrt(RISE_95)), rel=1e-9)


@pytest.mark.parametrize("limit", ["stability", "unsolvable", "bound"])
def test_an_interval_ends_where_the_profile_could_not_go_on(limit):
    values = np.linspace(-1.0, 1.0, 5)
    rise = np.where(values > 0, 16 * values**2, 0.1 * values**2)
    low, high = interval(Profile("C30", values, rise, (limit, "misfit")))
    assert low == -1.0
    assert 0 < high < 1


# -- steps along a parameter ----------------------------------------------------------------------------------------


LOWER, UPPER = np.full(2, -1e3), np.full(2, 1e3)


@pytest.mark.parametrize("index", [0, 1])
def test_profile_of_a_linear_model_is_the_standard_errors_parabola(linear, index):
    problem = linear()
    x, covariance = problem.minimum()
    found, better = profile(problem, x, index, Uncertainty(covariance, np.inf))
    spread = np.sqrt(covariance[index, index])
    assert found.rise == pytest.approx(((found.values - x[index]) / spread) ** 2, abs=1e-6)
    assert interval(found) == pytest.approx(
        x[index] + np.sqrt(RISE_95) * spread * np.array([-1, 1]), rel=1e-6
    )
    assert found.limits == ("misfit", "misfit")
    assert better is None
    # Two points on each side, each solved once, because the derivatives give the step.
    assert len(found.values) == 5
    assert len({point.tobytes() for point in problem.asked}) <= 6


def test_a_larger_covariance_than_the_noises_scales_the_interval(linear):
    """A covariance that is larger by autocorrelation widens the profile's interval as it does the standard errors."""
    problem = linear()
    x, covariance = problem.minimum()
    found, _ = profile(problem, x, 1, Uncertainty(covariance, np.inf))
    wide, _ = profile(problem, x, 1, Uncertainty(9.0 * covariance, np.inf))
    assert interval(wide)[1] - x[1] == pytest.approx(3.0 * (interval(found)[1] - x[1]), rel=1e-6)


def test_few_independent_samples_widen_the_interval_as_students_distribution_does(linear):
    problem = linear()
    x, covariance = problem.minimum()
    few = Uncertainty(covariance, 4.0)
    found, _ = profile(problem, x, 1, few)
    # The 97.5 % quantile of Student's distribution with four degrees of freedom is 2.776 (any table).
    assert interval(found)[1] - x[1] == pytest.approx(2.776 * np.sqrt(covariance[1, 1]), rel=1e-3)


def test_profile_ends_at_a_wall_and_says_so(linear):
    problem = linear()
    x, covariance = problem.minimum()
    spread = np.sqrt(covariance[1, 1])
    edge = x[1] - 1.5 * spread
    problem.wall = lambda p: p[1] < edge
    found, _ = profile(problem, x, 1, Uncertainty(covariance, np.inf))
    assert found.limits == ("unsolvable", "misfit")
    low, high = interval(found)
    # The step of at most 1.1 standard errors towards the wall has been halved three times.
    assert edge <= low < edge + 0.2 * spread
    assert high == pytest.approx(x[1] + np.sqrt(RISE_95) * spread, rel=1e-6)


def test_profile_follows_an_edge_of_stability(linear):
    """Beside the edge the other parameter is no longer free: the misfit rises faster than the parabola."""
    problem = linear()
    x, covariance = problem.minimum()
    spread = np.sqrt(np.diag(covariance))
    # Stable where a is below its best value plus half a standard error; b falls as a rises (correlation -0.97).
    problem.edge = lambda p: 1e3 * max(p[0] - x[0] - 0.5 * spread[0], 0.0)
    found, _ = profile(problem, x, 1, Uncertainty(covariance, np.inf))
    low, high = interval(found)
    assert low > x[1] - 0.9 * np.sqrt(RISE_95) * spread[1]
    assert high == pytest.approx(x[1] + np.sqrt(RISE_95) * spread[1], rel=1e-3)


def test_profile_ends_at_a_bound(linear):
    problem = linear()
    x, covariance = problem.minimum()
    bound = x[1] + 0.5 * np.sqrt(covariance[1, 1])
    problem.bounds = Bounds(problem.bounds.lower, np.array([1e3, bound]))
    found, _ = profile(problem, x, 1, Uncertainty(covariance, np.inf))
    assert found.limits == ("misfit", "bound")
    assert interval(found)[1] == pytest.approx(bound)


def test_profile_finds_out_that_the_best_point_was_none(linear):
    problem = linear()
    x, covariance = problem.minimum()
    off = x + np.array([0.0, 3.0 * np.sqrt(covariance[1, 1])])
    _, better = profile(problem, off, 1, Uncertainty(covariance, np.inf))
    assert problem.cost(better) < problem.cost(off)


def test_curvature_makes_the_interval_lopsided(linear):
    """The force is nonlinear in b: the interval is shorter on the steeper side."""
    problem = linear(bend=2.0)
    x = least_squares(problem.residual, [2.0, -0.5], problem.jacobian).x
    slope = problem.forces(x)[0][1]
    covariance = problem.noise**2 * np.linalg.inv(slope.T @ slope)
    found, _ = profile(problem, x, 1, Uncertainty(covariance, np.inf))
    low, high = interval(found)
    # d(force)/db is q^2 (1 + 4 b): zero at b = -0.25, steeper below the best value of -0.5.
    assert high - x[1] > x[1] - low


def minimum(x, **changes):
    return Minimum(x, x, 1.0, 3, True, "", **changes)


def test_what_is_worth_a_profile(linear):
    problem, x = linear(), np.array([2.0, -0.5])
    well = Uncertainty(np.diag([1e-4, 1e-4]), np.inf)
    poor = Uncertainty(np.diag([1e-4, 0.04]), np.inf)
    assert parameters_to_profile(problem, minimum(x), well) == []
    # One poorly determined parameter requires profiles of all of the law's parameters; so does an edge of stability.
    assert parameters_to_profile(problem, minimum(x), poor) == [0, 1]
    assert parameters_to_profile(problem, minimum(x, at_edge=True), well) == [0, 1]
    assert parameters_to_profile(problem, minimum(x, beside_failure=True), well) == [0, 1]
    # The amplitude of an effect has none, however poorly it is determined.
    problem.law_parameters = lambda x: {"a": x[0]}
    assert parameters_to_profile(problem, minimum(x), poor) == []
