"""The search on a linear problem, in which every fit is one least-squares step and takes no time."""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.diagnosis import answer
from bushcli.diagnosis.posterior import posterior, probabilities
from bushcli.diagnosis.result import SMALL
from bushcli.diagnosis.words import possible_shift
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.evidence.stopping_rule import NEGLIGIBLE
from bushcli.runtime.workers import Pending, Workers
from bushcli.selection import queue, queued
from bushcli.selection.additions import with_branch_more
from bushcli.selection.fit import WORSE
from bushcli.selection.model import Model
from bushcli.selection.neighbourhood import BORROWED
from bushcli.selection.neighbours import label
from bushcli.selection.order import FitOrder
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import FAINT, Prediction
from bushcli.selection.queue import LEFT, Search
from bushcli.selection.state import State
from tests.linear import NAMES, World

PREDICTION = Prediction(None, 0.0, 0.0, -1e3, 0.0)
TRUTH = {"drift.rate": 2.5, "permanent_set.set": 3.5}


@pytest.fixture
def world(coupon):
    # `TRUTH` is in medians of the amplitudes' priors.
    return World(coupon, **TRUTH)


def sizes(search):
    return {key: round(state.evidence.log, 9) for key, state in search.states.items()}


def test_the_best_waits_least(world, monkeypatch):
    """What is fitted in place of the best model is an effect of it, or of the plain law where it has another law."""
    order = []
    whole = Search._next_model

    def spied(self):
        waiting = dict(self.waiting)
        taken = whole(self)
        others = self._other_shares
        best = waiting[min(waiting, key=lambda key: (-others.uncertain_weight(waiting[key]), key))]
        if taken is not None:
            order.append((taken, best))
        return taken

    monkeypatch.setattr(Search, "_next_model", spied)
    # A lower limit, so that more than two models are fitted.
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    found = world.search(monkeypatch)
    assert sum(taken is best for taken, best in order) > 1
    # No model is fitted twice.
    assert len(set(world.asked)) == len(world.asked)
    assert found.solves > len(world.asked)


def test_a_model_with_the_probable_effects_matters_by_the_share_of_others(world, monkeypatch):
    """Its weight is multiplied by the share of models with other effects, by `SAME_EFFECTS` at least."""
    found = world.search(monkeypatch)
    base = found.plain

    def waiting(*names):
        model = replace(base.model, effects=tuple(ActiveEffect(effect(name)) for name in names))
        return queued.Queued(model, base, 3.0, slack=0.5)

    one, other = waiting("friction"), waiting("mullins")
    total = math.log(1.0 + 3.0)
    known = queued.OtherShares.of([(one.model, 0.0), (one.model, math.log(2.0)), (base.model, 0.0)], total)
    assert known.uncertain_weight(one) == pytest.approx(one.uncertain_weight + math.log(1.0 / 4.0))
    assert known.uncertain_weight(other) == other.uncertain_weight
    freed = replace(one, model=replace(one.model, fixed=not one.model.fixed))
    assert known.uncertain_weight(freed) == freed.uncertain_weight
    sure = queued.OtherShares.of([(one.model, 0.0)], 0.0)
    assert sure.uncertain_weight(one) == pytest.approx(one.uncertain_weight + math.log(queued.SAME_EFFECTS))
    both = queued.Waiting({one.model.structure: one, other.model.structure: other})
    assert both.ordered_models(known) == [other.model.structure, one.model.structure]
    assert both.uncertain_weight(known) < both.uncertain_weight(queued.OtherShares({}))


def test_the_better_of_two_effects_is_fitted_before_both_and_before_another_law(world, monkeypatch):
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    pairs = [q for q in found.waiting.values() if len(q.model.effects) == 2 and q.base is found.plain]
    both = max(pairs, key=lambda pair: pair.predicted_weight)
    other = replace(found.plain.model, law="gent")
    bound = queued.Queued(other, found.plain, 9.0, is_bound=True)
    singles = [
        q for q in found.waiting.values() if both.model.contains(q.model) and len(q.model.effects) == 1
    ]
    better = max(singles, key=lambda single: single.predicted_weight)
    order = FitOrder(found.plain, found.states, [], set(), found.waiting, queued.OtherShares({}))
    assert order.single_first(both) is better
    assert len(order.law_first(bound).model.effects) == 1
    # Neither is fitted while that fit has begun.
    during = replace(order, begun=[better.model])
    assert during.single_first(both) is None
    assert during.law_first(bound) is None
    world.always = True
    found.fit_anyway(better)
    assert order.single_first(both) is both
    assert order.law_first(bound) is bound


