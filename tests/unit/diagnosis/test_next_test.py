"""Which recording would distinguish the rivals: distances of predictions, and the menu."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bushcli.diagnosis import next_test as module
from bushcli.diagnosis.menu import menu
from bushcli.diagnosis.next_test import ExpectedCurve, distance
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.likelihood.form import LAMBDA, PHI, effective_features
from bushcli.recording import Recording

N = 36
UP = np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(1.0, 0.0, N // 2)])
WIDTH = np.where(np.arange(N) < N // 2, 1.0, -1.0)
NONE = np.zeros((N, 0))
EVIDENCE, FITTED = SimpleNamespace(covariance=np.eye(1)), SimpleNamespace(names=("C10",))


def curve(loop: float, force: float = 100.0, spread: np.ndarray = NONE) -> ExpectedCurve:
    """A straight line with an open loop, in newtons."""
    return ExpectedCurve(force * UP + loop * WIDTH, spread, loop * WIDTH)


def test_without_effects_and_parameters_the_distance_is_that_of_the_noise_and_the_law() -> None:
    a, b = curve(0.0), ExpectedCurve(101.0 * UP, NONE, 0.0 * UP)
    v = 1.0 + LAMBDA**2 * np.sum((a.force / 0.5) ** 2) / effective_features(N)
    expected = np.sum(((a.force - b.force) / 0.5) ** 2) / (8.0 * v)
    assert distance(a, b, 0.5) == pytest.approx(expected, rel=1e-12)


def test_a_difference_of_the_size_of_the_error_of_form_says_little_however_small_the_noise() -> None:
    """Two formulas of one loop differ by PHI of it: the distance tends to m / 8 as the noise vanishes."""
    a, b = curve(10.0), curve(10.0 * (1.0 + PHI))
    known = 0.5 * (10.0**2 + (10.0 * (1.0 + PHI)) ** 2) / 10.0**2
    limit = effective_features(N) / (8.0 * known)
    # Force and law left out: their error of form, LAMBDA, is for these curves a sixth of the effects'.
    flat = [ExpectedCurve(one.force - 100.0 * UP, one.spread, one.effects) for one in (a, b)]
    assert distance(*flat, 1e-4) == pytest.approx(limit, rel=1e-3)
    assert distance(a, b, 1e-4) < limit < 1.1


def test_an_effect_that_the_other_model_does_not_have_is_seen() -> None:
    assert distance(curve(10.0), curve(2.0), 0.1) > 20.0


def test_what_the_parameters_may_imitate_does_not_distinguish() -> None:
    a, b = curve(10.0), curve(2.0)
    free = ExpectedCurve(b.force, 100.0 * WIDTH[:, None], b.effects)
    assert distance(a, free, 0.1) < 0.01 * distance(a, b, 0.1)
    # A parameter that may change the loop by much less than the error of form imitates next to nothing.
    narrow = ExpectedCurve(b.force, 0.01 * WIDTH[:, None], b.effects)
    assert distance(a, narrow, 0.1) == pytest.approx(distance(a, b, 0.1), rel=1e-2)


@pytest.mark.parametrize(("mode", "acts"), [("uniaxial", True), ("planar", False)])
def test_a_rig_s_effect_does_not_act_on_a_rig_that_was_not_recorded(coupon, monkeypatch, mode, acts) -> None:
    """A gain of the axial load cell says nothing of the load cell of another rig; the rubber goes with the bushing."""
    one, seen = coupon(), {}
    model = replace(
        one.state.model,
        effects=(
            ActiveEffect(effect("drift"), {"rate": 0.1}),
            ActiveEffect(effect("permanent_set"), {"set": 0.1}),
        ),
    )

    def caught(
        geometry: Any, mode: Any, rubber: Any, refinement: Any, effects: Any, *_: Any, **__: Any
    ) -> None:
        seen["names"] = [active.name for active in effects]

    monkeypatch.setattr(module, "Simulation", caught)
    proposal = next(p for p in menu({mode: 0.5}, {mode: 0.05}, [mode]) if p.channel == mode)
    module._simulation(one.cache, one.case, model, proposal)
    assert ("drift" in seen["names"]) == acts
    assert "permanent_set" in seen["names"]


def test_all_proposals_are_asked_of_the_workers_at_once() -> None:
    """Each proposal by itself would leave a worker idle whenever the rivals are not a multiple of the workers."""
    proposals = menu({"axial": 5.0}, {"axial": 0.05}, ["axial"])
    rivals = [
        SimpleNamespace(state=SimpleNamespace(model=name, evidence=EVIDENCE, fitted=FITTED)) for name in "abc"
    ]
    runs, said = [], []

    class Crew:
        def run(self, work: Any, questions: Any, notify: Any) -> list[Any]:
            runs.append(work)
            answers = [(question[1], question[3]) for question in questions]
            for i, answer in enumerate(answers):
                notify(i, answer)
            return answers

    found = module._expectations(
        SimpleNamespace(case=None), rivals, proposals, Crew(), lambda *a: said.append(a[2])
    )
    assert runs == [module.expected_curve, module.expected_table]
    assert found == [(one, [(name, one) for name in "abc"]) for one in proposals]
    assert said == [one.name for one in proposals]


def test_the_menu_has_another_rate_and_a_hold_among_its_cheapest() -> None:
    cheapest = menu({"axial": 5.0}, {"axial": 0.05}, ["axial"])[:6]
    assert any(one.rates == (0.5, 0.5) for one in cheapest)
    assert any(max(one.holds) > 0.0 for one in cheapest)


def test_ten_times_as_fast_is_ten_times_the_fastest_ramp_whatever_holds_follow() -> None:
    time = np.concatenate([np.linspace(0.0, 5.0, 30), np.linspace(5.0, 300.0, 200)[1:]])
    channels = [
        Recording("uniaxial", factor * np.minimum(time / 5.0, 1.0), np.zeros_like(time), time)
        for factor in (0.5, 0.1)
    ]
    case = SimpleNamespace(geometry=SimpleNamespace(wall=None))
    proposals = module._menu(SimpleNamespace(recordings=channels, case=case))
    (fast,) = (one for one in proposals if "ten times as fast" in one.name)
    assert fast.rates == pytest.approx([1.0, 1.0], rel=0.01)


def test_the_next_test_is_for_the_sets_that_hold_the_posterior_of_what_has_a_curve() -> None:
    """Unknown physics has none: its share makes no rival of a set that has a hundredth."""
    shares = {"viscoelasticity": 0.80, "payne": 0.12, "warming": 0.005, "": 0.07}
    models = [
        SimpleNamespace(
            predicted=None,
            unknown=not name,
            probability=share,
            state=SimpleNamespace(model=SimpleNamespace(effects=(name,) * bool(name), identities=(name,))),
        )
        for name, share in shares.items()
    ]
    rivals, weights = module._rival_sets(models)
    assert [one.state.model.identities[0] for one in rivals] == ["viscoelasticity", "payne"]
    assert weights == pytest.approx([0.8 / 0.92, 0.12 / 0.92])
