"""Errors of form that resemble an effect: their probability in closed form, its limits, and what follows from it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import lognorm

from bushcli.diagnosis import resemblance
from bushcli.diagnosis.posterior import posterior, probabilities, run_with_shown, unfitted_models
from bushcli.diagnosis.resemblance import Size, resemblances
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect, effects, effects_on
from bushcli.effects.rig import elastic_response
from bushcli.evidence import prior
from bushcli.evidence.prior import effect_odds
from bushcli.likelihood.form import LAMBDA, LAMBDA_SPREAD, PHI, PHI_MOST, PHI_SPREAD
from bushcli.selection.queue import LEFT
from bushcli.selection.state import State
from tests.linear import NAMES, World


def pair(coupon, drift, set_):
    """The fit of a drift and a permanent set, both concealed with these sizes over their priors' medians."""
    world = World(coupon, **{"drift.rate": drift, "permanent_set.set": set_})
    model = world.base.model
    started = tuple(ActiveEffect(effect(name)).with_start_values() for name in ("drift", "permanent_set"))
    both = type(model)(model.law, model.start, effects=started)
    return State(world.problem, world.fit(world.one.case, both, None))


def own_size(state, name, gone=()):
    """Norm of the change by an amplitude without what the parameters that stay can imitate, by the normal equations."""
    J = state.slopes[0]
    i = state.fitted.names.index(name)
    others = np.delete(J, [i, *map(state.fitted.names.index, gone)], axis=1)
    column = J[:, i] * state.fitted.x[i]
    coefficients = np.linalg.solve(others.T @ others, others.T @ column)
    return float(np.linalg.norm(column - others @ coefficients))


def expected(state, name, size, median, spread, most=math.inf):
    """Ratio of the module's docstring, with SciPy's log-normal density."""
    known, value = state.priors[name], state.model.values[name]
    density = lognorm(spread, scale=median)
    of_size = density.pdf(size) * size / density.cdf(most)
    w = resemblance.RESEMBLES
    # An amplitude of either sign: the density of its absolute value is twice as large.
    signs = 1.0 if known.one_sided else 2.0
    own = signs * abs(value) * math.exp(known.prior.log_density(value, known.scales))
    return w / (1.0 - w) / len(effects_on("static")) / effect_odds(name.split(".")[0]) * of_size / own


def whole_size(state, name):
    """Norm of the change by an amplitude while all other parameters stay."""
    i = state.fitted.names.index(name)
    return float(np.linalg.norm(state.slopes[0][:, i] * state.fitted.x[i]))


@pytest.fixture
def everywhere(monkeypatch):
    """Take the effects that are left for ones that act in all branches."""
    monkeypatch.setattr(Size, "beyond", lambda *_: 0.0)


@pytest.mark.usefixtures("everywhere")
@pytest.mark.parametrize("smaller", ["fitted", "held"])
def test_it_follows_the_closed_form(coupon, monkeypatch, smaller):
    """The plain law leaves more than the other effect does, or less."""
    state = pair(coupon, 3.0, 0.5)
    name = "permanent_set.set"
    held = whole_size(state, name) / whole_size(state, "drift.rate")
    share = {"fitted": 0.5 * held, "held": 2.0 * held}[smaller]
    likelihood = state.problem.likelihood
    monkeypatch.setitem(
        likelihood.__dict__, "explained_squares", np.array([(own_size(state, name) / share) ** 2])
    )
    one = expected(state, name, min(share, held), PHI, PHI_SPREAD, PHI_MOST)
    assert math.exp(dict(resemblances(state))["permanent_set",]) == pytest.approx(one, rel=1e-6)


@pytest.mark.usefixtures("everywhere")
@pytest.mark.parametrize("leading", ["g1", "g2"])
def test_of_several_amplitudes_the_one_that_changes_most_counts(coupon, leading):
    """The other one, which the recordings do not show, would have the density of no size at all: without limit."""
    world = World(coupon, **{"drift.rate": 3.0, f"viscoelasticity.{leading}": 0.5})
    two = ActiveEffect(effect("viscoelasticity"), {"g1": 0.1, "tau1": 1.0, "g2": 0.1, "tau2": 10.0})
    law = world.base.model
    both = type(law)(law.law, law.start, effects=(ActiveEffect(effect("drift")).with_start_values(), two))
    state = State(world.problem, world.fit(world.one.case, both, None))
    active = {one.effect.name: one for one in state.model.effects}
    size = Size.of(state, active["viscoelasticity"], ())
    share = size.relative_to(
        [Size.of(state, active["drift"], [active["viscoelasticity"]])],
        math.sqrt(float(state.problem.likelihood.explained_squares.sum())),
    )
    one = expected(state, f"viscoelasticity.{leading}", share, PHI, PHI_SPREAD, PHI_MOST)
    assert math.exp(dict(resemblances(state))["viscoelasticity",]) == pytest.approx(one, rel=1e-6)


