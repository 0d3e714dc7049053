"""The axisymmetric rubber mount of "Getting Started with Abaqus", with the element and mesh of the guide.

Dassault Systemes, Getting Started with Abaqus: Interactive Edition, "Example: axisymmetric mount": rubber from r = 10
to 60 mm, 25 mm from the mid-plane to a steel plate, its outside an arc about r = 100 mm in the mid-plane; 0.5 MPa on
the plate (5.5 kN) compress it. Material by three coupon tests, fitted by the polynomial of second order. Reported: the
stiffness rises by almost 100 %, the largest tensile nominal strain is about 100 %, the largest compressive one 56 %.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import ramp
from cases.simulate import Rubber, prepare
from cases.stretches import principal_stretches
from forms.law import Law, Parameter
from geometry.shape import Refinement, shapes

# Nominal stress (MPa), nominal strain: the guide's table.
COUPONS = {
    "uniaxial": [
        (0.054, 0.0380),
        (0.152, 0.1338),
        (0.254, 0.2210),
        (0.362, 0.3450),
        (0.459, 0.4600),
        (0.583, 0.6242),
        (0.656, 0.8510),
        (0.730, 1.4268),
    ],
    "equibiaxial": [
        (0.089, 0.0200),
        (0.255, 0.1400),
        (0.503, 0.4200),
        (0.958, 1.4900),
        (1.703, 2.7500),
        (2.413, 3.4500),
    ],
    "planar": [(0.055, 0.0690), (0.324, 0.2828), (0.758, 1.3862), (1.269, 3.0345), (1.779, 4.0621)],
}
LOAD = 5500.0
# Nodes of the guide: 30 elements across the rubber, 14 on half its height.
ACROSS, ALONG = 28, 30


def _polynomial_energy(strain, *, C10, C01, C20, C11, C02):
    a, b = strain.I1 - 3, strain.I2 - 3
    return C10 * a + C01 * b + C20 * a * a + C11 * a * b + C02 * b * b


POLYNOMIAL = Law(
    name="polynomial",
    summary="polynomial of second order in I1 and I2, as in the guide",
    parameters=tuple(Parameter(n, "MPa", n, 0.1, -10.0, 10.0) for n in ("C10", "C01", "C20", "C11", "C02")),
    energy=_polynomial_energy,
    shear_modulus=lambda C10, C01, **_: 2 * (C10 + C01),
    basis="I1,I2",
    linear=("C10", "C01", "C20", "C11", "C02"),
    source="Rivlin and Saunders (1951), doi:10.1098/rsta.1951.0004",
)


def _basis(mode, x):
    """Nominal stress per coefficient C10, C01, C20, C11, C02 at stretch x (incompressible, on paper)."""
    a, b = {
        "uniaxial": (x**2 + 2 / x - 3, x**-2 + 2 * x - 3),
        "equibiaxial": (2 * x**2 + x**-4 - 3, 2 * x**-2 + x**4 - 3),
        "planar": (x**2 + x**-2 - 2, x**2 + x**-2 - 2),
    }[mode]
    da, db = {
        "uniaxial": (2 * x - 2 / x**2, 2 - 2 / x**3),
        "equibiaxial": (2 * x - 2 / x**5, 2 * x**3 - 2 / x**3),
        "planar": (2 * x - 2 / x**3, 2 * x - 2 / x**3),
    }[mode]
    return np.stack([da, db, 2 * a * da, b * da + a * db, 2 * b * db], axis=-1)


def _fit():
    """Least squares of the relative error of the stress, as Abaqus does it; linear in the coefficients."""
    rows = [_basis(mode, 1 + e) / s for mode, points in COUPONS.items() for s, e in points]
    found = np.linalg.lstsq(np.array(rows), np.ones(len(rows)), rcond=None)[0]
    return dict(zip(POLYNOMIAL.linear, found, strict=True))


def _mount(order):
    class Bilinear(shapes()["mount"]):
        displacement_order: ClassVar[int] = order

    # The arc about r = 100 mm through the rim at 60 mm, 25 mm off the mid-plane.
    return Bilinear(inner_radius=10.0, outer_radius=60.0, height=50.0, waist_depth=np.hypot(40, 25) - 40)


@pytest.fixture(scope="module")
def guide():
    """Return the model with the guide's element (bilinear, one pressure each) and its march."""
    rubber = Rubber(POLYNOMIAL, _fit())
    model = prepare(_mount(1), modes()["axial"], rubber, Refinement(across=ACROSS, along=ALONG))
    return model, march(model, ramp(-11.0, 44), keep_states=True)


def _at_load(history):
    """Compression (mm) under the load."""
    return float(np.interp(LOAD, -history.force, -history.displacement))


def test_stiffness_rises_by_almost_a_hundred_percent(guide):
    _, history = guide
    stiffness = np.gradient(history.force, history.displacement)
    rise = np.interp(_at_load(history), -history.displacement, stiffness) / stiffness[0] - 1
    assert 0.8 < rise < 1.0


def test_largest_nominal_strains(guide):
    """Extrapolated from the 2 x 2 integration points to the corners, as the guide's plots are.

    The strain is singular where the flank meets the plate, so the numbers belong to this mesh. In compression the
    reported one lies between integration points and corners: the guide does not say how its plot averages.
    """
    model, history = guide
    model.state.x.array[:] = history.states[np.searchsorted(-history.displacement, _at_load(history))]
    gauss = np.array([[(1 + i / np.sqrt(3)) / 2, (1 + j / np.sqrt(3)) / 2] for j in (-1, 1) for i in (-1, 1)])
    strain = principal_stretches(model, gauss) - 1
    line = np.array([[1 + np.sqrt(3), 1 - np.sqrt(3)], [1 - np.sqrt(3), 1 + np.sqrt(3)]]) / 2
    corners = np.einsum("pg,cgk->cpk", np.kron(line, line), strain)
    assert -strain.min() < 0.56 < -corners.min()
    assert corners.max() == pytest.approx(1.0, abs=0.1)  # "about 100 %"


def test_default_mesh_has_the_same_curve(guide):
    model = prepare(_mount(2), modes()["axial"], Rubber(POLYNOMIAL, _fit()))
    history = march(model, ramp(-11.0, 11))
    np.testing.assert_allclose(history.force[1:], guide[1].force[4::4], rtol=0.01)