def test_of_effects_of_fillers_the_one_with_fewest_parameters_is_fitted_first(world, monkeypatch):
    """If it may do as well as the other is predicted to do, and beside the same further effects."""
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    base = found.plain

    def waiting(*names, weight=7.0, slack=20.0, **values):
        actives = [ActiveEffect(effect(name)).with_start_values() for name in names]
        first = replace(actives[0], values={**actives[0].values, **values})
        model = replace(base.model, effects=(first, *actives[1:]))
        return queued.Queued(model, base, weight, odds=-1.0, slack=slack)

    def first(*models, begun=(), tried=()):
        found.waiting.clear()
        found.waiting.update({one.model.structure: one for one in models})
        others = queued.OtherShares({})
        order = FitOrder(base, found.states, [*begun], {*tried}, found.waiting, others)
        return order.simpler_first(models[0], -math.inf)

    payne, visco, friction = (waiting(name) for name in ("payne", "viscoelasticity", "friction"))
    activated = waiting("viscoelasticity", weight=9.0, exponent=3.0)
    assert first(payne, activated, visco) is visco
    assert first(visco, payne) is visco
    assert first(visco, friction) is visco
    # One that has begun is waited for; one that cannot do as well, or that has failed, is not.
    assert first(payne, begun=[visco.model]) is None
    assert first(payne, waiting("viscoelasticity", weight=-50.0)) is payne
    assert first(payne, visco, tried=[visco.model.structure]) is payne
    # Each beside the same others, in whatever size these were predicted.
    both = waiting("payne", "offset")
    assert first(both, visco) is both
    beside = waiting("viscoelasticity", "offset", weight=6.0)
    assert first(both, beside) is beside
    # A lag is no effect of fillers.
    assert first(visco, waiting("time_lag")) is visco


def test_of_two_predictions_the_surer_one_counts(world, monkeypatch):
    """A model that is predicted from the plain law is predicted again from a model that is nearer to it."""
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    key, one = next(
        item for item in found.waiting.items() if item[1].model.identities == ("drift", "time_lag")
    )
    del found.waiting[key]
    for log, slack, kept in ((5, 9.0, 5), (7, 20.0, 5), (6, 5.0, 6), (2, 1.0, 2), (9, 1.2, 2), (1, 0.6, 1)):
        found.neighbourhood.queue(replace(PREDICTION, model=one.model, log_evidence=log), found.plain, slack)
        assert found.waiting[key].log_evidence == kept


def test_sleeves_of_another_thickness_are_predicted_from_those_that_are_fitted(world, monkeypatch):
    """They do the same with another modulus; a bond that is off elsewhere does not."""
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    base = found.plain

    def model(name, **values):
        active = ActiveEffect(effect(name)).with_start_values()
        return replace(base.model, effects=(replace(active, values={**active.values, **values}),))

    def waiting(one):
        return queued.Queued(one, base, 7.0, odds=-1.0, slack=20.0, hope=5.0)

    thin, thick = (model("sleeve_compliance", thickness=t) for t in (1.0, 4.0))
    inner, outer = (model("debonding", bond=b) for b in (0.0, 2.0))
    found.waiting.clear()
    found.waiting.update({one.structure: waiting(one) for one in (thick, outer)})
    # Not at the same time.
    order = FitOrder(base, found.states, [thin, inner], set(), found.waiting, queued.OtherShares({}))
    assert order.next_model(-math.inf).model is outer
    for one in (thin, inner):
        fitted = State(base.problem, replace(base.fitted, model=one, converged=True))
        predicted = queued.Queued(one, base, 6.0, odds=-1.0)
        for silent in (replace(predicted, is_bound=True), replace(predicted, base=fitted)):
            found.neighbourhood.correct(fitted, silent, 99.0)
        found.neighbourhood.correct(fitted, predicted, 4.0)
    corrected = found.waiting[thick.structure]
    assert (corrected.log_evidence, corrected.hope) == (11.0, 0.0)
    assert corrected.slack == queued.slack_of(1.0)
    assert found.waiting[outer.structure] == waiting(outer)


