"""A table of dynamic stiffness as a recording: units of its rows, and the noise that its rows show."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.likelihood.features import TABLE_DEGREE, features
from bushcli.likelihood.noise import noise_model
from bushcli.recording.dynamic.rows import ANGLE, MAGNITUDE, recorded_table
from bushcli.recording.dynamic.table import DynamicTable

NOISE = 0.003, np.radians(0.1)


def table(points=20, preloads=(0.0, 2.0, 4.0), noise=NOISE, errors=None):
    """A branch about some preloads."""
    rng = np.random.default_rng(5)
    f = np.tile(np.geomspace(1.0, 200.0, points), len(preloads))
    q = np.repeat(preloads, points)
    x = 2j * np.pi * f * 0.01
    K = (300.0 + 20.0 * q) * (1.0 + 0.3 * x / (1.0 + x))
    K = K * (1 + noise[0] * rng.standard_normal(len(f))) * np.exp(1j * noise[1] * rng.standard_normal(len(f)))
    none = np.full(len(f), np.nan)
    stated = none if errors is None else errors * np.abs(K)
    return DynamicTable(
        "rig", "axial", "stiffness", f, K.real, K.imag, none, q, none, none, stated, stated, none
    )


def test_rows_are_in_units_of_their_errors():
    one = recorded_table(table())
    K = one.table.storage + 1j * one.table.loss
    assert one.rows(K) == pytest.approx(one.force)
    off = one.rows(K * 1.01 * np.exp(0.002j)) - one.force
    assert off[:60] == pytest.approx(0.01 / one.errors[0], rel=1e-3)
    assert off[60:] == pytest.approx(1.01 * 0.002 / one.errors[1], rel=1e-3)
    assert one.stiffness(one.force + off) == pytest.approx(K * 1.01 * np.exp(0.002j))


def test_the_scatter_about_smooth_curves_is_the_noise():
    one = recorded_table(table())
    assert one.errors[:, 0] == pytest.approx(NOISE, rel=0.25)
    assert one.freedom > 20.0
    (few,) = {tuple(recorded_table(table(points=3)).errors[:, 0])}
    assert few == pytest.approx((MAGNITUDE, ANGLE))
    stated = recorded_table(table(errors=0.02))
    assert stated.errors == pytest.approx(np.full((2, 60), 0.02))


def test_a_faulty_row_does_not_raise_the_noise():
    spoiled = table()
    storage = spoiled.storage.copy()
    storage[7] *= 1.4
    wrong = DynamicTable(**{**vars(spoiled), "storage": storage})
    faulty = np.arange(60) == 7
    assert recorded_table(wrong, faulty).errors[:, 0] == pytest.approx(
        recorded_table(spoiled).errors[:, 0], rel=0.2
    )


def test_each_curve_has_features_of_magnitude_and_angle():
    one = recorded_table(table())
    used = np.ones(120, dtype=bool)
    found = features(one, noise_model(one, used), used, 0.005)
    assert found.count == 3 * 2 * (TABLE_DEGREE + 1)
    assert found.basis.T @ found.basis == pytest.approx(np.eye(found.count), abs=1e-9)
    used[3] = False
    assert not features(one, noise_model(one, used), used, 0.005).basis[3].any()