def test_an_error_of_form_does_not_have_the_odds_of_effects_that_come_together(coupon, monkeypatch):
    """Softening beside a set has the odds of both together; an error of form does not."""
    world = World(coupon, **{"mullins.inverse_r": 3.0, "permanent_set.set": 0.3})
    started = tuple(ActiveEffect(effect(name)).with_start_values() for name in ("mullins", "permanent_set"))
    model = replace(world.base.model, effects=started)
    state = State(world.problem, world.fit(world.one.case, model, None))
    together, filled = dict(resemblances(state)), prior.FILLED
    monkeypatch.setattr(prior, "FILLED", 1.0)
    apart = dict(resemblances(state))
    ratios = {removed: together[removed] - apart[removed] for removed in together}
    assert ("permanent_set",) in ratios
    assert ratios == pytest.approx(dict.fromkeys(ratios, -math.log(filled)))


@pytest.mark.parametrize("times", [0.3, 0.999, 1.001, 20.0])
def test_it_resembles_no_effect_that_is_larger_than_its_prior_admits(coupon, times):
    """Beyond the 95 % range the error is as improbable as the effect, whose density is in the evidence."""
    state = pair(coupon, 3.0, 0.5)
    active = next(one for one in state.model.effects if one.effect.name == "permanent_set")
    known = state.priors["permanent_set.set"]
    end = known.prior.range(known.scales)[1]
    found = resemblance._log_density_of_size(
        state, replace(active, values={**active.values, "set": times * end})
    )
    at = min(times, 1.0) * end
    signs = 1.0 if known.one_sided else 2.0
    density = signs * at * math.exp(known.prior.log_density(at, known.scales))
    assert found == pytest.approx(math.log(density))


def test_the_error_of_a_law_resembles_effects_without_memory_only(coupon, monkeypatch):
    state = pair(coupon, 0.2, 0.1)
    both = "drift", "permanent_set"
    assert both not in dict(resemblances(state))
    # Taken to be without memory, both are errors of the law, as large as a share of the force.
    for one in state.model.effects:
        monkeypatch.setitem(one.effect.__dict__, "has_memory", False)
    signal = math.sqrt(state.problem.likelihood.signal.sum())
    names = "drift.rate", "permanent_set.set"
    ratio = math.prod(
        expected(state, name, own_size(state, name, names), LAMBDA * signal, LAMBDA_SPREAD) for name in names
    )
    assert math.exp(dict(resemblances(state))[both]) == pytest.approx(ratio, rel=1e-6)


def test_the_error_of_an_effect_without_memory_resembles_none_that_has_one(coupon, monkeypatch):
    state = pair(coupon, 3.0, 0.5)
    assert ("permanent_set",) in dict(resemblances(state))
    drift = next(one for one in state.model.effects if one.effect.name == "drift")
    monkeypatch.setitem(drift.effect.__dict__, "has_memory", False)
    assert ("permanent_set",) not in dict(resemblances(state))


def test_the_error_of_a_rig_is_not_in_the_channel_of_another(coupon, monkeypatch):
    """Effects of two rigs: neither is the error of the other, whatever their sizes."""
    state = pair(coupon, 3.0, 0.5)
    assert ("permanent_set",) in dict(resemblances(state))
    for one, channel in zip(state.model.effects, ("axial", "radial"), strict=True):
        monkeypatch.setitem(one.__dict__, "channels", (channel,))
    assert dict(resemblances(state)) == {}


