"""Extrapolation of equilibria along a path."""

from __future__ import annotations

import numpy as np
import pytest

from cases.predictor import RecentPoints

#: Displacements of three equilibria, the next one further on, and one on the way back.
NODES, AHEAD = (0.3, 0.7, 1.2), (1.9, 0.9)


def cubic(q):
    return np.array([1.0 - 2.0 * q + 0.5 * q**3, q**2 - 0.3 * q**3])


def rate(q):
    return np.array([-2.0 + 1.5 * q**2, 2.0 * q - 0.9 * q**2])


def known(drift, differentiated=True):
    """Points of a cubic path to which a drift with time is added, at a constant speed."""
    found = RecentPoints()
    for q in NODES:
        found.add(q, cubic(q) + drift * q)
        if differentiated:
            # The tangent does not know of the drift.
            found.take_rate(rate(q))
    return found


@pytest.mark.parametrize("q", AHEAD)
@pytest.mark.parametrize("drift", [0.0, 0.4])
def test_with_rates_a_cubic_is_continued_exactly_whatever_drifts(q, drift):
    assert known(drift).extrapolate(q) == pytest.approx(cubic(q) + drift * q, rel=1e-12)


@pytest.mark.parametrize("q", AHEAD)
def test_without_them_it_is_not(q):
    assert known(0.0, differentiated=False).extrapolate(q) != pytest.approx(cubic(q), rel=1e-3)


def test_rates_are_used_only_where_all_are_known():
    found = known(0.0)
    found.add(1.9, cubic(1.9))
    plain = known(0.0, differentiated=False)
    plain.add(1.9, cubic(1.9))
    np.testing.assert_array_equal(found.extrapolate(2.5), plain.extrapolate(2.5))
    found.forget()
    assert found.q == [1.9]
    assert found.rates == [None]