def test_what_is_surely_predicted_counts(world, monkeypatch):
    found = world.search(monkeypatch)
    assert found.counted_models
    models = posterior(found)
    assert sum(one.probability for one in models) == pytest.approx(1.0, abs=1e-9)
    assert any(one.predicted for one in models)
    # The most probable model has been fitted.
    assert models[0].predicted is None
    most = max(max(found.weights(one)) for one in found.states.values())
    assert all(one.predicted_weight < most and one.slack <= queued.SURE for one in found.counted_models)


def test_it_ends_when_what_is_left_is_next_to_nothing(world, monkeypatch):
    found = world.search(monkeypatch)
    assert world.ended == "nothing left"
    assert found.share_left < LEFT
    # It ends before all are fitted: with seven effects there are 63 sets of up to three.
    assert found.waiting
    assert len(world.asked) < 40
    said = answer.search_extent(found, world.ended, {}, {})
    assert said.complete
    models = posterior(found)
    assert set(models[0].effects) == {"drift", "permanent_set"}
    probability = probabilities(models, NAMES)
    assert min(probability["drift"], probability["permanent_set"]) > 0.9


def test_a_budget_ends_it_and_says_so(world, monkeypatch):
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    assert world.ended == "budget"
    assert world.asked == []
    # The plain law's neighbours are known only by their predictions.
    assert found.share_left > 0.5
    said = answer.search_extent(found, world.ended, {}, {})
    assert not said.complete
    assert said.left == pytest.approx(found.share_left)
    (best, *_) = posterior(found)
    doubts = answer.doubts(world.one.case, (), (), best, found.problem, said)
    (condition,) = [one for one in doubts if one.name == "budget"]
    assert possible_shift(found.share_left) in condition.message


def test_the_answer_does_not_depend_on_the_number_of_workers(coupon, monkeypatch):
    answers = []
    for count in (1, 3):
        world = World(coupon, **TRUTH)
        if count == 1:
            found = world.search(monkeypatch)
        else:
            with ThreadPoolExecutor(count) as pool:
                found = world.search(monkeypatch, Workers(1, None, pool))
        answers.append((sizes(found), [row.effects for row in found.rows], round(found.share_left, 12)))
    assert answers[0] == answers[1]


def test_the_next_fit_begins_beside_the_younger_of_two(world, monkeypatch):
    events = []

    class Spied(Workers):
        def ask(self, work, question):
            asked, name = super().ask(work, question), question[1].structure
            events.append(("begun", name))
            return Pending(
                lambda: (events.append(("received", name)), asked.answer())[1],
                lambda: events.append(("abandoned", name)),
            )

    monkeypatch.setattr(queue, "LEFT", 1e-6)
    world.search(monkeypatch, Spied(1))
    begun, ended = ([name for kind, name in events if (kind == "begun") == which] for which in (True, False))
    assert sorted(begun) == sorted(ended)
    # The oldest is received first.
    abandoned = [name for kind, name in events if kind == "abandoned"]
    received = [name for kind, name in events if kind == "received"]
    for name in abandoned:
        begun.remove(name)
    assert received == begun
    running = np.cumsum([1 if kind == "begun" else -1 for kind, _ in events])
    assert running.max() == queue.AT_ONCE
    # A fit begins after another has ended, while others go on.
    kinds = [kind for kind, _ in events]
    assert any(
        kinds[i] == "received" and running[i] > 0 and kinds[i + 1] == "begun" for i in range(len(kinds) - 1)
    )


def test_a_lost_model_is_said_and_has_no_probability(world, monkeypatch):
    heard = []
    world.unsolved = {"drift"}
    found = world.search(monkeypatch, told=lambda *line: heard.append(line))
    assert any("drift" in name for name in found.lost.values())
    assert all("drift" not in state.model.identities for state in found.states.values())
    assert any("drift" in what and text.startswith("cannot be solved") for _, what, text in heard)
    said = answer.search_extent(found, world.ended, {}, {})
    assert said.lost == tuple(found.lost.values())
    rows = [one for one in said.trials if "drift" in one.effects]
    assert rows
    assert all(row.text == "cannot be solved from any start" for row in rows)
    best = posterior(found)[0]
    doubts = answer.doubts(world.one.case, (), (), best, found.problem, said)
    (condition,) = [one for one in doubts if one.name == "models_lost"]
    assert "drift" in condition.message


