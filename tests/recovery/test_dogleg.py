"""The literature's loop, a baseline: it works from a good start, and has neither bounds nor a remedy for failures."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.inverse import Task, identify
from bushcli.inverse.dogleg import REJECTIONS, minimise_by_dogleg


def values(fit):
    return {name: estimate.value for name, estimate in fit.parameters.items()}


class Quadratic:
    """A misfit that is linear in two parameters, with its minimum wherever it is put."""

    def __init__(self, minimum, failing=lambda x: False):
        self.minimum, self.failing, self.asked = np.array(minimum), failing, 0
        self.rows = np.array([[1.0, 0.2], [0.1, 2.0], [0.3, -0.4]])

    def residual(self, x):
        self.asked += 1
        return np.full(3, np.nan) if self.failing(x) else self.rows @ (x - self.minimum)

    def cost(self, x):
        return float(np.sum(self.residual(x) ** 2))


def test_finds_the_minimum_of_a_quadratic():
    found = minimise_by_dogleg(Quadratic([0.8, -0.3]), np.array([0.5, -0.05]))
    assert found.converged
    assert found.x == pytest.approx([0.8, -0.3], abs=1e-6)


def test_knows_no_bounds():
    """C10 below zero is no rubber (its lower bound is 1e-6 MPa): the baseline goes there, as reported of it."""
    found = minimise_by_dogleg(Quadratic([-0.4, 3.0]), np.array([0.5, -0.05]))
    assert found.x[0] == pytest.approx(-0.4, abs=1e-6)


def test_ends_after_rejections_in_a_row():
    start = np.array([0.5, 0.0])
    found = minimise_by_dogleg(Quadratic([2.0, 1.0], lambda x: np.linalg.norm(x - start) > 1.5e-3), start)
    assert not found.converged
    assert found.message == f"{REJECTIONS} rejected steps in a row"
    assert np.array_equal(found.x, start)


def test_ends_where_a_difference_cannot_be_solved():
    found = minimise_by_dogleg(Quadratic([2.0, 1.0], lambda x: x[1] > 0.0), np.array([0.5, 0.0]))
    assert "finite difference" in found.message
    assert not found.converged


def test_recovers_from_a_friendly_start_at_a_higher_price(experiment):
    case = experiment("axial")
    start = {"C10": 0.4, "C20": -0.03, "C30": 0.005}
    best = identify(Task(case, "yeoh", start=start))
    found = identify(Task(case, "yeoh", start=start, method="dogleg"))
    # Its differences use a step of 1e-3 MPa, a seventh of C30; measured agreement 3e-5.
    assert values(found) == pytest.approx(values(best), rel=1e-3)
    # Four simulations per iteration against one; measured: 21 against 6.
    assert found.forward_solves > 2 * best.forward_solves


@pytest.mark.slow
def test_from_a_poor_start_it_ends_where_the_bounded_search_does_not(experiment):
    """From ten times too stiff the baseline may end with any values for any reason, but it must report the failure."""
    case = experiment("axial")
    start = {"C10": 5.0, "C20": -0.4, "C30": 0.07}
    best = identify(Task(case, "yeoh", start=start))
    found = identify(Task(case, "yeoh", start=start, method="dogleg"))
    assert best.converged
    assert found.message
    assert found.cost >= best.cost * (1 - 1e-6)
    assert found.converged or "not_converged" in {condition.name for condition in found.conditions}
