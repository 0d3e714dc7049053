"""A fit ends early in its minimum, and is given up only if its model cannot matter."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bushcli.evidence.stopping_rule import NEGLIGIBLE, NOTHING, UNCHANGED, Needed, needed_of
from bushcli.inverse.minimum_search import search
from bushcli.selection.fit import fit, pose
from bushcli.selection.state import State

#: Far start values: the optimum is at a set of 0.05 and no drift.
BEGUN = {"permanent_set": {"set": 0.6}, "drift": {"rate": 0.05}, "time_lag": {"lag": 2.0}}


def ended(one, name, needed):
    model = one.model(**{name: BEGUN[name]})
    return State(one.problem, fit(one.cache, one.case, model, one.measured, needed=needed))


@pytest.mark.slow
@pytest.mark.parametrize("name", BEGUN)
@pytest.mark.parametrize("share", [1.0, 0.02, NEGLIGIBLE])
def test_a_share_of_the_posterior_is_the_same_with_and_without_the_question(coupon, name, share):
    """The smaller it is, the less has to be known of it."""
    one = coupon("yeoh", set_=0.05)
    free = ended(one, name, None)
    found = free.evidence
    for free_log, at in ((found.log, "log"), (found.log_unknown, "log_unknown")):
        needed = replace(Needed(math.inf, math.inf), **{at: free_log + math.log(NEGLIGIBLE / share)})
        asked = ended(one, name, needed)
        changed = share * abs(math.expm1(getattr(asked.evidence, at) - free_log))
        assert changed < 2.0 * UNCHANGED
        assert asked.fitted.solves <= free.fitted.solves


def test_a_fit_that_cannot_matter_ends_early(coupon):
    """With 5 % of permanent set drift leaves much more than the noise, and the set itself leaves nothing else."""
    one = coupon("yeoh", set_=0.05)
    right = ended(one, "permanent_set", None).evidence
    free = ended(one, "drift", None)
    needed = needed_of(right.log, 0.0, 0.0)
    assert max(free.evidence.log, free.evidence.log_unknown) < needed.log
    early = ended(one, "drift", needed)
    assert early.fitted.solves < free.fitted.solves
    assert not early.fitted.converged
    assert max(early.evidence.log, early.evidence.log_unknown) < needed.log
    assert ended(one, "permanent_set", needed).fitted.x[-1] == pytest.approx(0.05, rel=0.1)


@pytest.mark.parametrize("name", BEGUN)
def test_a_fit_ends_in_its_minimum_before_that_is_confirmed(coupon, name):
    """Compared with a search that goes on until nothing changes any more, with the variances at the end of the fit."""
    one = coupon("yeoh", set_=0.05)
    state = ended(one, name, None)
    _, problem = pose(one.cache, one.case, state.model, one.measured)
    problem.rescale(state.fitted.x)
    problem.stopping = replace(problem.stopping, tolerance=1e-10, valley=(100, 0.0))
    tight = search(problem, problem.bounds.inside(state.fitted.x))
    rows = problem.residual(state.fitted.x)
    gain = 0.5 * float(rows @ rows - problem.residual(tight.x) @ problem.residual(tight.x)) / problem.unit**2
    # The variances may differ by the factor that counts as none (`SETTLED`), and the valley is not quite straight.
    assert gain < 5.0 * NOTHING


def test_what_a_model_needs_follows_from_the_posterior_so_far():
    """A model with this evidence and these odds has the negligible share of the posterior."""
    needed = needed_of(-120.0, -3.0, -7.0)
    assert math.exp(needed.log - 3.0 + 120.0) == pytest.approx(NEGLIGIBLE)
    assert math.exp(needed.log_unknown - 7.0 + 120.0) == pytest.approx(NEGLIGIBLE)
