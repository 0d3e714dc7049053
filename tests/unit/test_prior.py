"""Priors: densities, their residuals, and the ranges of usual values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import t

from bushcli.effects.prior import QUANTILE, TAIL, Prior

SCALES = {"travel": 5.0, "shear": 0.8, "stiffness": 400.0}
PRIORS = {
    "half_t": Prior("half_t", 0.3),
    "half_t_of": Prior("half_t", 0.02, of="travel"),
    "t": Prior("t", 0.25),
    "normal": Prior("normal", 0.5, of="travel"),
    "log_normal": Prior("log_normal", 1.0, 0.8, of="stiffness"),
    "log_normal_signed": Prior("log_normal", 0.1, 1.2, signed=True),
    "log_uniform": Prior("log_uniform", 1e-4, 0.02, of="1/shear"),
    "log_uniform_wide": Prior("log_uniform", 1e-12, 1e12),
    "log_uniform_signed": Prior("log_uniform", 0.2, 1.0, of="travel", signed=True),
}
ALL = pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS)


def mass(prior: Prior, low: float, high: float) -> float:
    """Probability between two values of the same sign, by quadrature; over the logarithm for a logarithmic prior."""
    if not prior.is_logarithmic:
        points = sorted({min(max(p, low), high) for p in (0.0, prior.range(SCALES)[1])})
        return quad(lambda x: math.exp(prior.log_density(x, SCALES)), low, high, points=points, limit=200)[0]
    sign = math.copysign(1.0, low)
    a, b = sorted((math.log(abs(low)), math.log(abs(high))))
    ends = [math.log(e * prior.unit(SCALES)) for e in (prior.low, prior.high)]

    def integrand(log: float) -> float:
        return math.exp(prior.log_density(sign * math.exp(log), SCALES) + log)

    points = [min(max(p, a), b) for p in ends] if prior.shape == "log_uniform" else None
    return quad(integrand, a, b, points=points, limit=200)[0]


def whole(prior: Prior) -> tuple[float, float]:
    """The interval that holds all of a prior's positive side, to rounding."""
    low, high = prior.range(SCALES)
    if not prior.is_logarithmic:
        # The tails of Student's t fall with the cube of the distance.
        far = (5.0 if prior.shape == "normal" else 1e3) * (high - low)
        return (low if low == 0.0 else low - far), high + far
    wide = 10 * (prior.high if prior.shape == "log_normal" else TAIL)
    return low * math.exp(-wide), high * math.exp(wide)


@ALL
def test_densities_integrate_to_one(prior: Prior) -> None:
    low, high = whole(prior)
    total = mass(prior, low, high) + (mass(prior, -high, -low) if prior.signed else 0.0)
    assert total == pytest.approx(1.0, abs=1e-7)


@ALL
def test_the_range_holds_95_percent_and_the_median_halves_it(prior: Prior) -> None:
    low, high = prior.range(SCALES)
    sides = 2.0 if prior.signed else 1.0
    assert sides * mass(prior, low, high) == pytest.approx(0.95, abs=1e-6)
    below = whole(prior)[0]
    median = prior.median(SCALES)
    assert low < median < high
    if prior.shape in ("t", "normal"):
        assert mass(prior, -median, median) == pytest.approx(0.5, abs=1e-6)
    else:
        assert sides * mass(prior, below, median) == pytest.approx(0.5, abs=1e-6)


@ALL
def test_the_tail_is_5_percent_at_the_ends_of_the_range(prior: Prior) -> None:
    low, high = prior.range(SCALES)
    assert prior.tail(high, SCALES) == pytest.approx(0.05, abs=1e-6)
    if low != 0.0:
        assert prior.tail(low, SCALES) == pytest.approx(0.05, abs=1e-6)
    assert prior.tail(0.5 * (low + high), SCALES) > 0.05
    assert prior.tail(high * 1.1, SCALES) < 0.05
    if prior.signed:
        assert prior.tail(-high, SCALES) == prior.tail(high, SCALES)


@ALL
def test_the_tail_is_a_probability(prior: Prior) -> None:
    low, high = whole(prior)
    sides = 2.0 if prior.signed else 1.0
    for value in (1.2 * prior.range(SCALES)[1], 0.9 * prior.range(SCALES)[1]):
        above = sides * mass(prior, value, high)
        both = 2.0 if prior.is_logarithmic or prior.shape in ("t", "normal") else 1.0
        assert prior.tail(value, SCALES) == pytest.approx(both * above, rel=1e-5)
    assert low < high


@ALL
def test_rows_are_the_density_and_curvatures_their_derivative(prior: Prior) -> None:
    low, high = prior.range(SCALES)
    top = prior.median(SCALES) if prior.is_logarithmic else 0.0

    def log(x: float) -> float:
        return prior.log_density(x, SCALES) + (math.log(abs(x)) if prior.is_logarithmic else 0.0)

    for value in (0.6 * high, high, 3.0 * high):
        residual, slope = prior.row(value, SCALES)
        assert -0.5 * residual**2 == pytest.approx(log(value) - log(top), abs=1e-9)
        step = 1e-5 * value
        found = (prior.row(value + step, SCALES)[0] - prior.row(value - step, SCALES)[0]) / (2 * step)
        assert slope == pytest.approx(found, rel=1e-4, abs=1e-12)
        if prior.shape != "log_uniform":
            assert prior.curvature(value, SCALES) == pytest.approx(slope**2)
    if prior.shape == "log_uniform":
        inside = math.sqrt(prior.low * prior.high) * prior.unit(SCALES)
        nodes = np.linspace(math.log(prior.low), math.log(prior.high), 100_001)
        assert prior.curvature(inside, SCALES) * inside**2 == pytest.approx(1 / np.var(nodes), rel=1e-4)
    assert low < high


def test_students_t_is_that_of_scipy() -> None:
    prior = PRIORS["t"]
    for value in (0.0, 0.1, -0.7, 5.0):
        scale = 0.25 * QUANTILE / t(3).ppf(0.975)
        assert prior.log_density(value, SCALES) == pytest.approx(t(3, scale=scale).logpdf(value), abs=1e-6)
        assert prior.tail(value, SCALES) == pytest.approx(2.0 * t(3, scale=scale).sf(abs(value)), rel=1e-5)


def test_values_without_density() -> None:
    assert PRIORS["half_t"].log_density(-1e-6, SCALES) == -math.inf
    assert PRIORS["log_normal"].log_density(0.0, SCALES) == -math.inf
    assert PRIORS["log_uniform"].log_density(-1e-3, SCALES) == -math.inf
    assert PRIORS["log_uniform"].tail(-1e-3, SCALES) == 0.0
    signed = PRIORS["log_uniform_signed"]
    assert signed.log_density(-3.0, SCALES) == signed.log_density(3.0, SCALES)


def test_what_a_prior_is_relative_to() -> None:
    assert PRIORS["half_t_of"].range(SCALES)[1] == pytest.approx(1.959964 * 0.1)
    assert PRIORS["log_uniform"].unit(SCALES) == pytest.approx(1 / 0.8)
    with pytest.raises(KeyError):
        PRIORS["log_uniform"].unit({})


@pytest.mark.parametrize(
    ("shape", "low", "high"), [("t", 0.0, 0.0), ("log_normal", 1.0, 0.0), ("log_uniform", 2.0, 1.0)]
)
def test_scales_must_be_possible(shape, low: float, high: float) -> None:
    with pytest.raises(ValueError, match="prior"):
        Prior(shape, low, high)
