"""The factor of calibration and mesh that is common to all forces of a channel."""

import numpy as np
import pytest

from bushcli.likelihood import calibration
from bushcli.likelihood.noise import Compared, NoiseModel, smooth_force
from bushcli.recording import Recording

SIGMA, FACTOR = 5.0, 0.005
Q = np.concatenate([np.linspace(0, 8, 65), np.linspace(8, -8, 100)[1:], np.linspace(-8, 0, 65)[1:]])
TIME = np.arange(len(Q), dtype=float)
FORCE = 100.0 * Q + 2.0 * Q**3


def channel(seed, factor=1.0):
    """A recording of a curve that is simulated without error."""
    noise = SIGMA * np.random.default_rng(seed).normal(size=len(Q))
    recording = Recording("axial", Q, factor * FORCE + noise, TIME, name="axial")
    return Compared(recording, FORCE, NoiseModel(SIGMA))


def scale(one):
    """Relative change of the simulated force that fits best, and its standard error."""
    fit = calibration.linear_fit([one], [FACTOR], [FORCE[:, None]])
    J = fit.jacobian[:, 0]
    return -float(J @ fit.misfit) / float(J @ J), float(J @ J) ** -0.5


def test_a_fit_is_not_drawn_to_smaller_forces():
    """A covariance of the noisy force would bias it, by a part of the noise's share of the power, here 0.2 %."""
    found = np.array([scale(channel(seed)) for seed in range(100)])
    noise = SIGMA / np.linalg.norm(FORCE)
    assert found[0, 1] == pytest.approx(np.hypot(FACTOR, noise), rel=0.05)
    assert abs(found[:, 0].mean()) < 4 * noise / np.sqrt(100)


def test_whitening_is_by_the_covariance():
    one = channel(1)
    F = smooth_force(one.recording)
    covariance = SIGMA**2 * np.eye(len(Q)) + FACTOR**2 * np.outer(F, F)
    rows = calibration.whiten(one.misfit, one, FACTOR)
    assert rows @ rows == pytest.approx(one.misfit @ np.linalg.solve(covariance, one.misfit), rel=1e-9)


def test_smoothing_takes_most_of_the_noise_off():
    left = smooth_force(channel(2).recording) - FORCE
    # Six coefficients for each of three branches of 65, 99 and 64 samples; the error is larger at their ends.
    assert np.sqrt(np.mean(left**2)) < 0.5 * SIGMA


def test_what_calibration_may_be_wrong_by_is_taken_out_but_no_more():
    small, large = (calibration.calibrate(channel(3, factor), FACTOR) for factor in (1.004, 1.05))
    assert np.sqrt(np.mean(small.misfit**2)) < 1.1 * SIGMA
    # Three standard deviations of the factor on the recorded force are taken out, not the whole five percent.
    left = float(FORCE @ large.misfit) / float(FORCE @ FORCE)
    assert left == pytest.approx(-(0.05 - 3 * FACTOR * 1.05), abs=4 * SIGMA / np.linalg.norm(FORCE))


def test_samples_without_an_answer_do_not_count():
    one = channel(4)
    some = Compared(one.recording, np.where(Q > 4, np.nan, FORCE), one.noise)
    rows = calibration.whiten(np.where(some.known, some.misfit, 0.0), some, FACTOR)
    assert not rows[Q > 4].any()
    assert np.isfinite(rows).all()
