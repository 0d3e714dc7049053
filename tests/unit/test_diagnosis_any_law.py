"""What any law could do at most: a bound on static misfit, and none on loops."""

import numpy as np

from bushcli.diagnosis import any_law
from bushcli.diagnosis.noise_model import Compared, NoiseModel
from bushcli.diagnosis.weighing import linear_fit
from bushcli.recording import Recording

SIGMA = 2.0
Q = np.concatenate([np.linspace(0, 5, 60), np.linspace(5, -5, 120), np.linspace(-5, 0, 60)])
BACK = np.concatenate([[0.0], np.diff(Q)]) < 0


def bound(misfit):
    """Of a linear spring with that much missing, noise added."""
    rng = np.random.default_rng(2)
    recorded = 100 * Q + misfit + SIGMA * rng.normal(size=len(Q))
    recording = Recording("axial", Q, recorded, np.arange(float(len(Q))), name="axial")
    slope = Q[:, None]
    k = float(np.linalg.lstsq(slope, recorded, rcond=None)[0][0])
    channel = Compared(recording, k * Q, NoiseModel(SIGMA))
    fit = linear_fit([channel], (0.0,), [slope])
    return any_law.most([channel], (0.0,), fit), float(fit.rest @ fit.rest)


def test_a_static_misfit_can_be_taken_away():
    most, whole = bound(0.5 * Q**3)
    assert most > 0.95 * whole


def test_a_loop_cannot():
    most, whole = bound(np.where(BACK, -1, 1) * (25 - Q**2))
    assert most < 0.05 * whole


def test_noise_promises_nothing():
    most, whole = bound(np.zeros_like(Q))
    assert most < 0.1 * whole
