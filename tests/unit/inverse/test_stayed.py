"""A search that ends where it began is an alarm only where a step would have lowered the misfit."""

from types import SimpleNamespace

import numpy as np

from bushcli.inverse.local import Minimum, minimise
from bushcli.inverse.verdict import _Doubts

TASK = SimpleNamespace(source="recordings")


def poor(iterations=1):
    curve = SimpleNamespace(held_out=False, rms_percent=20.0, noise_percent=0.1)
    return SimpleNamespace(iterations=iterations, curves=(curve,))


def test_a_law_that_is_solved_exactly_at_its_start_is_no_alarm(linear):
    problem = linear()
    exact = problem.minimum()[0]
    found = minimise(problem, exact)
    np.testing.assert_allclose(found.x, exact, rtol=1e-6)
    assert found.stationary
    assert list(_Doubts(poor(), TASK, found).start()) == []


def test_a_search_that_leaves_its_start_is_not_stationary(linear):
    found = minimise(linear(), np.array([1.0, 1.0]))
    assert not found.stationary


def test_a_search_that_could_not_leave_a_bad_start_is_an_alarm(linear):
    start = np.array([1.0, 1.0])
    found = minimise(linear(wall=lambda x: bool(np.abs(x - start).max() > 1e-9)), start)
    assert not found.stationary
    (condition,) = _Doubts(poor(), TASK, found).start()
    assert condition.name == "start_not_left"


def test_what_does_not_say_that_it_is_stationary_is_an_alarm():
    x = np.array([1.0])
    (condition,) = _Doubts(poor(), TASK, Minimum(x, x, 1.0, 0, False, "")).start()
    assert condition.name == "start_not_left"