@pytest.mark.parametrize(
    ("name", "beside", "changes", "seen"),
    [
        ("time_lag", ("viscoelasticity",), {"static": 0.1, "dynamic": 2.0}, True),
        ("time_lag", ("viscoelasticity",), {"static": 2.0, "dynamic": 0.1}, False),
        ("fixture_mass", ("viscoelasticity",), {"dynamic": 1.0}, True),
        ("time_lag", ("payne",), {"dynamic": 1.0}, True),
        ("time_lag", ("viscoelasticity", "fixture_mass"), {"dynamic": 1.0}, True),
        ("time_lag", ("fixture_mass",), {"dynamic": 1.0}, False),
        ("time_lag", ("viscoelasticity", "compressibility"), {"dynamic": 1.0}, False),
        ("payne", ("viscoelasticity",), {"dynamic": 1.0}, False),
        ("gain", ("viscoelasticity",), {"dynamic": 1.0}, False),
    ],
)
def test_the_error_of_relaxation_in_a_table_is_no_effect_of_the_rig(name, beside, changes, seen):
    """Branches follow any relaxation; a lag or a mass is nothing that a relaxation does."""
    active = ActiveEffect(effect(name)).with_start_values()
    amplitude = active.full_name(active.effect.amplitudes[0])
    state = SimpleNamespace(
        problem=SimpleNamespace(
            recordings=[SimpleNamespace(name=kind, mode="axial", kind=kind) for kind in changes]
        ),
        fitted=SimpleNamespace(names=(amplitude,), x=np.array([3.0])),
        slopes=[np.full((4, 1), change) for change in changes.values()],
    )
    others = [ActiveEffect(effect(other)) for other in beside]
    assert resemblance._is_no_error_of_relaxation(state, active, others) == seen


@pytest.mark.usefixtures("everywhere")
def test_a_fit_without_the_effects_says_what_the_rest_cannot_imitate(coupon):
    """First order lets the law imitate what its bounds, or its curvature, do not."""
    state = pair(coupon, 3.0, 0.5)
    gone = ("permanent_set",)
    less = state.without(gone)
    before = dict(resemblances(state))[gone]
    as_good = State(state.problem, replace(less.fitted, simulated=state.fitted.simulated))
    assert dict(resemblances(state, fits={less.model.structure: as_good}))[gone] == pytest.approx(before)
    # The same model, with a misfit as large as what the drift explains.
    fitted = replace(
        less.fitted, simulated=tuple(np.zeros_like(force) for force in less.fitted.simulated), converged=True
    )
    far = State(state.problem, fitted)
    # What remains is the limit by the change with all other parameters held.
    held = whole_size(state, "permanent_set.set") / whole_size(state, "drift.rate")
    most = expected(state, "permanent_set.set", held, PHI, PHI_SPREAD, PHI_MOST)
    found = math.exp(dict(resemblances(state, fits={less.model.structure: far}))[gone])
    assert found == pytest.approx(most, rel=1e-6)
    assert found != pytest.approx(math.exp(before), rel=0.1)
    # A fit that was given up says nothing.
    abandoned = State(state.problem, replace(fitted, converged=False))
    assert dict(resemblances(state, fits={less.model.structure: abandoned}))[gone] == pytest.approx(before)


def test_an_error_is_where_its_effect_acts():
    """In two branches the stop does nothing: an offset of 6 there is none of its errors."""
    offset = Size(12.0, 9.0, np.array([6.0, 6.0, 6.0]), np.array([6.0, 6.0, 3.0]))
    stop, lag = (
        Size(0.0, 0.0, np.array(whole), np.zeros(3)) for whole in ([0.0, 0.0, 40.0], [4.0, 2.0, 4.0])
    )
    assert offset.beyond([stop]) == pytest.approx(math.hypot(6.0, 6.0))
    assert offset.beyond([stop, lag]) == pytest.approx(math.hypot(6.0 - 4.0 * PHI_MOST, 6.0 - 2.0 * PHI_MOST))
    assert offset.beyond([offset]) == pytest.approx(math.hypot(6.0 - 6.0 * PHI_MOST, 6.0 - 6.0 * PHI_MOST))


def test_where_the_others_do_nothing_only_the_law_may_be_as_wrong(coupon, monkeypatch):
    state = pair(coupon, 3.0, 0.5)
    with monkeypatch.context() as patch:
        patch.setattr(Size, "beyond", lambda *_: 0.0)
        free = dict(resemblances(state))["permanent_set",]
    signal = math.sqrt(state.problem.likelihood.signal.sum())
    for times, sigmas in ((0.5, 0.0), (1.0, 0.0), (4.0, math.log(4.0) / LAMBDA_SPREAD)):
        with monkeypatch.context() as patch:
            patch.setattr(Size, "beyond", lambda *_, size=times * LAMBDA * signal: size)
            found = dict(resemblances(state))["permanent_set",]
        assert found == pytest.approx(free - 0.5 * sigmas**2)
    # The branches of the recording, with the norms of the whole.
    drift, set_ = (Size.of(state, one, ()) for one in state.model.effects)
    for size in (drift, set_):
        assert np.linalg.norm(size.whole_by_branch) == pytest.approx(size.whole)
        assert np.linalg.norm(size.own_by_branch) == pytest.approx(size.own)
    assert len(drift.whole_by_branch) == len(state.problem.recordings[0].branches)


