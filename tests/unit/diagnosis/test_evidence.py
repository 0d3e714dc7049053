"""Laplace's evidence against exact integrals: in closed form, by quadrature, and on a coupon by a grid."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp
from scipy.stats import norm, t

from bushcli.effects.prior import Prior
from bushcli.evidence.laplace import LAW_SHARE, STUDENT, Evidence, standard_errors
from bushcli.evidence.prior import ParameterPrior
from bushcli.likelihood.features import Features
from bushcli.likelihood.form import Likelihood
from bushcli.selection.fit import pose
from bushcli.selection.model_cache import COMPARED
from bushcli.selection.state import State

ROWS = 20


def likelihood(signal=0.0):
    """A likelihood of noise alone, without an error of form."""
    none, zero, same = np.zeros((0, ROWS)), np.zeros(ROWS), np.ones(ROWS)
    one = Features(none, np.zeros(0), zero, 0.0, signal, np.zeros(ROWS, dtype=int), same, 0.0)
    return Likelihood((one,), (0.0,))


def log_of(misfit):
    """Log likelihood of a misfit, shape (ROWS,)."""
    one = likelihood()
    return one.judge(one.left([misfit])).log


# Log likelihood of no misfit. That of any other is lower by half its sum of squares, as the first test checks.
CONSTANT = log_of(np.zeros(ROWS))


def of(misfit, slopes, values, priors, one_sided=()):
    known = [ParameterPrior(p, {}, i in one_sided) for i, p in enumerate(priors)]
    return Evidence(likelihood(), [misfit], [slopes], np.asarray(values), known, [0.0] * len(priors))


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0, 1e3])
def test_noise_alone_has_a_normal_likelihood(size):
    z = size * np.random.default_rng(7).normal(size=ROWS)
    assert log_of(z) == pytest.approx(CONSTANT - 0.5 * float(z @ z), rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("best", [0.0, 1.0, 4.0, 30.0])
@pytest.mark.parametrize("std", [0.3, 2.0])
def test_amplitudes_of_either_sign(best, std):
    """With Student's t as prior, against quadrature: Laplace's method assumes a Gaussian posterior."""
    J, prior = np.ones(ROWS) / math.sqrt(ROWS), Prior("t", std)
    z0 = -best * J
    x = float(_best(z0, J, prior, -40.0, 80.0))
    found = of(z0 + J * x, J[:, None], [x], [prior])
    exact = integral(z0, J, prior, -40.0, 80.0)
    # Where the prior's mode and the data's hold as much, Laplace sees one of them.
    assert exact - math.log(2.0) - 0.2 < found.log < exact + 0.2
    errors = standard_errors(["x"], found)
    assert errors["x"] == pytest.approx((1.0 + STUDENT * prior.curvature(x, {})) ** -0.5)


def _best(z0, J, prior, low, high):
    def objective(x):
        return float(np.sum((z0 + J * x) ** 2)) + prior.row(x, {})[0] ** 2

    grid = np.linspace(low, high, 4001)
    near = grid[int(np.argmin([objective(x) for x in grid]))]
    return minimize_scalar(objective, bracket=(near - 0.05, near, near + 0.05)).x


def integral(z0, J, prior, low, high, logarithm=False):
    """Evidence of one parameter by quadrature, over the parameter or its logarithm."""

    def log(x):
        z = z0 + J * x
        return CONSTANT - 0.5 * float(z @ z)

    best = max(map(log, _grid(low, high, logarithm)))

    def density(t):
        x = math.exp(t) if logarithm else t
        jacobian = t if logarithm else 0.0
        return math.exp(log(x) - best + prior.log_density(x, {}) + jacobian)

    ends = (math.log(low), math.log(high)) if logarithm else (low, high)
    points = np.linspace(*ends, 60)[1:-1]
    value, error = quad(density, *ends, points=points, limit=400)
    assert error < 1e-4 * value
    return best + math.log(value)


def _grid(low, high, logarithm):
    return np.geomspace(low, high, 200) if logarithm else np.linspace(low, high, 200)


# Amplitude at which the data alone have their optimum, in its standard deviations; their ratio to the prior's scale.
@pytest.mark.parametrize("best", [8.0, 3.0, 1.0, 0.3, 0.0, -0.5, -2.0, -5.0])
@pytest.mark.parametrize("narrow", [0.1, 0.5, 2.0])
def test_amplitudes_that_cannot_be_negative_are_integrated_above_zero_only(best, narrow):
    J = np.ones(ROWS) / math.sqrt(ROWS)
    prior = Prior("half_t", 1.0 / narrow)
    z0 = -best * J
    x = max(0.0, float(_best(z0, J, prior, -10.0, 20.0)))
    found = of(z0 + J * x, J[:, None], [x], [prior], {0})
    exact = integral(z0, J, prior, 0.0, 60.0)
    # Where the prior's mode and the data's hold as much, Laplace sees one of them.
    assert exact - math.log(2.0) - 0.1 < found.log < exact + 0.15


@pytest.mark.parametrize(
    ("first", "second"), [(4.0, 4.0), (0.0, 3.0), (-2.0, 2.0), (0.5, -3.0), (-1.0, -1.0)]
)
@pytest.mark.parametrize("correlation", [0.0, 0.4])
def test_two_amplitudes_that_cannot_be_negative(first, second, correlation):
    """Against a dense grid; where both lie near their bounds and act alike, the product of integrals is not exact."""
    rng = np.random.default_rng(3)
    q, _ = np.linalg.qr(rng.normal(size=(ROWS, 2)))
    J = np.column_stack([q[:, 0], correlation * q[:, 0] + math.sqrt(1 - correlation**2) * q[:, 1]])
    z0 = -J @ np.array([first, second])
    prior = Prior("half_t", 3.0)
    grid = np.linspace(0.0, 16.0, 321)
    a, b = (part.ravel() for part in np.meshgrid(grid, grid, indexing="ij"))
    squares = np.sum((z0 + np.outer(a, J[:, 0]) + np.outer(b, J[:, 1])) ** 2, axis=1)
    weight = np.where(grid == 0.0, 0.5, 1.0) * (grid[1] - grid[0]) * 2.0 * t.pdf(grid, 3, scale=prior._scale)
    both = np.outer(weight, weight).ravel()
    exact = float(logsumexp(-0.5 * squares, b=both)) + CONSTANT
    rows = np.array([prior.row(x, {})[0] ** 2 for x in grid])
    best = int(np.argmin(squares + np.add.outer(rows, rows).ravel()))
    x = np.array([a[best], b[best]])
    found = of(z0 + J @ x, J, x, [prior, prior], {0, 1})
    near = min(x) < 1.0
    assert found.log == pytest.approx(exact, abs=0.3 if near and correlation else 0.1)


LOGARITHMIC = [
    Prior("log_normal", 1.0, 0.5),
    Prior("log_normal", 1.0, 1.5),
    Prior("log_uniform", 0.1, 10.0),
    Prior("log_uniform", 0.01, 100.0),
]


@pytest.mark.parametrize("prior", LOGARITHMIC, ids=["narrow", "wide", "two decades", "four decades"])
@pytest.mark.parametrize("truth", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("std", [0.03, 0.3, 1.0])
def test_logarithmic_priors_are_integrated_in_the_logarithm(prior, truth, std):
    """Amplitudes known to a few per cent, roughly, or hardly at all.

    For amplitudes of about one standard error a log-uniform prior over four decades leaves a plateau towards zero,
    which a Gaussian about the maximum neglects: Laplace's method is 0.6 too low there.
    """
    J = np.ones(ROWS) / math.sqrt(ROWS) / std
    z0 = -truth * J
    t = np.linspace(math.log(1e-4), math.log(1e3), 40_001)
    size = np.exp(t)
    density = np.array([prior.log_density(x, {}) for x in size]) + t
    # The maximum a posteriori in the logarithm, as a fit finds it.
    x = float(size[np.argmax(density - 0.5 * ((size - truth) / std) ** 2)])
    found = of(z0 + J * x, J[:, None], [x], [prior])
    exact = integral(z0, J, prior, 1e-4, 1e3, logarithm=True)
    plateau = prior.shape == "log_uniform" and prior.low < 0.05 and std == truth
    assert found.log == pytest.approx(exact, abs=0.7 if plateau else 0.5)


@pytest.mark.parametrize("prior", LOGARITHMIC)
def test_what_the_data_say_nothing_of_costs_nothing(prior):
    z0 = np.random.default_rng(4).normal(size=ROWS)
    found = of(z0, np.zeros((ROWS, 1)), [prior.median({})], [prior])
    assert found.log == pytest.approx(log_of(z0), abs=0.5)


def test_a_parameter_of_the_law_pays_for_what_it_could_do_to_the_forces():
    """Its prior is normal about its value, so wide that it changes the forces by their own size."""
    signal = 1e6
    J = np.random.default_rng(5).normal(size=(ROWS, 1))
    found = Evidence(likelihood(signal), [np.zeros(ROWS)], [J], np.array([0.4]), [None], [0.0])
    width = LAW_SHARE * math.sqrt(signal)
    scale = found.judgement.scale[0]
    assert found.log - found.judgement.log == pytest.approx(-0.5 * math.log(1.0 + width**2 / scale), rel=1e-6)


# -- on a coupon ---------------------------------------------------------------------------------------------------


def by_grid(coupon, state, sizes):
    """Evidence of neo-Hookean rubber with one permanent set by a grid over both: its stress is linear in C10."""
    _, problem = pose(coupon.cache, coupon.case, state.model, coupon.measured)
    assert state.fitted.names == ("C10", "permanent_set.set")
    value, _ = state.fitted.x
    one = coupon.problem.likelihood.features[0]
    recorded = coupon.recordings[0].force
    slope = state.slopes[0][:, 0]
    # The law's prior is that of the evidence: about the value, as wide as a change of all forces by their own size.
    width = LAW_SHARE * math.sqrt(coupon.problem.likelihood.signal.sum()) / float(np.linalg.norm(slope))
    std = math.sqrt(state.evidence.covariance[0, 0])
    moduli = np.linspace(-8.0, 8.0, 161) * std + value
    ((force, _),) = problem.forces(np.array([2.0 * value, sizes[0]]))
    ((half, _),) = problem.forces(np.array([value, sizes[0]]))
    np.testing.assert_allclose(force, 2.0 * half, rtol=0.0, atol=COMPARED * force.max())
    known = state.priors["permanent_set.set"]
    rows = []
    for size in sizes:
        ((force, _),) = problem.forces(np.array([value, size]))
        unit, rest = one.of(force) / value, one.of(recorded)
        likelihood = coupon.problem.likelihood
        logs = [likelihood.judge(likelihood.left([c * unit - rest])).log for c in moduli]
        rows.append(
            logsumexp(np.array(logs) + norm.logpdf(moduli, value, width))
            + known.prior.log_density(size, known.scales)
        )
    steps = np.full(len(sizes), sizes[1] - sizes[0])
    steps[[0, -1]] *= 0.5
    return float(logsumexp(rows, b=steps * (moduli[1] - moduli[0])))


@pytest.mark.slow
@pytest.mark.parametrize("set_", [0.1, 0.02, 0.0])
def test_laplace_on_a_coupon_is_the_integral_over_a_grid(coupon, set_):
    """A large permanent set, one smaller than the error of the law, and none: to half a nat."""
    one = coupon("neo_hookean", set_=set_)
    state = one.fit(one.model(permanent_set={"set": 0.03}))
    std = math.sqrt(state.evidence.covariance[1, 1])
    best = float(state.fitted.x[1])
    sizes = np.linspace(max(0.0, best - 7.0 * std), best + 7.0 * std, 61)
    assert state.evidence.log == pytest.approx(by_grid(one, state, sizes), abs=0.5)


def test_the_law_alone_on_a_coupon(coupon):
    """One linear parameter: Laplace's method approximates Student's likelihood, not a normal one."""
    one = coupon("neo_hookean", set_=0.1)
    # With nothing to be explained: moduli beside the best one do not explain a part of what it leaves.
    whole = replace(one.problem.likelihood, plain=(0.0,))
    state = State(replace(one.problem, likelihood=whole), one.state.fitted)
    features = one.problem.likelihood.features[0]
    unit = features.of(state.fitted.simulated[0]) / state.fitted.x[0]
    rest = features.of(one.recordings[0].force)
    width = LAW_SHARE * math.sqrt(one.problem.likelihood.signal.sum()) / float(np.linalg.norm(unit))
    moduli = state.fitted.x[0] + np.linspace(-12.0, 12.0, 2001) * math.sqrt(state.evidence.covariance[0, 0])
    logs = [whole.judge(whole.left([c * unit - rest])).log for c in moduli]
    exact = logsumexp(np.array(logs) + norm.logpdf(moduli, state.fitted.x[0], width), b=moduli[1] - moduli[0])
    assert state.evidence.log == pytest.approx(float(exact), abs=0.5)
