"""Iteration, step and radius, which SciPy does not report: compared with the arguments of its internal rule."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from scipy.optimize import least_squares

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.radius import Follower

BOUNDS = Bounds(np.array([0.2, -3.0]), np.array([2.5, 4.0]))


def rosenbrock(x):
    """Rosenbrock's function as two misfits; beyond a line it has no solution."""
    value = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    return value * np.nan if x[1] - x[0] > 2.5 else value


def slope(x):
    return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


@pytest.mark.parametrize("start", [(0.3, 2.7), (2.2, -2.5), (1.9, 3.9), (0.21, -2.9)], ids=str)
def test_radius_and_step_are_those_of_scipy(start, monkeypatch):
    module = importlib.import_module("scipy.optimize._lsq.trf")
    own, true = module.update_tr_radius, []

    def listening(radius, actual, predicted, step, hit):
        true.append((radius, step))
        return own(radius, actual, predicted, step, hit)

    monkeypatch.setattr(module, "update_tr_radius", listening)
    follower, found = Follower(BOUNDS), []

    def asked(x):
        trial = follower.asks(x)
        value = rosenbrock(x)
        follower.gets(value)
        # SciPy's rule is not called for the start or after failures.
        if trial.iteration and np.isfinite(value).all():
            found.append((trial.radius, trial.step))
        return value

    def derived(x):
        value = slope(x)
        follower.derives(x, value)
        return value

    result = least_squares(
        asked,
        start,
        jac=derived,
        bounds=(BOUNDS.lower, BOUNDS.upper),
        x_scale="jac",
        method="trf",
        max_nfev=40,
    )
    assert len(true) >= 2
    assert np.array(found) == pytest.approx(np.array(true), rel=1e-6, abs=1e-12)
    assert follower.iteration == result.njev - 1


def test_before_the_first_derivative_there_is_no_radius():
    trial = Follower(BOUNDS).asks(np.array([1.0, 1.0]))
    assert (trial.iteration, trial.step) == (0, 0.0)
    assert np.isnan(trial.radius)