@pytest.mark.parametrize("matters", [True, False])
def test_a_fit_that_need_not_go_to_the_end_is_told_what_it_has_to_reach(world, monkeypatch, matters):
    found = world.search(monkeypatch)
    one = next(q for q in found.waiting.values() if "mullins" in q.model.identities)
    world.always, fit, told = matters, world.fit, []
    monkeypatch.setattr(queue, "fit", lambda *question: (told.append(question[-1]), fit(*question))[1])
    found.fit_anyway(one, matters=matters)
    (needed,) = told
    assert (needed is None) == matters
    if needed is not None:
        assert needed.log == pytest.approx(
            found.total + math.log(NEGLIGIBLE) - found.odds(one.model), abs=0.1
        )


def test_a_model_that_is_solved_at_last_is_not_lost(world, monkeypatch):
    found = world.search(monkeypatch)
    key, one = next((k, q) for k, q in found.waiting.items() if "mullins" in q.model.identities)
    world.always, world.unsolved = True, {"mullins"}
    found.fit_anyway(one)
    assert label(one.model, variants=True) == found.lost[key]
    # Nor does its prediction keep a probability.
    assert key not in found.waiting
    world.unsolved = set()
    found.fit_anyway(one)
    assert not found.lost
    assert key in found.states


def test_lost_models_with_the_same_effects_are_distinguished():
    two = [ActiveEffect(effect("debonding"), {"length": 2.0, "bond": bond}) for bond in (0.0, 3.0)]
    names = [label(Model("yeoh", {}, False, (one,)), variants=True) for one in two]
    assert len(set(names)) == 2
    assert all(name.startswith("yeoh + debonding (") for name in names)
    assert label(Model("yeoh", {}, False, tuple(two[:1]))) == "yeoh + debonding"


def test_no_model_ends_worse_than_one_that_it_contains(world, monkeypatch):
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    found = world.search(monkeypatch)
    pairs = [
        (a, b) for a in found.states.values() for b in found.states.values() if a.model.contains(b.model)
    ]
    assert len(pairs) > 3
    assert all(a.objective <= b.objective + WORSE for a, b in pairs)


def test_a_model_with_effects_exchanged_is_predicted_beside_a_fitted_one(world, monkeypatch):
    """The problem is linear, so that the prediction from the true model is what a fit finds."""
    found = world.search(monkeypatch)
    truth = next(s for s in found.states.values() if s.model.identities == ("drift", "permanent_set"))
    (other,) = [
        one
        for one in found.waiting.values()
        if one.model.identities == ("permanent_set", "time_lag")
        and one.model.law == truth.model.law
        and not any(p.variant for active in one.model.effects for p in active.parameters)
    ]
    fitted = State(world.problem, world.fit(world.one.case, other.model, None))
    assert found.weights(fitted)[0] == pytest.approx(other.predicted_weight, abs=1.0)


@pytest.mark.parametrize(("log_likelihood", "limit"), [(-20.0, -27.0), (-17.0, -30.0), (-11.0, math.inf)])
def test_nothing_limits_a_fit_where_the_noise_is_overestimated(world, monkeypatch, log_likelihood, limit):
    """As it is where a model is predicted to leave less than nothing but noise does, which has -17."""
    search, queued_models = world.search(monkeypatch), []
    three = tuple(ActiveEffect(effect(name), {}) for name in ("drift", "friction", "time_lag"))
    model = replace(search.plain.model, effects=three)
    monkeypatch.setattr(search, "put", queued_models.append)
    monkeypatch.setattr(search, "odds", lambda model: 0.0)
    monkeypatch.setitem(search.problem.likelihood.__dict__, "log_without_misfit", -17.0)
    search.neighbourhood.queue(Prediction(model, -30.0, 5.0, log_likelihood, 5.0), search.plain, 6.0)
    (one,) = queued_models
    assert one.limit == pytest.approx(limit)


