"""Finite-element coupons against the stresses that follow from the energy on paper, for every law."""

from __future__ import annotations

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare, sweep
from cases.stability import nominal_stress
from forms.law import laws
from geometry.shape import shapes

# Compression to 60 %, tension to 200 %.
STRAIN = np.array([-0.4, -0.2, -0.05, 0.05, 0.2, 0.5, 1.0])
KAPPA = 2000.0


def coupon(mode, rubber):
    return prepare(shapes()["coupon"](), modes()[mode], rubber)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "planar"])
@pytest.mark.parametrize("name", laws())
def test_stress_of_the_incompressible_coupon(name, mode, rubber):
    chosen = rubber(name, np.inf)
    history = sweep(coupon(mode, chosen), STRAIN, tolerance=1e-11)
    expected = nominal_stress(chosen.law, chosen.parameters, mode, 1 + history.displacement)
    mu = chosen.law.shear_modulus(**chosen.parameters)
    np.testing.assert_allclose(history.force, expected, rtol=1e-8, atol=1e-9 * mu)


@pytest.mark.parametrize("name", laws())
def test_volumetric_pressure_is_that_of_the_bulk_modulus_alone(name, rubber):
    q = np.array([-0.02, -0.01, 0.01, 0.02])
    history = march(coupon("volumetric", rubber(name, KAPPA)), Program(q))
    # Nominal stress on a face of (1 + q)^2: p = kappa (J - 1). The law adds nothing: its part keeps the volume.
    pressure = history.force / (1 + q) ** 2
    np.testing.assert_allclose(pressure, KAPPA * ((1 + q) ** 3 - 1), rtol=1e-9)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "planar"])
def test_compressible_neo_hookean_coupon_on_paper(mode, rubber):
    """mu = 1, kappa = 10 MPa: principal stresses of W = mu/2 (I1 J^(-2/3) - 3) + kappa/2 (J - 1)^2."""
    q, mu, kappa = 0.4, 1.0, 10.0
    history = march(coupon(mode, rubber("neo_hookean", kappa, C10=0.5 * mu)), Program(np.array([q])))

    def stresses(lateral):
        x = {
            "uniaxial": (1 + q, lateral, lateral),
            "equibiaxial": (1 + q, 1 + q, lateral),
            "planar": (1 + q, 1, lateral),
        }
        x = np.array(x[mode])
        J = np.prod(x)
        return (mu * J ** (-2 / 3) * (x**2 - np.sum(x**2) / 3) + kappa * (J - 1) * J) / x

    # The free direction carries nothing: bisection for its stretch.
    low, high = 0.3, 1.2
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stresses(middle)[-1] < 0 else (low, middle)
    assert history.force[0] == pytest.approx(stresses(low)[0], rel=1e-9)


@pytest.mark.parametrize("bulk_modulus", [np.inf, KAPPA])
def test_the_shear_stress_of_a_mooney_rivlin_rubber_is_linear(bulk_modulus, rubber):
    """tau = 2 (C10 + C01) gamma (Rivlin 1948, doi:10.1098/rsta.1948.0024), nearly so if compressible."""
    mooney = rubber("mooney_rivlin", bulk_modulus, C10=0.25, C01=0.1)
    gamma = np.linspace(0.0, 2.0, 9)
    history = march(coupon("simple_shear", mooney), Program(gamma))
    # The change of volume is of the order of the stress over the bulk modulus.
    tolerance = 1e-8 if np.isinf(bulk_modulus) else 1.0 / KAPPA
    np.testing.assert_allclose(history.force, 0.7 * gamma, rtol=tolerance, atol=1e-10)
