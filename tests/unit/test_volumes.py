"""The energy of volumes that the pressures of tetrahedra do not prescribe: where it acts, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from cases.elements import guarded
from cases.kernels import kernel
from cases.mode import modes
from cases.simulate import prepare
from forms import answers
from forms.setting import SETTINGS
from forms.volumetric import FREE, GUARD
from geometry.shape import shapes

SOLID = SETTINGS["cartesian"]
SHEAR = 1.3


def answered(J, modulus=SHEAR, guard=True, share=1.0):
    """[W, W_J] at volume ratios J (n,), without pressure and compliance, at a swelling of 1.02."""
    strain = np.zeros((len(J), 8))
    strain[:, 0] = J
    parameters = np.array([0.0, 1.02, modulus] if guard else [0.0, 1.02])
    inputs = {"strain": strain, "parameters": parameters, "guard": np.full((len(J), 1), share)}
    rows = kernel(answers.volumetric_answer(SOLID, True, guard))(len(J), inputs)
    # Energy, its slope, and its curvature by J, which is the first strain variable of eight.
    return rows[:, [0, 1, 9]].T


def test_it_is_zero_where_volumes_hardly_change():
    """The stress-free volume is that of the swollen rubber."""
    J = 1.02 * np.exp(np.linspace(-0.99 * FREE, 0.99 * FREE, 7))
    assert np.all(answered(J) == answered(J, guard=False))


def test_points_may_be_left_out():
    J = np.array([0.5, 1.02, 1.6])
    assert np.all(answered(J, share=0.0) == answered(J, guard=False))


@pytest.mark.parametrize("log", [-1.5, -0.4, 0.3])
def test_its_value_and_derivatives(log):
    J, step = 1.02 * np.exp(log), 1e-6
    energy, slope, curvature = answered(np.array([J - step, J, J + step]))
    assert energy[1] == pytest.approx(GUARD * SHEAR / 3 * (abs(log) - FREE) ** 3, rel=1e-12)
    assert slope[1] == pytest.approx((energy[2] - energy[0]) / (2 * step), rel=1e-7)
    assert curvature[1] == pytest.approx((slope[2] - slope[0]) / (2 * step), rel=1e-7)
    assert np.sign(slope[1]) == np.sign(log)


def test_its_derivatives_by_parameters():
    """By compliance, swelling and shear modulus; the energy is proportional to the last."""
    strain, parameters, step = np.array([[0.6, *[0.0] * 6, 0.2]]), np.array([1e-3, 1.02, SHEAR]), 1e-6
    inputs = {"strain": strain, "parameters": parameters, "guard": np.ones((1, 1))}
    rows = kernel(answers.volumetric_slopes(SOLID, True))(1, inputs).reshape(3, -1)
    stress = kernel(answers.volumetric_answer(SOLID, False, True))
    for change, row in zip(np.diag(step * np.ones(3)), rows, strict=True):
        ends = [stress(1, inputs | {"parameters": parameters + sign * change})[0] for sign in (1.0, -1.0)]
        np.testing.assert_allclose(row, (ends[0] - ends[1]) / (2 * step), rtol=1e-6, atol=1e-7)
    assert rows[2, 0] == pytest.approx(answered(np.array([0.6]))[0, 0] / SHEAR, rel=1e-12)


def test_hexahedra_and_the_half_plane_have_none(rubber):
    """Their volumetric part has two parameters; their pressures prescribe the volume of nearly each cell."""
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    for mode in ("axial", "radial"):
        model = prepare(shape, modes()[mode], rubber("yeoh"))
        assert not guarded(model.mesh)
        assert len(model.parameters.numbers().volumetric) == 2
