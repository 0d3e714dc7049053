"""Vibrations of finite amplitude: local harmonics against integration along time, and their balance in a bushing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bushcli.inverse.thinned import fit_thinned
from bushcli.recording.dynamic.table import DynamicTable
from cases.dynamic.amplitude import UnevenModel
from cases.dynamic.model import modulus, sweep
from cases.dynamic.pencil import Pencil
from cases.dynamic.reduction import VectorBasis, basis_for
from cases.equilibrium import Equilibrium
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from cases.sine import ThinnedSpectrum
from forms.branches.payne import spectrum
from forms.law import law
from geometry.shape import Refinement, shapes

DECADES = np.linspace(-8.0, 0.0, 10)
THINNED = ThinnedSpectrum(np.full(10, 0.12), 10.0 * np.exp(DECADES), 400.0, 0.01, 0.9)
MU, DENSITY = 1.0, 1.1e-9


@pytest.mark.parametrize("pace", [0.0, 30.0])
def test_harmonics_are_those_of_an_integration_along_time(pace: float) -> None:
    spectrum = replace(THINNED, pace=pace)
    amplitude, frequency, steps, cycles = 0.05, 2.0, 4000, 6
    t = np.linspace(0.0, cycles / frequency, cycles * steps + 1)
    strain = amplitude * np.sin(2.0 * np.pi * frequency * t)
    rise = np.diff(strain)
    clock = np.diff(t) + (0.01 + amplitude) ** 0.9 * (pace * np.diff(t) + 400.0 * np.abs(rise))
    h, stress = np.zeros(len(THINNED.times)), np.zeros(len(t))
    for i, (dz, step) in enumerate(zip(clock, rise, strict=True)):
        h = h * np.exp(-dz / THINNED.times) + step * np.exp(-0.5 * dz / THINNED.times)
        stress[i + 1] = THINNED.moduli @ h
    last = slice(-steps, None)
    turn = 2.0 * np.pi * frequency * t[last]
    expected = [2.0 / steps / amplitude * np.sum(stress[last] * np.exp(-1j * n * turn) * 1j) for n in (1, 3)]
    first, third = spectrum.harmonics(np.array([amplitude]), frequency)
    # The sine begins at its zero, the integration's phase at its trough.
    assert abs(first[0] - expected[0]) < 1e-3 * abs(expected[0])
    assert abs(abs(third[0]) - abs(expected[1])) < 2e-3 * abs(expected[0])


def test_loads_are_the_sum_of_weighted_harmonics():
    rng = np.random.default_rng(3)
    (table,) = THINNED.responses(np.array([7.0]), 0.1)
    # From below the smallest amplitude of the table to its end.
    amplitude = np.concatenate([[1e-8, 1e-6, 0.1], 10.0 ** rng.uniform(-6.0, -1.0, 200)])
    weights = rng.standard_normal(203) + 1j * rng.standard_normal(203)
    table = replace(table, beside=0.2 + 0.1j)
    assert table.loaded(table.loads(amplitude, weights)) == pytest.approx(
        complex(weights @ table.first(amplitude)), rel=1e-12
    )


def test_without_amplitude_the_response_is_that_of_the_branches() -> None:
    for frequency in (0.1, 1.0, 30.0):
        found = THINNED.responses(np.array([frequency]), 0.1, third=True)[0]
        first, third = found.first(np.array([1e-9])), found.third(np.array([1e-9]))
        exact = modulus(np.array([frequency]), THINNED.branches())
        assert_allclose(first, exact, rtol=2e-3)
        assert abs(third[0]) < 1e-2


def bushing(
    mode: str,
    q: float = 0.0,
    across: int = 4,
    inner: float = 12.0,
    thinned: ThinnedSpectrum = THINNED,
    see: Callable[[VectorBasis, UnevenModel], None] = lambda _basis, _model: None,
) -> None:
    shape = shapes()["plain"].model_validate({"inner_radius": inner, "outer_radius": 22.0, "length": 40.0})
    refinement = Refinement(across, 8, 8)
    model = prepare(shape, modes()[mode], Rubber(law("neo_hookean"), {"C10": MU / 2}), refinement)
    seen = []

    def observe(solver: Equilibrium) -> None:
        if solver.q == q and not seen:
            basis = basis_for(
                Pencil(model, solver, {}), sweep(np.array([1.0, 100.0]), thinned.branches()), DENSITY, 1e-5
            )
            seen.append(basis)
            see(basis, UnevenModel(basis, thinned, (), 0, transfer=True))

    march(model, Program(np.linspace(0.0, q, 5) if q else np.zeros(1)), observer=observe)
    assert seen


@pytest.mark.parametrize("mode", ["axial", "radial"])
def test_a_small_amplitude_has_the_linear_stiffness(mode: str) -> None:
    def see(basis: VectorBasis, model: UnevenModel) -> None:
        f = np.array([1.0, 100.0])
        found, third = model.stiffness(np.full(2, 1e-6), f)
        exact = basis.reduced_pencil().stiffness(sweep(f, THINNED.branches()))[1][:, 0, 0]
        assert_allclose(found, exact, rtol=2e-3)
        assert (third < 1e-2).all()

    bushing(mode, see=see)


def test_a_thin_layer_has_one_local_amplitude() -> None:
    # Sheared about its axis a thin ring has nearly one strain: K* is that of the law times a number.
    def see(_basis: VectorBasis, model: UnevenModel) -> None:
        angle, f = 0.004, 5.0
        gamma = angle * 21.75 / 0.5
        found, _ = model.stiffness(np.array([angle, 1e-7]), np.array([f, f]))
        at, still = THINNED.harmonics(np.array([gamma, 1e-9]), f)[0]
        ratio = (MU + at) / (MU + still)
        assert abs(found[0] / found[1] / ratio - 1.0) < 5e-3

    bushing("torsional", inner=21.5, see=see)


@pytest.mark.parametrize(("mode", "q"), [("axial", 0.0), ("radial", 2.0)])
def test_vectors_are_added_until_the_balance_is_that_of_the_whole_body(mode: str, q: float) -> None:
    def see(_basis: VectorBasis, model: UnevenModel) -> None:
        change = model.enrich(0.5, 1.0)
        assert change < 5e-4
        coarse = model.stiffness(np.array([0.5]), np.array([1.0]))[0]
        for _ in range(4):
            model.enrich(0.5, 1.0)
        assert_allclose(model.stiffness(np.array([0.5]), np.array([1.0]))[0], coarse, rtol=5e-4)

    bushing(mode, q, see=see)


def test_constants_are_found_from_a_noisy_sweep() -> None:
    truth = {"tau": 500.0, "decades": 4.5, "slope": -0.2, "path": 2e4, "offset": 0.05, "exponent": 1.8}
    moduli, times = spectrum(0.92, truth["tau"], truth["decades"], truth["slope"])
    thinned = ThinnedSpectrum(moduli, times, truth["path"], truth["offset"], truth["exponent"])
    strain = np.geomspace(1e-4, 0.2, 25)
    exact = 2.0 * (1.0 + thinned.harmonics(np.sqrt(3.0) * strain, 1.0)[0])
    noise = 1.0 + 0.005 * np.random.default_rng(1).standard_normal((2, len(strain)))
    nothing = np.full(len(strain), np.nan)
    table = DynamicTable(
        "sweep",
        "uniaxial",
        "E",
        frequency=np.ones(len(strain)),
        amplitude=strain,
        storage=exact.real * noise[0],
        loss=exact.imag * noise[1],
        **dict.fromkeys(
            ("preload", "preload_force", "temperature", "storage_error", "loss_error", "third_harmonic"),
            nothing,
        ),
    )
    found = fit_thinned(table, float(np.sqrt(3.0)))
    assert max(found.storage_percent, found.loss_percent) < 0.7
    again = found.at(strain, np.ones(len(strain)))
    assert_allclose(again, exact, rtol=5e-3)
    # One frequency leaves spectrum and clock to each other; the modulus that amplitude takes away is certain.
    assert found.modulus == pytest.approx(8.0, rel=0.15)