@pytest.mark.parametrize(
    ("old", "new", "fitted", "expected"),
    [
        ("fixture_mass", "rig_resonance", (), True),
        ("rig_resonance", "fixture_mass", (), True),
        ("fixture_mass", "rig_resonance", ("rig_resonance", "viscoelasticity"), False),
        # Not its rival, or an effect of recordings along a path as well.
        ("fixture_mass", "time_lag", (), False),
        ("compressibility", "rig_compliance", (), False),
    ],
)
def test_the_rival_of_a_probable_effect_of_tables_is_fitted(coupon, old, new, fitted, expected):
    """However poor its prediction is; only if no model with the same effects is fitted."""

    def model(name):
        law = coupon().state.model
        return replace(law, effects=tuple(ActiveEffect(effect(one), {}) for one in (name, "viscoelasticity")))

    state = SimpleNamespace(model=model(old))
    other = SimpleNamespace(base=state, model=model(new), predicted_weight=-1e3)
    states = [state, *([SimpleNamespace(model=SimpleNamespace(identities=fitted))] if fitted else [])]
    search = SimpleNamespace(
        states=dict(enumerate(states)), waiting={"other": other}, _states_above=lambda share: [state]
    )
    assert (Search._with_rival(search) is other) == expected


def test_nothing_is_predicted_without_an_effect_of_which_first_order_is_known_to_be_wrong(
    coupon, monkeypatch
):
    """The curves hardly change with the effect's amplitude any more, but they do change without the effect."""
    world = World(coupon, **{"drift.rate": 5.0, "time_lag.lag": 3.0})
    monkeypatch.setattr(Search, "run", lambda _: None)
    search = world.search(monkeypatch)
    search._expand(search.plain.model.structure)
    search._enter(State(world.problem, world.fit(world.one.case, world.base.model, None)), 0.0)
    active = ActiveEffect(effect("drift")).with_start_values()
    drift = replace(world.base.model, effects=(active,))
    linear = State(world.problem, world.fit(world.one.case, drift, None))
    slopes = linear.fitted.jacobians[0].copy()
    slopes[:, -1] *= 0.01
    ended = State(world.problem, replace(linear.fitted, jacobians=(slopes,)))
    search.waiting.clear()
    search.neighbourhood.queue_without(Beside(ended, ()))
    assert not search.waiting
    search.neighbourhood.queue_without(Beside(linear, ()))
    assert search.waiting
    assert not any("drift" in queued.model.identities for queued in search.waiting.values())


def test_only_what_may_be_visible_is_solved_anew_beside_a_fitted_effect(world, monkeypatch):
    found = world.search(monkeypatch)
    state = max(found.states.values(), key=found.weights)
    asked = set()
    monkeypatch.setattr(
        found.derivatives,
        "additions_beside",
        lambda state, among: asked.update(effect.name for effect in among) or [],
    )
    beside = found.neighbourhood.beside(state)
    borrowed = {points[0].trial.effect.name for points in beside.grouped.values()}
    # Of its own effects there may be further branches.
    assert {active.effect.name for active in state.model.effects} <= asked
    assert borrowed
    assert borrowed | asked == {effect.name for effect in found.catalogue}
    assert not borrowed & asked
    for prediction in beside.singles():
        assert BORROWED * prediction.gain < FAINT


def test_an_effect_that_nothing_responds_to_is_untestable(world, monkeypatch):
    world.columns["warming.slope" if "warming.slope" in world.columns else "time_lag.lag"] *= 0.0
    name = "warming" if "warming.slope" in world.columns else "time_lag"
    found = world.search(monkeypatch)
    assert found.derivatives.untestable[name] == "these recordings do not respond to it"


def test_an_effect_that_has_a_probability_beside_another_is_not_untestable(world, monkeypatch):
    """In a diagnosis of holds, compliance of the rig had 1 % beside viscoelasticity and was not detectable as well."""
    world.columns["time_lag.lag"] *= 0.0
    found = world.search(monkeypatch)
    for probability, listed in ((SMALL, False), (0.5 * SMALL, True)):
        said = answer.search_extent(found, world.ended, {"drift": "hidden"}, {"time_lag": probability})
        assert ("time_lag" in said.untestable) is listed
        assert said.untestable["drift"] == "hidden"


