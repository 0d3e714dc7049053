"""Stability of laws, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from cases.stability import coupon_limits, moduli, nominal_stress, stable
from forms.law import UnknownName, law

YEOH = {"C10": 0.5, "C20": -0.05, "C30": 0.01}


def test_moduli_at_rest_are_those_of_the_shear_modulus():
    # W = mu (e1^2 + e2^2 + (e1 + e2)^2) to second order, mu = 2 C10 = 1 MPa.
    H = moduli(law("yeoh"), YEOH, [(1.0, 1.0, 1.0), (2.0, 2.0, 2.0)])
    np.testing.assert_allclose(H, np.array([[[4, 2], [2, 4]]] * 2), rtol=1e-12)


def test_moduli_of_neo_hookean_in_closed_form():
    stretches = np.array([(2.0, 0.8, 0.9), (0.5, 1.4, 1.1)])
    b = (stretches / np.prod(stretches, axis=1, keepdims=True) ** (1 / 3)) ** 2
    expected = 4 * 0.7 * np.array([[[x + z, z], [z, y + z]] for x, y, z in b])  # W = 0.7 sum exp(2 e_i)
    np.testing.assert_allclose(moduli(law("neo_hookean"), {"C10": 0.7}, stretches), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("neo_hookean", {"C10": 0.5}),
        ("mooney_rivlin", {"C10": 0.4, "C01": 0.1}),
        ("arruda_boyce", {"mu": 1.0, "lambda_m": 3.0}),
        # Ogden (1972) for Treloar's rubber: mu_i alpha_i > 0 in every term suffices.
        ("ogden", {"mu1": 0.63, "alpha1": 1.3, "mu2": 0.0012, "alpha2": 5.0, "mu3": -0.01, "alpha3": -2.0}),
    ],
)
def test_laws_that_are_stable_everywhere(name, parameters):
    for low, high in coupon_limits(law(name), parameters).values():
        assert low == 0
        assert high == np.inf


def test_mooney_rivlin_with_a_negative_coefficient_loses_stability_in_compression():
    """Uniaxial: the Hessian is singular along and across the path; both conditions are solved in closed form.

    With a = C10, b = C01 and x = stretch: in (e1, e2) the Hessian is 4 [[A + D, D], [D, B + D]] with
    A = a x^2 + b x^-2 and B = D = a x^-1 + b x, so it is positive definite while D > 0 and 2 A + D > 0.
    """
    a, b = 0.5, -0.05
    low, high = coupon_limits(law("mooney_rivlin"), {"C10": a, "C01": b}, ("uniaxial",))["uniaxial"]
    # D > 0 until x^2 = -a / b in tension; in compression 2 A + D first vanishes.
    assert high == pytest.approx(np.sqrt(a / -b), abs=1e-4)
    roots = np.roots([2 * a, b, 0, a, 2 * b])  # x^2 (2 A + D) = 2 a x^4 + b x^3 + a x + 2 b
    real = roots[np.isreal(roots)].real
    assert low == pytest.approx(real[(real > 0) & (real < 1)].max(), abs=1e-4)


def test_gent_ends_at_its_locking_stretch():
    limits = coupon_limits(law("gent"), {"mu": 1.0, "Jm": 10.0})
    x = limits["uniaxial"][1]
    assert x**2 + 2 / x - 3 == pytest.approx(10.0, abs=1e-3)


def test_not_stable_even_at_rest():
    assert coupon_limits(law("neo_hookean"), {"C10": -0.1}, ("planar",)) == {"planar": (1.0, 1.0)}
    assert not stable(law("gent"), {"mu": 1.0, "Jm": 1.0}, [(5.0, 1.0, 0.2)]).any()


def test_any_number_of_states():
    stretches = np.exp(np.random.default_rng(0).uniform(-0.4, 0.4, (1300, 3)))
    whole = moduli(law("yeoh"), YEOH, stretches)
    assert whole.shape == (1300, 2, 2)
    np.testing.assert_array_equal(whole[700:701], moduli(law("yeoh"), YEOH, stretches[700:701]))
    assert moduli(law("yeoh"), YEOH, np.empty((0, 3))).shape == (0, 2, 2)


def test_limit_agrees_with_the_slope_of_the_stress():
    """The law loses its stability where the uniaxial Cauchy stress stops rising, or before."""
    parameters = {"C10": 0.5, "C20": -0.08, "C30": 0.002}
    high = coupon_limits(law("yeoh"), parameters, ("uniaxial",))["uniaxial"][1]
    x = np.linspace(1, 3, 20001)
    cauchy = x * nominal_stress(law("yeoh"), parameters, "uniaxial", x)
    peak = x[np.argmax(np.diff(cauchy) <= 0)]
    assert 1 < high <= peak + 1e-3


def test_unknown_mode_is_refused():
    with pytest.raises(UnknownName, match="uniaxial"):
        nominal_stress(law("yeoh"), YEOH, "uniaxal", [1.1])
