"""The noise from the features of a misfit: its share in each follows from its correlation, missing physics falls."""

import numpy as np
import pytest

from bushcli.likelihood.features import Features
from bushcli.likelihood.features import features as features_of
from bushcli.likelihood.level import refine_noise
from bushcli.likelihood.noise import NoiseModel, noise_model
from bushcli.recording import Recording

BRANCHES = 14
DEGREES = np.tile(np.arange(6), BRANCHES)
K = len(DEGREES)
# Degrees of freedom of a noise that is known to some 40 %.
NOISE = NoiseModel(5.0, 0.3, 3.0)


def features():
    return Features(np.zeros((0, K)), np.zeros(0), np.zeros(K), 0.0, 1e6, DEGREES, np.ones(K), 0.0)


def drawn(noise, physics, fall, seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=K) * np.sqrt(noise**2 + physics * fall**DEGREES)


@pytest.mark.parametrize("noise", [0.6, 1.0, 1.7])
@pytest.mark.parametrize("physics", [(0.0, 0.5), (1e2, 0.25), (1e4, 0.125)])
def test_noise_is_found_beside_missing_physics(noise, physics):
    found = np.array(
        [refine_noise(NOISE, features(), drawn(noise, *physics, seed)).sigma for seed in range(12)]
    )
    assert np.median(found) / NOISE.sigma == pytest.approx(noise, rel=0.35)


@pytest.mark.parametrize("physics", [(1e6, 0.125), (300.0, 0.6)])
def test_where_missing_physics_covers_all_degrees_the_noise_stays_what_the_recording_says(physics):
    found = np.array(
        [refine_noise(NOISE, features(), drawn(1.0, *physics, seed)).sigma for seed in range(12)]
    )
    assert np.median(found) / NOISE.sigma == pytest.approx(1.0, abs=0.3)


def test_flat_misfit_is_noise():
    """The recording's noise was estimated as 1; features of 1.7 in all degrees show that it is larger."""
    better = refine_noise(NOISE, features(), drawn(1.7, 0.0, 0.5, 3))
    assert better.sigma == pytest.approx(1.7 * NOISE.sigma, rel=0.2)
    assert better.freedom > 2 * NOISE.freedom
    assert better.correlation == NOISE.correlation


def test_known_noise_stays():
    known = NoiseModel(2.0)
    assert refine_noise(known, features(), drawn(3.0, 0.0, 0.5, 1)) == known


def recorded(correlation, seed):
    """Return a recording of eleven short branches with noise of 5 N, and that noise."""
    rng = np.random.default_rng(seed)
    turns = np.array([0.0, 0.45, -0.25, 0.7, -0.4, 1.0, 0.9, -0.5, 1.0, -0.5, 1.0, 0.0])
    q = np.interp(np.linspace(0.0, len(turns) - 1.0, 276), np.arange(len(turns)), turns)
    noise = 5.0 * rng.normal(size=len(q))
    for i in range(1, len(q)):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1.0 - correlation**2) * noise[i]
    force = 500.0 * q + 150.0 * q**3 + noise
    return Recording("axial", q, force, time=np.arange(len(q), dtype=float)), noise


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.6, 0.75])
def test_noise_with_a_memory_is_found_in_short_branches(correlation):
    """Cubics in windows of twelve samples absorb most of such noise; the features of the whole branches show it."""
    truth = 5.0 * np.sqrt((1.0 + correlation) / (1.0 - correlation))
    used, ratios, apart = np.ones(276, dtype=bool), [], []
    for seed in range(16):
        recording, noise = recorded(correlation, seed)
        first = noise_model(recording)
        one = features_of(recording, first, used, 0.0)
        found = refine_noise(first, one, one.of(noise))
        ratios.append(np.log(found.sigma * np.sqrt(found.correlation_time) / truth))
        apart.append(np.mean(features_of(recording, found, used, 0.0).of(noise) ** 2))
    assert abs(np.median(ratios)) < 0.2
    # Each of 66 features has a variance of one.
    assert np.mean(apart) == pytest.approx(1.0, abs=0.2)