def test_an_effect_that_cannot_be_simulated_is_not_said_to_have_no_influence(world, monkeypatch):
    solved = world.derivatives

    def derivatives(case, base, candidates, known):
        factor = np.nan if candidates[0].effect.name == "time_lag" else 1.0
        return tuple(factor * channel for channel in solved(case, base, candidates))

    world.derivatives = derivatives
    found = world.search(monkeypatch)
    assert found.derivatives.untestable["time_lag"] == "the bushing cannot be simulated with it"


def test_what_the_law_does_itself_is_untestable(world, monkeypatch):
    world.columns["time_lag.lag"] = world.base.jacobians[0] @ np.ones(3)
    found = world.search(monkeypatch)
    assert (
        found.derivatives.untestable["time_lag"]
        == "the parameters of the law have the same influence on these recordings"
    )
    assert not any("time_lag" in state.model.identities for state in found.states.values())


def test_names_of_models_are_words(world):
    assert label(world.one.model(permanent_set={}, drift={})) == "yeoh + drift + permanent_set"


def test_a_poor_single_effect_is_fitted_with_one_branch_more_where_no_model_explains_the_recordings(
    coupon, monkeypatch
):
    """Friction at one strain explains little, at two nearly all; softening explains more than the first."""
    world = World(coupon, **{"friction.g": 2.0, "friction.g2": 6.0})
    truth = sum(
        a * world.median[n] * world.columns[n] for n, a in (("friction.g", 2.0), ("friction.g2", 6.0))
    )
    other = world.columns["time_lag.lag"] * world.median["time_lag.lag"]
    world.columns["mullins.inverse_r"] = (truth + 1.5 * other) / (8.0 * world.median["mullins.inverse_r"])
    monkeypatch.setattr(Search, "run", lambda _: None)
    search = world.search(monkeypatch, names=("friction", "mullins"))
    for name in ("friction", "mullins"):
        model = replace(world.base.model, effects=(ActiveEffect(effect(name)).with_start_values(),))
        model = replace(model, effects=tuple(_first_branch(one) for one in model.effects))
        search._enter(State(world.problem, world.fit(world.one.case, model, None)), 0.0)
    (poor,) = (key for key, state in search.states.items() if state.model.identities == ("friction",))
    (more,) = with_branch_more(search, search.states.keys(), LEFT)
    assert more.base is search.states[poor]
    assert "friction.g2" in more.model.values
    assert not list(with_branch_more(search, {more.model.structure}, LEFT))
    assert not list(with_branch_more(search, search.states.keys(), 1e30))
    search.waiting.clear()
    assert search._queue_branch_more()
    assert search.waiting.ordered_models(queued.OtherShares({})) == [more.model.structure]
    found = State(world.problem, world.fit(world.one.case, more.model, None))
    assert search.weights(found)[0] < more.optimistic_weight <= more.limit
    # Not where a probable model explains the recordings.
    monkeypatch.setattr(State, "leaves_misfit", False)
    assert not search._queue_branch_more()


def _first_branch(one):
    return replace(one, values={p.name: one.values[p.name] for p in one.effect.parameters if not p.optional})


def test_a_search_that_is_stopped_at_its_first_derivatives_has_looked_at_nothing(coupon, monkeypatch):
    world = World(coupon, **{"friction.g": 5.0})

    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(world, "derivatives", stopped)
    searches = []
    started = queue.Search.run
    monkeypatch.setattr(queue.Search, "run", lambda self: (searches.append(self), started(self)))
    with pytest.raises(KeyboardInterrupt):
        world.search(monkeypatch)
    assert searches[0].share_left == 1.0


def test_a_fit_that_was_finished_before_an_interruption_counts(world, monkeypatch):
    """What is being fitted when Ctrl-C comes waits again: its share of the posterior is still open."""
    # A lower limit, so that more than one model is fitted.
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    fit, asked = world.fit, []

    def stopped(*question):
        asked.append(question[1].structure)
        if len(asked) > 1:
            raise KeyboardInterrupt
        return fit(*question)

    monkeypatch.setattr(world, "fit", stopped)
    searches, started = [], queue.Search.run
    monkeypatch.setattr(queue.Search, "run", lambda self: (searches.append(self), started(self)))
    with pytest.raises(KeyboardInterrupt):
        world.search(monkeypatch)
    (found,) = searches
    assert len(found.rows) == 2
    assert found.solves > found.plain.fitted.solves
    assert asked[0] in found.states
    assert asked[1] in found.waiting
    assert found.share_left > 1e-6


