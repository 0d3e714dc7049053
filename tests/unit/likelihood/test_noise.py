"""Noise estimated from the recording itself: known noise on curves with turns, holds and memory."""

import itertools

import numpy as np
import pytest

from bushcli.likelihood.noise import noise_model
from bushcli.recording import Recording

SIGMA = 4.0
TRIALS = 40


def cycles(samples_per_leg: int, legs: int = 8):
    """Time (s) and displacement (mm) of a path to and fro with this many samples on each leg."""
    ends = [0.0, *[5.0 if i % 2 == 0 else -2.0 for i in range(legs)]]
    q = np.concatenate(
        [[0.0], *(np.linspace(a, b, samples_per_leg + 1)[1:] for a, b in itertools.pairwise(ends))]
    )
    return np.arange(float(len(q))), q


def force(q):
    """A stiffening force with a loop."""
    back = np.concatenate([[0.0], np.diff(q)]) < 0
    return 120 * q + 3 * q**3 - 40 * back * (5 - q) * (q + 2) / 10


def estimates(samples_per_leg, noise):
    time, q = cycles(samples_per_leg)
    rng = np.random.default_rng(3)
    found = []
    for _ in range(TRIALS):
        made = Recording("axial", q, force(q) + noise(rng, len(q)), time, name="axial")
        found.append(noise_model(made))
    return found


def remembering(correlation):
    def noise(rng, n):
        e = rng.normal(size=n)
        for i in range(1, n):
            e[i] = correlation * e[i - 1] + np.sqrt(1 - correlation**2) * e[i]
        return SIGMA * e

    return noise


def unit(size, correlation):
    """Standard deviation of the noise per independent sample."""
    return size * np.sqrt((1 + correlation) / (1 - correlation))


@pytest.mark.parametrize("samples", [30, 60])
@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.7])
def test_an_independent_sample_is_known_as_well_as_is_stated(samples, correlation):
    """Over many recordings with the same noise; the estimate is drawn towards the prior's mean."""
    found = estimates(samples, remembering(correlation))
    away = np.log([unit(one.sigma, one.correlation) for one in found]) - np.log(unit(SIGMA, correlation))
    stated = np.array([0.5 * np.sqrt(2 / one.freedom) for one in found])
    assert np.sqrt(np.mean((away / stated) ** 2)) < 1.5
    assert np.sqrt(np.mean(away**2)) < 0.6


@pytest.mark.slow
def test_noise_is_known_the_better_the_more_samples_there_are():
    doubts = [np.median([1 / one.freedom for one in estimates(n, remembering(0.3))]) for n in (20, 60, 240)]
    assert doubts[0] > doubts[1] > 2 * doubts[2]


def test_memory_shows_in_long_branches():
    assert np.median([one.correlation for one in estimates(60, remembering(0.8))]) > 0.5
    assert np.median([one.correlation for one in estimates(60, remembering(0.0))]) < 0.2


def test_a_kink_in_a_branch_is_not_taken_for_noise():
    """Contact in the middle of a leg: polynomials do not fit it, but differences are hardly affected."""
    time, q = cycles(60)
    rng = np.random.default_rng(5)
    stop = 200 * np.maximum(q - 3.0, 0.0)
    made = Recording("axial", q, force(q) + stop + SIGMA * rng.normal(size=len(q)), time, name="axial")
    assert noise_model(made).sigma == pytest.approx(SIGMA, rel=0.3)


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.7])
def test_branches_too_short_for_cubics_leave_the_memory_of_the_noise_open(correlation):
    """Differences alone do not determine it: the stated spread covers every correlation that loggers have."""
    found = estimates(10, remembering(correlation))
    away = np.log([unit(one.sigma, one.correlation) for one in found]) - np.log(unit(SIGMA, correlation))
    stated = np.sqrt(0.5 / np.mean([one.freedom for one in found]))
    assert 0.4 < stated < 0.8
    assert abs(np.mean(away)) < 2.0 * stated


def test_noise_about_the_floor_is_not_taken_for_known():
    """Noise of nearly the floor's size is uncertain; the floor counts as known only where the noise is far below it."""
    time, q = cycles(10)
    rng = np.random.default_rng(5)
    span = float(np.ptp(force(q)))
    for share, known in ((3e-4, False), (1e-6, True)):
        noise = share * span * rng.normal(size=len(q))
        found = noise_model(Recording("axial", q, force(q) + noise, time, name="axial"))
        assert found.sigma * np.sqrt(found.correlation_time) == pytest.approx(1e-3 * span, rel=0.01)
        assert np.isinf(found.freedom) == known


@pytest.mark.parametrize("noise", [0.01, SIGMA])
def test_a_sample_that_does_not_count_sets_no_scale(noise):
    """The smallest noise is a share of the range, and priors are relative to force and stiffness."""
    time, q = cycles(60)
    clean = force(q) + noise * np.random.default_rng(5).normal(size=len(q))
    spiked, used = clean.copy(), np.ones(len(q), dtype=bool)
    spiked[200], used[200] = 5.0 * np.ptp(clean), False
    one, other = (Recording("axial", q, f, time, name="axial") for f in (clean, spiked))
    assert noise_model(other, used).sigma == pytest.approx(noise_model(one).sigma, rel=0.02)
    assert noise_model(other, used).least == pytest.approx(noise_model(one).least, rel=1e-3)
    assert other.with_gaps_interpolated(used).force == pytest.approx(
        np.where(used, clean, (clean[199] + clean[201]) / 2)
    )
    assert other.with_gaps_interpolated(~np.zeros_like(used)) is other
    assert other.with_gaps_interpolated(np.zeros_like(used)) is other
