"""Energies of volumes that the pressures do not prescribe: where they act, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from cases.kernels import kernel
from cases.mode import modes
from cases.simulate import prepare
from forms import answers
from forms.setting import SETTINGS
from forms.volumetric import FREE, GUARD, STABLE
from geometry.shape import Refinement, shapes

SOLID = SETTINGS["cartesian"]
SHEAR = 1.3
BOTH, STABILISING, FOLDING, NEITHER = (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)


def answered(J, guard=FOLDING, C=(0.0,) * 6, p=0.0, compliance=0.0):
    """[W, W_J] at volume ratios J (n,) at a swelling of 1.02."""
    strain = np.zeros((len(J), 8))
    strain[:, 0], strain[:, 1:7], strain[:, 7] = J, C, p
    inputs = {
        "strain": strain,
        "parameters": np.array([compliance, 1.02, SHEAR]),
        "guard": np.tile(guard, (len(J), 1)),
    }
    rows = kernel(answers.volumetric_answer(SOLID, True))(len(J), inputs)
    # Energy, its slope, and its curvature by J, which is the first strain variable of eight.
    return rows[:, [0, 1, 9]].T


def test_that_of_folds_is_zero_where_volumes_hardly_change():
    """The stress-free volume is that of the swollen rubber."""
    J = 1.02 * np.exp(np.linspace(-0.99 * FREE, 0.99 * FREE, 7))
    assert np.all(answered(J) == answered(J, NEITHER))


@pytest.mark.parametrize("log", [-1.5, -0.4, 0.3])
def test_the_value_and_derivatives_of_that_of_folds(log):
    J, step = 1.02 * np.exp(log), 1e-6
    energy, slope, curvature = answered(np.array([J - step, J, J + step]))
    assert energy[1] == pytest.approx(GUARD * SHEAR / 3 * (abs(log) - FREE) ** 3, rel=1e-12)
    assert slope[1] == pytest.approx((energy[2] - energy[0]) / (2 * step), rel=1e-7)
    assert curvature[1] == pytest.approx((slope[2] - slope[0]) / (2 * step), rel=1e-7)
    assert np.sign(slope[1]) == np.sign(log)


def test_the_stabilising_energy_is_that_of_the_volume_beside_the_pressure():
    """It grows with the isochoric strain, and is zero without any, or where the pressure agrees with the volume."""
    C, J, p, compliance = np.array([1.6, 0.7, 1.1, 0.1, -0.2, 0.3]), np.array([1.1]), -2.0, 0.01
    added = answered(J, STABILISING, C, p, compliance)[0] - answered(J, NEITHER, C, p, compliance)[0]
    beside = 1.1 / 1.02 - 1.0 + 2.0 * compliance
    strain = 1.1 ** (-2 / 3) * (1.6 + 0.7 + 1.1) - 3.0
    assert added == pytest.approx(STABLE * SHEAR / 2 * strain * beside**2, rel=1e-10)
    at_rest = np.array([1.1 ** (2 / 3)] * 3 + [0.0] * 3)
    for given in ((J, at_rest, p), (J, C, (1.1 / 1.02 - 1.0) / compliance)):
        alone, with_it = (
            answered(given[0], which, *given[1:], compliance) for which in (NEITHER, STABILISING)
        )
        assert with_it[0] == pytest.approx(alone[0], rel=1e-12)


@pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS)
def test_derivatives_by_strains_and_parameters(setting):
    """By compliance, swelling and shear modulus, and by each strain variable and the pressure."""
    n, step = len(setting.names) + 1, 1e-6
    strain = np.full((1, n), 0.1)
    strain[0, :4] = 0.7, 1.4, 0.8, 1.1
    inputs = {"strain": strain, "parameters": np.array([1e-2, 1.02, SHEAR]), "guard": np.array([BOTH])}
    moduli = kernel(answers.volumetric_answer(setting, True))
    rows = kernel(answers.volumetric_slopes(setting))(1, inputs).reshape(3, -1)

    def difference(name, change):
        ends = [moduli(1, inputs | {name: inputs[name] + sign * change})[0] for sign in (1.0, -1.0)]
        return (ends[0] - ends[1]) / (2 * step)

    for change, row in zip(np.diag(step * np.ones(3)), rows, strict=True):
        np.testing.assert_allclose(row, difference("parameters", change)[: 1 + n], rtol=1e-5, atol=1e-7)
    found = moduli(1, inputs)[0]
    curvature = np.zeros((n, n))
    curvature[np.triu_indices(n)] = found[1 + n :]
    curvature = np.triu(curvature) + np.triu(curvature, 1).T
    for a, change in enumerate(np.diag(step * np.ones(n))):
        slope = difference("strain", change)
        assert found[1 + a] == pytest.approx(slope[0], rel=1e-6, abs=1e-7)
        np.testing.assert_allclose(curvature[a], slope[1 : 1 + n], rtol=1e-5, atol=1e-6)


def test_cells_on_bonds_have_neither_and_hexahedra_and_the_half_plane_only_the_first(rubber):
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    for mode in ("axial", "torsional", "radial"):
        model = prepare(shape, modes()[mode], rubber("yeoh"), Refinement(across=3))
        which = model._guard(len(model.cells("rubber")))
        assert not which[:, 1].any()
        # The middle one of three cells from bond to bond.
        assert which[:, 0].mean() == pytest.approx(1 / 3)
