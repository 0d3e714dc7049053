"""The size of the noise from the features of a misfit: noise is flat over the degrees, missing physics falls."""

import numpy as np
import pytest

from bushcli.diagnosis.likelihood.features import Features
from bushcli.diagnosis.likelihood.level import levelled
from bushcli.diagnosis.likelihood.noise import NoiseModel

BRANCHES = 14
DEGREES = np.tile(np.arange(6), BRANCHES)
K = len(DEGREES)
# Degrees of freedom of a noise that is known to some 40 %.
NOISE = NoiseModel(5.0, 0.3, 3.0)


def features():
    return Features(np.zeros((0, K)), np.zeros(0), np.zeros(K), 0.0, 1e6, DEGREES)


def drawn(noise, physics, fall, seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=K) * np.sqrt(noise**2 + physics * fall**DEGREES)


@pytest.mark.parametrize("noise", [0.6, 1.0, 1.7])
@pytest.mark.parametrize("physics", [(0.0, 0.5), (1e3, 0.25), (1e4, 0.125)])
def test_noise_is_found_beside_missing_physics(noise, physics):
    found = np.array([levelled(NOISE, features(), drawn(noise, *physics, seed)).sigma for seed in range(12)])
    assert np.median(found) / NOISE.sigma == pytest.approx(noise, rel=0.35)


@pytest.mark.parametrize("physics", [(1e6, 0.125), (300.0, 0.6)])
def test_where_missing_physics_covers_all_degrees_the_noise_stays_what_the_recording_says(physics):
    found = np.array([levelled(NOISE, features(), drawn(1.0, *physics, seed)).sigma for seed in range(12)])
    assert np.median(found) / NOISE.sigma == pytest.approx(1.0, abs=0.3)


def test_flat_misfit_is_noise():
    """The recording's noise was estimated as 1; features of 1.7 in all degrees show that it is larger."""
    better = levelled(NOISE, features(), drawn(1.7, 0.0, 0.5, 3))
    assert better.sigma == pytest.approx(1.7 * NOISE.sigma, rel=0.2)
    assert better.freedom > 2 * NOISE.freedom
    assert better.correlation == NOISE.correlation


def test_known_noise_stays():
    known = NoiseModel(2.0)
    assert levelled(known, features(), drawn(3.0, 0.0, 0.5, 1)) == known