def test_an_effect_as_large_as_all_others_is_no_error_of_form(coupon):
    found = dict(resemblances(pair(coupon, 3.0, 3.0)))
    assert ("permanent_set",) not in found
    assert ("drift",) not in found


@pytest.mark.usefixtures("everywhere")
def test_a_small_second_effect_is_not_taken_for_certain(coupon, monkeypatch):
    """The same recording with and without such errors of form: certain, and probable at most."""
    world = World(coupon, **{"drift.rate": 3.0, "permanent_set.set": 1.1})
    found = world.search(monkeypatch)
    said = probabilities(posterior(found), NAMES)
    assert said["drift"] > 0.95
    assert said["permanent_set"] < 0.9
    monkeypatch.setattr(resemblance, "RESEMBLES", 1e-9)
    assert probabilities(posterior(found), NAMES)["permanent_set"] > 0.95


@pytest.mark.usefixtures("everywhere")
def test_the_most_probable_model_is_fitted_even_if_the_search_gave_it_up(coupon, monkeypatch):
    # So small a set that the drift alone, which is taken away, is the most probable model.
    world = World(coupon, **{"drift.rate": 3.0, "permanent_set.set": 0.7})
    found = world.search(monkeypatch)
    for key, state in list(found.states.items()):
        if state.model.identities == ("drift",):
            del found.states[key]
            for key in [k for k, one in found.waiting.items() if one.base is state]:
                del found.waiting[key]
    models = posterior(found)
    # One row for each, with the evidence that its probability needs.
    rows = [one for one in models if one.predicted is not None and one.model.structure not in found.waiting]
    assert len({(one.model.structure, one.unknown) for one in rows}) == len(rows) > 0
    weights = [one.log_evidence + found.odds(one.model, unknown=one.unknown) for one in rows]
    shares = [math.log(one.probability) for one in rows]
    assert np.subtract(weights, shares) == pytest.approx(np.full(len(rows), weights[0] - shares[0]))
    asked = next(unfitted_models(models))
    assert asked.model.identities == ("drift",)
    world.always = True
    found.fit_anyway(asked)
    again = posterior(found)
    assert not list(unfitted_models(again))
    assert again[0].effects == ("drift",)
    assert again[0].predicted is None
    assert sum(one.probability for one in again) == pytest.approx(1.0, abs=1e-9)


def test_the_search_goes_on_if_a_model_that_the_report_shows_predicts_others_that_matter(coupon, monkeypatch):
    """Foreign 057 of the decks ended as "not diagnosed": the last fit had opened the whole posterior again."""
    world = World(coupon, **{"drift.rate": 3.0, "permanent_set.set": 1.0})
    found = world.search(monkeypatch)
    key, other = list(found.waiting)[:2]
    shown = [[found.waiting[key]], []]
    monkeypatch.setattr("bushcli.diagnosis.posterior.unfitted_models", lambda models, tried: shown.pop(0))
    fit_anyway = found.fit_anyway

    def opened(one):
        world.always = True
        fit_anyway(one)
        world.always = False
        found.waiting[other] = replace(found.waiting[other], slack=1000.0, limit=math.inf)
        assert found.share_left > 0.99

    monkeypatch.setattr(found, "fit_anyway", opened)
    assert run_with_shown(found) == "nothing left"
    assert {key, other} <= found.states.keys()
    assert found.share_left < LEFT
    assert not shown


# Two cycles of unequal amplitude, at the same displacements on every branch.
LOOPS = np.concatenate(
    [np.linspace(a, b, 41)[1:] for a, b in [(0, 2), (2, -2), (-2, 2), (2, 0), (0, 4), (4, -4), (-4, 0)]]
)


@pytest.mark.parametrize("name", list(effects()))
def test_memory_is_declared_where_the_force_depends_on_the_past(name):
    one = effect(name)
    if one.feature is not None:
        words = {p.name: p.choices[0] for p in one.parameters if p.choices}
        assert one.has_memory == (one.feature(**words).branches is not None)
        return
    path = np.concatenate([[0.0], LOOPS])
    stiff = lambda q: (300.0 * q, np.full(len(q), 300.0), np.zeros((len(q), 0)))  # noqa: E731
    time = np.arange(len(path), dtype=float)
    force = elastic_response([ActiveEffect(one).with_start_values()], path, time, stiff, ()).value
    spread = max(np.ptp(force[np.isclose(path, q, atol=1e-9)]) for q in np.unique(np.round(path, 9)))
    assert one.has_memory == (spread > 1e-6 * np.ptp(force))
