"""Coupon stresses of every law against the closed forms of the literature, written here in NumPy.

Incompressible, nominal stress P at stretch x (Treloar 1975, The Physics of Rubber Elasticity; Ogden 1997,
Non-Linear Elastic Deformations, section 7.2). With W1 = dW/dI1, W2 = dW/dI2:

    uniaxial     P = 2 (x - x^-2) (W1 + W2 / x)
    equibiaxial  P = 2 (x - x^-5) (W1 + x^2 W2)
    planar       P = 2 (x - x^-3) (W1 + W2)

and for Ogden's law P = sum_i mu_i (x^(a_i - 1) - x^(-c a_i - 1)), c = 1/2, 2 and 1.
"""

from __future__ import annotations

import numpy as np
import pytest

from cases.stability import nominal_stress
from forms.law import law, laws

STRETCH = np.array([0.35, 0.6, 0.9, 0.999, 1.001, 1.1, 1.7, 2.5, 4.0])
MODES = ("uniaxial", "equibiaxial", "planar")


def invariant_stress(mode, x, slopes):
    """Return P from slopes(I1, I2) = (W1, W2)."""
    if mode == "uniaxial":
        W1, W2 = slopes(x**2 + 2 / x, 2 * x + x**-2)
        return 2 * (x - x**-2) * (W1 + W2 / x)
    if mode == "equibiaxial":
        W1, W2 = slopes(2 * x**2 + x**-4, x**4 + 2 * x**-2)
        return 2 * (x - x**-5) * (W1 + x**2 * W2)
    W1, W2 = slopes(x**2 + 1 + x**-2, x**2 + 1 + x**-2)
    return 2 * (x - x**-3) * (W1 + W2)


def neo_hookean(mode, x, C10):
    return invariant_stress(mode, x, lambda I1, I2: (C10, 0))


def mooney_rivlin(mode, x, C10, C01):
    return invariant_stress(mode, x, lambda I1, I2: (C10, C01))


def yeoh(mode, x, C10, C20, C30):
    return invariant_stress(mode, x, lambda I1, I2: (C10 + 2 * C20 * (I1 - 3) + 3 * C30 * (I1 - 3) ** 2, 0))


def arruda_boyce(mode, x, mu, lambda_m):
    c = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)

    def slopes(I1, I2):
        return mu * sum(i * c[i - 1] * I1 ** (i - 1) / lambda_m ** (2 * i - 2) for i in range(1, 6)), 0

    return invariant_stress(mode, x, slopes)


def gent(mode, x, mu, Jm):
    return invariant_stress(mode, x, lambda I1, I2: (mu / 2 * Jm / (Jm - I1 + 3), 0))


def ogden(mode, x, **p):
    c = {"uniaxial": 0.5, "equibiaxial": 2.0, "planar": 1.0}[mode]
    terms = [(p[f"mu{i}"], p[f"alpha{i}"]) for i in (1, 2, 3) if f"mu{i}" in p]
    return sum(mu * (x ** (a - 1) - x ** (-c * a - 1)) for mu, a in terms)


CASES = [
    (neo_hookean, {"C10": 0.5}),
    (mooney_rivlin, {"C10": 0.4, "C01": 0.1}),
    (yeoh, {"C10": 0.5, "C20": -0.05, "C30": 0.01}),
    (arruda_boyce, {"mu": 1.0, "lambda_m": 3.0}),
    (gent, {"mu": 1.0, "Jm": 300.0}),  # not locked at the largest I1 here, 67.6
    (ogden, {"mu1": 0.7, "alpha1": 1.7}),
    (ogden, {"mu1": 0.6, "alpha1": 1.3, "mu2": -0.02, "alpha2": -2.0}),
    (ogden, {"mu1": 0.6, "alpha1": 1.3, "mu2": 0.005, "alpha2": 5.0, "mu3": -0.02, "alpha3": -2.0}),
]


def test_every_law_has_its_closed_form_here():
    assert {form.__name__ for form, _ in CASES} == set(laws())


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("form", "parameters"), CASES, ids=lambda x: getattr(x, "__name__", None))
def test_coupon_stress(form, parameters, mode):
    found = nominal_stress(law(form.__name__), parameters, mode, STRETCH)
    scale = law(form.__name__).shear_modulus(**parameters)
    # Relative to the stress, except near x = 1 where it is a difference: there, relative to mu.
    np.testing.assert_allclose(found, form(mode, STRETCH, **parameters), rtol=1e-12, atol=1e-14 * scale)


def test_ogden_contains_neo_hookean_and_mooney_rivlin():
    """alpha = 2 gives I1 - 3, alpha = -2 gives I2 - 3 (for J = 1)."""
    both = {"mu1": 0.8, "alpha1": 2.0, "mu2": -0.2, "alpha2": -2.0}
    for mode in MODES:
        expected = nominal_stress(law("mooney_rivlin"), {"C10": 0.4, "C01": 0.1}, mode, STRETCH)
        np.testing.assert_allclose(nominal_stress(law("ogden"), both, mode, STRETCH), expected, rtol=1e-12)
