"""Start points: reproducible, inside their box, and the best of those screened."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.starts import SCREENED, SPREAD, box, from_unit, hypercube, screen_starts

LOWER, UPPER = np.array([1e-6, -1e2, -1e2]), np.array([1e3, 1e2, 1e2])
BOUNDS = Bounds(LOWER, UPPER)
START = np.array([0.5, -0.05, 0.0])


def test_box_is_a_factor_about_the_start_and_both_signs_where_allowed():
    low, high = box(START, BOUNDS, shear=1.0)
    assert low[0] == pytest.approx(0.5 / SPREAD)
    assert high[0] == pytest.approx(0.5 * SPREAD)
    assert (low[1], high[1]) == pytest.approx((-0.05 * SPREAD, 0.05 * SPREAD))
    # A start of zero says nothing: a hundredth of the shear modulus is the scale.
    assert (low[2], high[2]) == pytest.approx((-0.01 * SPREAD, 0.01 * SPREAD))


def test_box_keeps_the_bounds():
    low, high = box(np.array([200.0, 50.0]), Bounds(LOWER[:2], UPPER[:2]), shear=400.0)
    assert (low >= LOWER[:2]).all()
    assert (high <= UPPER[:2]).all()


def test_hypercube_has_one_point_in_every_slice():
    low, high = box(START, BOUNDS, shear=1.0)
    points = hypercube(16, low, high, seed=3)
    assert points.shape == (16, 3)
    assert ((points >= low) & (points <= high)).all()
    unit = np.column_stack(
        [
            np.log(points[:, 0] / low[0]) / np.log(high[0] / low[0]),
            *((points[:, k] - low[k]) / (high[k] - low[k]) for k in (1, 2)),
        ]
    )
    for column in unit.T:
        assert sorted(np.floor(16 * column).astype(int)) == list(range(16))


def test_hypercube_is_reproduced_by_its_seed():
    low, high = box(START, BOUNDS, shear=1.0)
    assert np.array_equal(hypercube(8, low, high, 5), hypercube(8, low, high, 5))
    assert not np.array_equal(hypercube(8, low, high, 5), hypercube(8, low, high, 6))


def test_positive_parameters_are_spread_in_their_logarithm():
    assert from_unit(np.array([0.5, 0.5]), np.array([0.01, -1.0]), np.array([100.0, 3.0])) == pytest.approx(
        [1.0, 1.0]
    )


def test_screening_keeps_the_best_that_can_be_solved():
    seen = []

    def costs(points):
        seen.extend(points)
        return [float("nan") if x[0] > 3.0 else abs(x[0] - 1.0) for x in points]

    low, high = np.array([0.1]), np.array([10.0])
    found = screen_starts(costs, 2, low, high, seed=0)
    assert len(seen) == 2 * SCREENED
    good = sorted(abs(x[0] - 1.0) for x in seen if x[0] <= 3.0)
    assert [abs(x[0] - 1.0) for x in found] == good[:2]


def test_a_start_on_a_bound_is_moved_off_it_by_a_hair():
    for edge in (LOWER, UPPER):
        moved = BOUNDS.inside(edge)
        assert ((moved > LOWER) & (moved < UPPER)).all()
        assert moved == pytest.approx(edge, rel=1e-5, abs=1e-6)
    assert np.array_equal(BOUNDS.inside(START), START)
