"""Relaxation spectra of tables of dynamic moduli."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.inverse.spectrum import Spectrum, _Problem, fit_spectrum, relaxation_spectrum
from bushcli.recording.dynamic.table import DynamicTable

#: A rubber with a broad spectrum: E_inf in MPa, and eight terms.
RUBBER = Spectrum(3.0, np.array([0.5, 0.6, 0.8, 1.0, 0.8, 0.5, 0.3, 0.2]), np.logspace(-5.0, 2.0, 8))


def table(frequency, temperature=None, shifts=(0.0,), lag=0.0, noise=0.0, seed=0):
    """Return a table of the rubber: sweeps at temperatures whose times are shifted, ln a_T, by a rig that lags."""
    rng = np.random.default_rng(seed)
    rows = [(f, k) for k in range(len(shifts)) for f in frequency]
    f, step = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    modulus = RUBBER.at(2.0 * np.pi * f * np.exp(np.asarray(shifts)[step])) * np.exp(2j * np.pi * f * lag)
    modulus = (
        modulus * (1.0 + noise * rng.normal(size=len(f))) * np.exp(1j * 0.3 * noise * rng.normal(size=len(f)))
    )
    unknown = np.full(len(f), np.nan)
    return DynamicTable(
        name="sweep", mode="uniaxial", quantity="E", frequency=f, storage=modulus.real, loss=modulus.imag,
        amplitude=unknown, preload=unknown, preload_force=unknown,
        temperature=unknown if temperature is None else np.asarray(temperature)[step],
        storage_error=unknown, loss_error=unknown, third_harmonic=unknown,
    )  # fmt: skip


FREQUENCIES = np.geomspace(0.1, 100.0, 13)


def test_a_sweep_is_described_and_its_relaxation_follows():
    found = fit_spectrum(table(FREQUENCIES))
    assert max(found.storage_percent, found.loss_percent) < 0.5
    # Within the times of the sweep; the modulus at rest lies beyond them.
    time = np.geomspace(0.005, 0.5, 20)
    np.testing.assert_allclose(found.spectrum.relaxation(time), RUBBER.relaxation(time), rtol=0.01)
    assert (found.spectrum.moduli > 0.0).all()
    np.testing.assert_allclose(
        found.spectrum.relative_moduli * found.spectrum.equilibrium, found.spectrum.moduli
    )


def test_noise_is_not_described():
    found = fit_spectrum(table(FREQUENCIES, noise=0.01, seed=4))
    time = np.geomspace(0.005, 0.5, 20)
    np.testing.assert_allclose(found.spectrum.relaxation(time), RUBBER.relaxation(time), rtol=0.02)


@pytest.mark.parametrize("lag", [0.0, 5e-5])
def test_shifts_and_lag_are_found_with_the_spectrum(lag):
    shifts = np.array([6.0, 3.0, 0.0, -2.0])
    found = fit_spectrum(table(FREQUENCIES, [0.0, 10.0, 25.0, 50.0], shifts, lag, 0.002), reference=25.0)
    assert found.reference == 25.0
    off = np.abs(found.shifts - shifts / np.log(10.0))
    assert (off <= 4.0 * found.shift_errors + 1e-12).all()
    assert off.max() < 0.1
    assert abs(found.lag - lag) < 4.0 * found.lag_error
    assert found.lag_error < 5e-6
    assert max(found.storage_percent, found.loss_percent) < 2.0


def test_frequency_to_relaxation_and_back():
    found = fit_spectrum(table(FREQUENCIES)).spectrum
    time = np.geomspace(found.times.min(), found.times.max(), 200)
    omega = 2.0 * np.pi * FREQUENCIES
    back = relaxation_spectrum(time, found.relaxation(time)).at(omega)
    np.testing.assert_allclose(back.real, RUBBER.at(omega).real, rtol=0.01)
    np.testing.assert_allclose(back.imag, RUBBER.at(omega).imag, rtol=0.03)


def test_derivatives_are_those_of_finite_differences():
    one = table(FREQUENCIES, [0.0, 25.0, 50.0], (2.0, 0.0, -1.0))
    step = np.repeat([0, 1, 2], len(FREQUENCIES))
    free = np.array([True, False, True, True])
    problem = _Problem(2.0 * np.pi * one.frequency, one.storage, one.loss, step, free)
    shifts = np.array([2.1, 0.0, -0.9, 1e-5])
    solved = problem.solve(shifts, 0.1)
    exact = problem.derivative(shifts, solved)
    for column, (k, h) in enumerate(((0, 1e-6), (2, 1e-6), (3, 1e-9))):
        ends = [shifts + sense * h * np.eye(4)[k] for sense in (1.0, -1.0)]
        high, low = (problem.design(end, solved.times) @ solved.values for end in ends)
        np.testing.assert_allclose(exact[:, column], (high - low) / (2.0 * h), rtol=1e-5, atol=1e-7)


def test_a_spring_pot_is_found_where_the_rubber_is_one():
    one = table(FREQUENCIES)
    modulus = 2.0 + 0.5 * (2j * np.pi * one.frequency) ** 0.3
    one.storage[:], one.loss[:] = modulus.real, modulus.imag
    pot = fit_spectrum(one).spring_pot
    np.testing.assert_allclose([pot.equilibrium, pot.modulus, pot.exponent], [2.0, 0.5, 0.3], rtol=1e-3)
