"""Harmonic balance of a bushing whose rubber amplitude thins, against two and a half periods of its march in time."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.effects.effect import effect
from cases.dynamic.amplitude import UnevenModel
from cases.dynamic.model import sweep
from cases.dynamic.pencil import Pencil
from cases.dynamic.reduction import basis_for
from cases.equilibrium import Equilibrium
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, shapes

PAYNE = {
    "g": 0.45, "tau": 30.0, "decades": 3.5, "slope": 0.1, "path": 2000.0, "offset": 0.01, "exponent": 0.9
}  # fmt: skip
PERIODS, SAMPLES = 2.5, 60


@pytest.mark.parametrize(
    ("mode", "amplitude", "frequency"),
    [("axial", 0.1, 1.0), ("axial", 1.0, 0.1), pytest.param("radial", 0.1, 1.0, marks=pytest.mark.slow)],
)
def test_harmonic_balance_is_the_march_along_time(mode: str, amplitude: float, frequency: float) -> None:
    shape = shapes()["plain"].model_validate({"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0})
    rubber, mesh = Rubber(law("neo_hookean"), {"C10": 0.5}), Refinement(2, 4, 8)
    feature = effect("payne").feature()
    thinned = feature.thinned(PAYNE)
    balanced = []

    def observe(solver: Equilibrium) -> None:
        points = sweep(np.array([frequency]), thinned.branches())
        basis = basis_for(Pencil(solver.model, solver, {}), points, 0.0, 1e-5)
        uneven = UnevenModel(basis, thinned, (), 0, transfer=True)
        uneven.enrich(amplitude, frequency)
        balanced.append(uneven.stiffness(np.array([amplitude]), np.array([frequency])))

    march(prepare(shape, modes()[mode], rubber, mesh), Program(np.zeros(1)), observer=observe)
    (balance,), (third,) = balanced[0]
    model = prepare(shape, modes()[mode], rubber, mesh, features=[Installed("payne", feature, PAYNE)])
    time = np.linspace(0.0, PERIODS / frequency, int(PERIODS * SAMPLES) + 1)
    turn = 2.0 * np.pi * frequency * time
    force = march(model, Program(amplitude * np.sin(turn), time)).force[-SAMPLES:]
    harmonics = [2.0 / SAMPLES * np.sum(force * np.exp(-1j * n * turn[-SAMPLES:])) for n in (1, 3)]
    along_time = 1j * harmonics[0] / amplitude
    assert abs(balance / along_time - 1.0) < 1.5e-3
    assert abs(np.degrees(np.angle(balance / along_time))) < 0.05
    assert abs(third - abs(harmonics[1]) / abs(harmonics[0])) < 1e-3