def test_no_second_fit_begins_when_the_time_is_over(world, monkeypatch):
    """Two models are fitted at once, in one process one after the other."""
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    fit, asked, clock = world.fit, [], [0.0]

    def slow(*question):
        asked.append(question[1].structure)
        clock[0] += 10.0
        return fit(*question)

    monkeypatch.setattr(world, "fit", slow)
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    found = world.search(monkeypatch, deadline=5.0)
    assert len(asked) == 1
    assert world.ended == "budget"
    assert len(found.states) == 2
    assert found.share_left > 1e-6


def test_fits_that_others_have_begun_are_finished_when_the_time_is_over(world, monkeypatch):
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    clock, begun = [0.0], []
    receive = Search._receive_oldest

    def slow(self):
        begun.append(len(self._begun))
        receive(self)
        clock[0] += 10.0

    monkeypatch.setattr(Search, "_receive_oldest", slow)
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    with ThreadPoolExecutor(2) as pool:
        found = world.search(monkeypatch, Workers(1, None, pool), deadline=5.0)
    assert world.ended == "budget"
    # Beside the law alone, those that had begun.
    assert begun[0] > 1
    assert len(found.states) == 1 + begun[0]
    assert not found._begun


@pytest.mark.parametrize("may_matter", [True, False])
def test_a_fit_is_abandoned_once_it_cannot_matter_and_its_model_waits_again(world, monkeypatch, may_matter):
    found, abandoned = world.search(monkeypatch), []
    waits = next(q for q in found.waiting.values() if q.is_sure)
    faint = replace(waits, log_evidence=found.total - waits.odds - 30.0)
    strong = replace(faint, log_evidence=found.total - waits.odds)
    found.waiting.pop(faint.model.structure)
    found._begun = [
        queue._Begun(one, one, Pending(lambda: None, partial(abandoned.append, one)), True, may_matter)
        for one in (faint, strong)
    ]
    found._abandon_negligible()
    assert abandoned == ([faint] if may_matter else [])
    assert [begun.queued for begun in found._begun] == [strong] if may_matter else [faint, strong]
    assert (faint.model.structure in found.waiting) == may_matter


def test_a_begun_fit_is_judged_by_the_most_reliable_prediction_of_its_model(world, monkeypatch):
    found, abandoned = world.search(monkeypatch), []
    waits = next(q for q in found.waiting.values() if q.is_sure)
    begun = replace(waits, log_evidence=found.total - waits.odds, slack=waits.slack + 1.0)
    found.waiting.pop(begun.model.structure)
    found._begun = [
        queue._Begun(begun, begun, Pending(lambda: None, partial(abandoned.append, 1)), True, True)
    ]
    for slack in (waits.slack + 2.0, waits.slack):
        found.put(replace(begun, log_evidence=begun.log_evidence - 30.0, slack=slack))
        found._abandon_negligible()
        assert bool(abandoned) == (slack == waits.slack)
        assert (begun.model.structure in found.waiting) == bool(abandoned)


def test_a_search_abandons_fits_and_ends(world, monkeypatch):
    events = []

    class Spied(Workers):
        def ask(self, work, question):
            asked = super().ask(work, question)
            return replace(asked, abandon=lambda: events.append(question[1].structure))

    # So that many fits begin, and one of them is easily outweighed: those that are predicted to leave less than noise
    # are expected to do no better than that.
    whole = Search.put

    def limited(self, one):
        whole(self, replace(one, limit=one.predicted_weight if math.isinf(one.limit) else one.limit))

    monkeypatch.setattr(Search, "put", limited)
    monkeypatch.setattr(queue, "LEFT", 1e-6)
    monkeypatch.setattr(queue, "NEGLIGIBLE", 0.1)
    found = world.search(monkeypatch, Spied(1))
    assert world.ended == "nothing left"
    assert events
    assert all(name in found.waiting or name in found.states for name in events)
