"""Extrapolation of the rates along a path."""

from __future__ import annotations

import numpy as np
import pytest

from cases.rates import Rates

ZERO = np.zeros(2)


def test_a_cubic_is_extrapolated():
    rates = Rates()
    for q in (0.0, 1.0, 2.0, 3.0, 4.0):
        rates.add(q, np.array([q**3, 1.0]))
    np.testing.assert_allclose(rates.guess(5.0, ZERO), [125.0, 1.0])


@pytest.mark.parametrize("noise", [4.4e-16, 1e-13, 0.0])
def test_a_hold_whose_displacements_differ_by_rounding_makes_no_wild_polynomial(noise):
    """The rates of rubber that remembers differ in a hold; the guess stays within their range, some times over."""
    rates = Rates()
    for number in range(4):
        rates.add(2.0 + noise * number, np.array([1.0 + 0.01 * number, 1.0]))
    assert np.abs(rates.guess(1.9, ZERO)).max() < 1.1


def test_without_any_rate_the_guess_is_the_sleeves_motion():
    given = np.array([0.5, 1.0])
    found = Rates().guess(1.0, given)
    np.testing.assert_array_equal(found, given)
    assert found is not given
