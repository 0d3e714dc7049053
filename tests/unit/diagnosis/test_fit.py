"""Fits on a coupon: the plain law agrees with `bushcli inverse`, and no model ends worse than one that it contains."""

from __future__ import annotations

import math
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.inverse import identify
from bushcli.runtime import workers
from bushcli.selection import plain as plain_module
from bushcli.selection.fit import WORSE, FittedSamples, _search_from, fit, pose
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import fit_plain

AXIAL = """
[geometry]
shape = "plain"
inner_radius = 10.0
outer_radius = 18.0
length = 28.0
[mesh]
elements_across = 2
elements_along = 4
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
[[recordings]]
mode = "axial"
file = "axial.csv"
"""


def same(cache, case, law, start):
    found = identify(Model(law, start).task(case))
    plain = fit_plain(cache, case, Model(law, start))
    assert plain.names == tuple(found.parameters)
    for name, value in zip(plain.names, plain.x, strict=True):
        assert value == pytest.approx(found.parameters[name].value, rel=1e-12)


def test_a_search_that_ends_worse_than_another_goes_on_from_there(coupon, monkeypatch):
    """Beside the edge of the law's stability the first search may end in a local minimum."""
    one, start = coupon("yeoh"), {"C10": 0.4, "C20": -0.01, "C30": 0.001}
    best = dict(zip(one.plain.names, map(float, one.plain.x), strict=True))
    far = SimpleNamespace(x=np.array([0.3, 0.0, 0.0]), cost=math.inf, converged=True)
    monkeypatch.setattr(plain_module, "first_minimum", lambda *_: SimpleNamespace(minimum=far))
    near = {name: 1.02 * value for name, value in best.items()}
    found = fit_plain(one.cache, one.case, Model("yeoh", start), near)
    assert found.x == pytest.approx(one.plain.x, rel=1e-3)
    # What is no better is left alone.
    far = SimpleNamespace(x=one.plain.x, cost=0.0, converged=True)
    again = fit_plain(one.cache, one.case, Model("yeoh", start), dict.fromkeys(best, 3.0))
    assert again.x == pytest.approx(one.plain.x, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["neo_hookean", "yeoh"])
def test_the_plain_law_of_a_coupon_is_that_of_an_identification(coupon, law):
    one = coupon(law, set_=0.03)
    same(one.cache, one.case, law, dict.fromkeys(one.plain.names, 0.01) | {"C10": 0.3})


def test_the_plain_law_of_a_bushing_is_that_of_an_identification(tmp_path):
    q = np.concatenate([np.linspace(0.0, 3.0, 12), np.linspace(3.0, -2.0, 16)[1:]])
    force = 330.0 * q + 4.0 * q**3 + 3.0 * np.random.default_rng(1).normal(size=len(q))
    rows = [f"{i},{u:.6f},{f:.4f}" for i, (u, f) in enumerate(zip(q, force, strict=True))]
    (tmp_path / "axial.csv").write_text("\n".join(["time_s,displacement_mm,force_N", *rows]) + "\n")
    (tmp_path / "case.toml").write_text(AXIAL)
    same(ModelCache(), load_case(tmp_path / "case.toml", ()), "neo_hookean", {"C10": 0.3})


def no_worse(one, states):
    """Check that no state is worse than those of models that its model contains; return the number of pairs."""
    pairs = [(a, b) for a in states for b in states if a.model.contains(b.model)]
    for a, b in pairs:
        assert a.objective <= b.objective + WORSE, (a.model.identities, b.model.identities)
    return len(pairs)


@pytest.mark.slow
def test_no_model_ends_worse_than_one_that_it_contains(coupon):
    """Three effects that need no kernel, in all combinations, started far from their best values."""
    one = coupon("yeoh", set_=0.05)
    begun = {"permanent_set": {"set": 0.6}, "drift": {"rate": 0.02}, "time_lag": {"lag": 1.5}}
    states = [one.state]
    for size in (1, 2, 3):
        for names in combinations(begun, size):
            model = one.model(**{name: begun[name] for name in names})
            states.append(one.fit(model, *(s for s in states if model.contains(s.model))))
    # 3 x 1 + 3 x 3 + 1 x 7.
    assert no_worse(one, states) == 19
    assert min(states, key=lambda s: s.objective).fitted.values["permanent_set.set"] > 0.02


def test_a_fit_minimises_what_a_state_is_judged_by(coupon):
    """Twice the negative log posterior is the same from the fit's rows and from the features of the result."""
    one = coupon("yeoh", set_=0.05)
    state = one.fit(one.model(permanent_set={"set": 0.03}))
    _, problem = pose(one.cache, one.case, state.model, one.measured)
    assert problem.objective(state.fitted.x) == pytest.approx(state.objective, rel=1e-9)
    for step in (0.9, 1.1):
        moved = state.fitted.x * np.array([1.0] * 3 + [step])
        assert problem.objective(moved) > state.objective - WORSE


def test_a_model_that_contains_a_better_one_begins_again_from_there(coupon):
    """With a start from which the search alone does not find the better point."""
    one = coupon("yeoh", set_=0.05)
    good = one.fit(one.model(permanent_set={"set": 0.03}))
    both = one.model(permanent_set={"set": 0.85}, drift={"rate": 0.0})
    alone, beside = one.fit(both), one.fit(both, good)
    assert beside.objective <= good.objective + WORSE
    assert beside.objective <= alone.objective + WORSE


@pytest.mark.slow
def test_the_plain_law_does_not_leave_the_recording_where_physics_is_missing(coupon):
    """A factor on all forces is known to half a percent, whatever the error of form."""
    one = coupon("yeoh", set_=0.1)

    def rms(fitted):
        return float(np.sqrt(np.mean((fitted.simulated[0] - one.recordings[0].force) ** 2)))

    assert rms(one.state.fitted) < 1.3 * rms(one.plain)


@pytest.mark.slow
def test_friction_beside_viscoelasticity_is_no_worse_than_either(coupon):
    """This pair was once discarded because its refit had left more than friction alone."""
    one = coupon("yeoh", set_=0.05)
    begun = {"viscoelasticity": {"g1": 0.1, "tau1": 5.0}, "friction": {}}
    states = [one.state]
    for names in (["viscoelasticity"], ["friction"], ["viscoelasticity", "friction"]):
        model = one.model(**{name: begun[name] for name in names})
        states.append(one.fit(model, *(s for s in states if model.contains(s.model))))
    assert no_worse(one, states) == 5


def test_a_fit_for_which_nobody_waits_ends_at_its_first_evaluation(coupon, monkeypatch):
    one = coupon("yeoh")
    question = one.cache, one.case, one.state.model, FittedSamples(one.problem.used, (0.0,))
    assert fit(*question) is not None
    monkeypatch.setattr(workers, "_marks", [1])
    monkeypatch.setattr(workers, "_mark", 0)
    with pytest.raises(workers.Abandoned):
        fit(*question)


def test_a_search_from_a_point_that_cannot_be_solved_ends_there():
    """A model may be solved on a bound, at the optimum of one that it contains, and fail a little inside."""
    problem = SimpleNamespace(channels=(), residual=lambda x: np.full(3, np.nan))
    end = _search_from(problem, np.array([1.0]), lambda *_: None)
    assert end.objective == np.inf
    assert not end.converged
