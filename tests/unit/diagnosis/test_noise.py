"""Noise of a recording from itself: known noise on curves with turns, holds and memory."""

import itertools

import numpy as np
import pytest

from bushcli.diagnosis.likelihood.noise import noise_model
from bushcli.recording import Recording

SIGMA = 4.0
TRIALS = 40


def cycles(samples_per_leg: int, legs: int = 8):
    """A path to and fro with that many samples on each way, s and mm."""
    ends = [0.0, *[5.0 if i % 2 == 0 else -2.0 for i in range(legs)]]
    q = np.concatenate(
        [[0.0], *(np.linspace(a, b, samples_per_leg + 1)[1:] for a, b in itertools.pairwise(ends))]
    )
    return np.arange(float(len(q))), q


def force(q):
    """Stiffening, with a loop: another curve on the way back."""
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


@pytest.mark.parametrize("samples", [15, 60])
def test_white_noise_is_found_in_its_size_and_without_memory(samples):
    found = estimates(samples, lambda rng, n: SIGMA * rng.normal(size=n))
    sizes = np.array([one.sigma for one in found]) / SIGMA
    assert abs(np.median(sizes) - 1) < 0.06
    # Of short branches, too: 120 samples know their noise to a tenth.
    assert np.std(sizes) < 0.13
    assert sum(one.correlation > 0 for one in found) <= 1


def test_memory_shows_in_long_branches():
    def coloured(rng, n):
        e = rng.normal(size=n)
        for i in range(1, n):
            e[i] = 0.8 * e[i - 1] + 0.6 * e[i]
        return SIGMA * e

    found = estimates(60, coloured)
    assert np.median([one.correlation for one in found]) > 0.5


def test_a_kink_in_a_branch_is_not_taken_for_noise():
    """Contact in the middle of the way: polynomials miss it, differences hardly see it."""
    time, q = cycles(60)
    rng = np.random.default_rng(5)
    stop = 200 * np.maximum(q - 3.0, 0.0)
    made = Recording("axial", q, force(q) + stop + SIGMA * rng.normal(size=len(q)), time, name="axial")
    assert noise_model(made).sigma == pytest.approx(SIGMA, rel=0.3)
