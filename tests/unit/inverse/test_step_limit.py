"""How many failed steps a march is allowed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import ALLOWED, StepLimit
from bushcli.inverse.problem import LeastSquaresProblem, coupon_states
from forms.law import law

BOUNDS = Bounds(np.zeros(1), np.ones(1))


def march(failed):
    steps = [SimpleNamespace(accepted=i >= failed) for i in range(failed + 3)]
    return SimpleNamespace(attempts=steps)


def test_there_is_no_limit_before_a_march_has_reached_its_end():
    limit = StepLimit()
    assert limit.steps is None
    limit.learn(march(0))
    assert limit.steps == ALLOWED
    for failed in (2, 1):
        limit.learn(march(failed))
        assert limit.steps == ALLOWED + 2 * 2


def test_a_limit_that_was_given_stays():
    limit = StepLimit(1)
    limit.learn(march(4))
    assert limit.steps == 1


def test_a_search_begins_with_what_an_earlier_one_has_learnt_and_keeps_its_own_to_itself():
    def problem(*limits):
        channel = SimpleNamespace(coupon=True)
        states = coupon_states((0.8, 1.2))
        return LeastSquaresProblem(
            [channel],
            law("neo_hookean"),
            ["C10"],
            {},
            Bounds(np.zeros(1), np.ones(1)),
            states,
            limits=limits,
        )

    first = problem()
    first.limits[0].learn(march(1))
    second = problem(*first.limits)
    assert second.limits[0].steps == ALLOWED + 2
    second.limits[0].learn(march(5))
    assert first.limits[0].steps == ALLOWED + 2
    second.lift_limits()
    assert second.limits[0].steps is None
