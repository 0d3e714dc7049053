"""First-order predictions: on a linear problem they equal the evidence of the exact fit."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, lsq_linear, minimize

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.evidence.density import SETTLED
from bushcli.evidence.laplace import Evidence
from bushcli.evidence.prior import known_parameters
from bushcli.inverse.problem import STABILITY_MARGIN
from bushcli.likelihood.form import Left
from bushcli.selection.columns import Candidate, columns, trials
from bushcli.selection.fit import TURNS
from bushcli.selection.law_edge import LawEdge
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import FAINT, Addition, reachable_likelihood
from bushcli.selection.queued import SLACK
from bushcli.selection.state import State
from tests.linear import World


@pytest.fixture(scope="module")
def made(coupon):
    return coupon("yeoh", set_=0.03)


def addition(one, name, column, **values):
    """An effect whose first amplitude changes the stress by a column (n,)."""
    found = effect(name)
    amplitudes = tuple(p.name for p in found.amplitudes)
    off = {p.name: float(p.off) for p in found.amplitudes}
    slopes = np.zeros((len(column), len(amplitudes)))
    slopes[:, 0] = column
    trial = Candidate(ActiveEffect(found, {**off, **values}).with_start_values(), amplitudes[:1], values)
    return Addition(trial, (one.problem.likelihood.features[0].of(slopes[:, :1]),))


def exactly(one, *added):
    """Evidence and amplitudes of the linear problem at its exact minimum, in the fit's units."""
    state = one.state
    J = np.hstack([state.slopes[0], *(a.slopes[0] for a in added)])
    actives = tuple(a.trial.active for a in added)
    shear = 2.0 * state.fitted.values["C10"]
    priors = known_parameters(one.case, actives, shear, one.recordings)
    known = [priors[f"{a.trial.active.name}.{a.trial.amplitudes[0]}"] for a in added]
    features, variance = one.problem.likelihood.features[0], one.problem.variances[0]
    p = len(state.fitted.x)
    best = np.zeros(J.shape[1])
    low = np.full(J.shape[1], -np.inf)
    low[p:] = [0.0 if k.one_sided else -np.inf for k in known]
    ends = []
    # Alternate with the variance that follows from the likelihood, as fits and predictions do; the best end counts.
    for _ in range(1 + TURNS):
        whitened, misfit = features.whiten(J, variance), features.whiten(state.misfit[0], variance)
        for _ in range(100):
            # The weight of a prior is that at the end of the previous step.
            rows = np.zeros((len(added), J.shape[1]))
            for i, k in enumerate(known):
                rows[i, p + i] = np.sqrt(k.pull(float(best[p + i])))
            best = lsq_linear(
                np.vstack([whitened, rows]),
                -np.concatenate([misfit, np.zeros(len(added))]),
                (low, np.inf),
                method="bvls",
                tol=1e-14,
            ).x
        found = Evidence(
            one.problem.likelihood,
            [state.misfit[0] + J @ best],
            [J],
            np.concatenate([state.fitted.x, best[p:]]),
            [*state.parameter_priors, *known],
            [0.0] * J.shape[1],
        )
        ends.append((found.log, best[p:]))
        (scale,) = found.judgement.scale
        if max(scale / variance, variance / scale) < SETTLED:
            break
        variance = scale
    return max(ends, key=lambda end: end[0])


def loop(one, size=0.5):
    return size * np.sign(np.gradient(one.strain)) * np.sin(np.pi * one.strain / one.strain.max())


def test_a_prediction_is_the_evidence_after_the_exact_fit(made):
    for sign in (1.0, -1.0):
        added = addition(made, "permanent_set", sign * loop(made))
        (found,) = Beside(made.state, [added]).singles()
        log, best = exactly(made, added)
        assert found.log_evidence == pytest.approx(log, abs=1e-3)
        (active,) = found.model.effects
        if best[0] > 0.0:
            assert active.values["set"] == pytest.approx(best[0], rel=1e-4)


def test_variances_settle_only_where_a_fit_may_matter(made):
    fitted = made.state.fitted
    far = State(
        made.problem, replace(fitted, simulated=tuple(force - loop(made, 0.2) for force in fitted.simulated))
    )
    added = [addition(made, "permanent_set", loop(made)), addition(made, "drift", 1e-3 * loop(made))]
    settled, rough = (Beside(far, added).singles(least) for least in (-np.inf, np.inf))
    best, faint = (one.log_evidence for one in settled)
    assert best > faint + 1.0
    assert rough[0].log_evidence < best - 0.1
    # The first may reach what it has when it has settled, the second may not.
    first, second = Beside(far, added).singles(best)
    assert first.log_evidence == best
    assert second.log_evidence == rough[1].log_evidence


def test_an_amplitude_that_cannot_be_negative_is_not(made):
    """One sign of a column helps; with the other the effect stays off and costs evidence, as any useless effect."""
    here, there = (
        Beside(made.state, [addition(made, "permanent_set", sign * loop(made))]).singles()[0]
        for sign in (1.0, -1.0)
    )
    worse, better = sorted((here, there), key=lambda one: one.log_evidence)
    assert better.log_evidence > worse.log_evidence + 1.0
    assert worse.log_evidence < made.state.evidence.log
    # A fit starts inside the bounds, because a search cannot start at one.
    assert 0.0 < worse.model.effects[0].values["set"] < 0.05


def test_one_that_can_have_either_sign_is_found_with_both(made):
    here, there = (
        Beside(made.state, [addition(made, "drift", sign * loop(made))]).singles()[0] for sign in (1.0, -1.0)
    )
    assert here.log_evidence == pytest.approx(there.log_evidence, abs=1e-6)
    a, b = (one.model.effects[0].values["rate"] for one in (here, there))
    assert a == pytest.approx(-b)


def test_pairs_are_fitted_together(made):
    """Two similar changes: together they gain less than the sum of what each gains."""
    set_ = addition(made, "permanent_set", loop(made))
    drift = addition(made, "drift", loop(made) + 0.01 * made.time / made.time[-1])
    (found,) = Beside(made.state, [set_, drift]).pairs()
    log, best = exactly(made, set_, drift)
    assert found.log_evidence == pytest.approx(log, abs=1e-3)
    assert {one.name for one in found.model.effects} == {"permanent_set", "drift"}
    values = found.model.values
    assert values["drift.rate"] == pytest.approx(best[1], rel=2e-3)


def test_points_of_a_grid_are_averaged(made):
    """The evidence is integrated over a shape parameter: one good point of two has half the weight."""
    good = addition(made, "permanent_set", loop(made))
    bad = addition(made, "permanent_set", 1e-6 * loop(made))
    single = [Beside(made.state, [one]).singles()[0].log_evidence for one in (good, bad)]
    (found,) = Beside(made.state, [good, bad]).singles()
    assert found.log_evidence == pytest.approx(np.logaddexp(*single) - np.log(2.0))


def test_what_the_law_does_itself_is_no_share_of_its_own(made):
    column = made.state.fitted.jacobians[0] @ np.array([1.0, 0.5, -0.2])
    beside = Beside(made.state, ())
    whole, own = beside.changes(addition(made, "drift", column))
    assert own < 1e-6 * whole
    whole, own = beside.changes(addition(made, "drift", loop(made)))
    assert own > 0.3 * whole


@pytest.mark.parametrize("name", ["permanent_set", "drift", "warming", "time_lag"])
def test_predictions_of_the_catalogue_are_what_fits_bring(made, name):
    """From real derivatives on a coupon, as accurately as the search assumes."""
    some, reason = trials(made.case, made.state.model, effect(name), made.recordings, 1.0)
    assert some, reason
    features = made.problem.likelihood.features[0]
    (points,) = columns(made.cache, made.case, made.state.model, some)
    added = [Addition(trial, (features.of(column),)) for trial, column in zip(some, points, strict=True)]
    predictions = Beside(made.state, added).singles()
    assert len(predictions) == 1 + len(effect(name).variants)
    for found in predictions:
        state = made.fit(found.model, made.state)
        gained, predicted = (
            log - made.state.evidence.log for log in (state.evidence.log, found.log_evidence)
        )
        assert predicted == pytest.approx(gained, abs=max(SLACK, 0.3 * abs(gained)))


def test_beside_a_parameter_that_its_bound_holds_nothing_is_gained_beyond_the_bound(coupon, monkeypatch):
    """A negative set is impossible: a drift is predicted beside no set, as the fit of both finds it."""
    world = World(coupon, **{"permanent_set.set": -3.0, "drift.rate": 2.0})
    found = world.search(monkeypatch, deadline=time.perf_counter() - 1.0)
    drift, held = (ActiveEffect(effect(name)).with_start_values() for name in ("drift", "permanent_set"))
    model = world.base.model

    def fitted(*active):
        return State(world.problem, world.fit(world.one.case, replace(model, effects=active), None))

    alone, both = fitted(held), fitted(drift, held)
    assert alone.model.values["permanent_set.set"] == pytest.approx(0.0, abs=1e-9)
    beside = Beside(alone, found.derivatives.additions_beside(alone, False))
    predicted = next(one for one in beside.singles() if one.model.identities == ("drift", "permanent_set"))
    assert predicted.log_likelihood == pytest.approx(both.evidence.judgement.log, abs=0.1)
    # What the set would gain beyond its bound.
    nothing = np.zeros(len(alone.fitted.x), dtype=bool)
    monkeypatch.setattr(State, "held_parameters", lambda self, misfit, slopes: (nothing, self.fitted.x))
    free = Beside(alone, found.derivatives.additions_beside(alone, False))
    wrong = next(one for one in free.singles() if one.model.identities == ("drift", "permanent_set"))
    assert wrong.log_likelihood > predicted.log_likelihood + 2.0


def test_first_order_takes_a_parameter_to_its_bound_and_no_further(coupon, monkeypatch):
    """The data ask for a negative set, which is impossible: from 0.3, first order arrives at the fit with none."""
    world = World(coupon, **{"permanent_set.set": -3.0})
    active = ActiveEffect(effect("permanent_set")).with_start_values()
    best = world.fit(world.one.case, replace(world.base.model, effects=(active,)), None)
    (i,) = (i for i, name in enumerate(best.names) if name.startswith("permanent_set"))
    assert best.x[i] == pytest.approx(0.0, abs=1e-9)
    step = np.zeros(len(best.x))
    step[i] = 0.3
    forces = zip(best.simulated, best.jacobians, strict=True)
    off = replace(best, x=best.x + step, simulated=tuple(force + J @ step for force, J in forces))
    beside = Beside(State(world.problem, off), ())
    expected = State(world.problem, best).evidence.judgement.log
    assert State(world.problem, off).evidence.judgement.log < expected - 0.1
    assert beside.alone().log_likelihood == pytest.approx(expected, abs=0.05)
    # Exactly at the bound: an amplitude below its least value, if only by rounding, would be impossible.
    held, values = State(world.problem, off).held_parameters(*beside._whole)
    assert held[i]
    assert values[i] == 0.0
    assert np.isfinite(beside.alone().log_evidence)


def test_an_effect_that_explains_most_may_explain_all(made):
    """A quarter more than predicted; one that explains little stays where it is."""
    likelihood = made.problem.likelihood
    channels, whole = len(likelihood.features), np.array([1e4])
    before = Left(whole, np.zeros(channels), whole)

    def after(left):
        return Left(np.array([left]), np.zeros(channels), np.array([left]))

    noise = likelihood.judge(after(0.0)).log
    assert reachable_likelihood(likelihood, before, after(1.9e3)) == pytest.approx(noise)
    little = after(9.9e3)
    expected = likelihood.judge(after(9.9e3 - 25.0)).log
    assert reachable_likelihood(likelihood, before, little) == pytest.approx(expected)
    assert expected < noise - 3.0


@pytest.fixture
def beyond(made):
    """A fit at the edge of its law's stability, whose first-order optimum is beyond."""
    state = made.state
    x, names = state.fitted.x, state.fitted.names
    way = np.array([{"C10": 0.1, "C20": -0.25, "C30": 0.0}[name] for name in names])
    edge = LawEdge(state, state.fitted.x)
    at = brentq(lambda t: edge.margins(x + t * way).min() - 0.002, 0.0, 1.0)
    forces = zip(state.fitted.simulated, state.fitted.jacobians, strict=True)
    simulated = tuple(force - J @ ((1.0 - at) * way) for force, J in forces)
    return State(made.problem, replace(state.fitted, x=x + at * way, simulated=simulated))


def test_first_order_takes_a_law_to_its_edge_of_stability_and_no_further(beyond, monkeypatch):
    """The same least-squares problem with the exact margins as constraints, by SciPy's SLSQP."""
    beside, edge = Beside(beyond, ()), LawEdge(beyond, beyond.fitted.x)
    misfit, slopes = beside._whole
    x, size = beyond.fitted.x, np.linalg.norm(slopes, axis=0)
    free = x - np.linalg.lstsq(slopes, misfit)[0]
    assert edge.margins(free).min() < -0.1

    def cost(s):
        rest = misfit + slopes @ (s / size)
        return 0.5 * float(rest @ rest), slopes.T @ rest / size

    margins = {"type": "ineq", "fun": lambda s: edge.margins(x + s / size)}
    exact = minimize(cost, np.zeros(len(x)), jac=True, method="SLSQP", constraints=[margins])
    assert exact.success
    found = beside._solve_amplitudes(())[0]
    cuts = beside.edge.cuts.after(beside._tangent.values - beyond.fitted.x)
    held = beside._tangent.active(cuts, np.zeros(len(misfit)))
    optimum = beside._tangent.within(cuts.only(held)).optimum(np.zeros(len(misfit)))
    assert edge.margins(optimum).min() > -0.02
    rest = np.concatenate(
        [
            f.whiten(left, v)
            for f, left, v in zip(found.likelihood.features, found.misfit, beside.variances, strict=True)
        ]
    )
    assert 0.5 * rest @ rest == pytest.approx(exact.fun, rel=0.01)
    # Without the edge, first order promises what no fit can reach.
    reached = beside.alone().log_likelihood
    monkeypatch.setattr(LawEdge, "cut_off", lambda self, x: False)
    assert Beside(beyond, ()).alone().log_likelihood > reached + 5.0


def test_an_effect_that_explains_nothing_is_promised_nothing(made):
    fitted = made.state.fitted
    far = State(
        made.problem, replace(fitted, simulated=tuple(force - loop(made, 0.2) for force in fitted.simulated))
    )
    clear, faint = (addition(made, "permanent_set", size * loop(made)) for size in (1.0, 1e-9))
    (found,) = Beside(far, [faint]).singles()
    assert found.gain < FAINT
    assert found.hope == pytest.approx(0.0, abs=1e-3)
    (found,) = Beside(far, [clear]).singles()
    assert found.gain > FAINT
    assert found.hope > 0.0


def test_a_fit_far_from_the_edge_is_not_held_back(made):
    edge = LawEdge(made.state, made.state.fitted.x)
    x = made.state.fitted.x
    unstable = np.array(
        [-9.0 if name == "C20" else value for name, value in zip(made.state.fitted.names, x, strict=True)]
    )
    assert edge.margins(unstable).min() < 0.0 < edge.margins(x).min()
    assert not edge.is_active
    assert not edge.cut_off(unstable)


def test_a_fit_that_ends_before_an_optimum_beyond_the_edge_is_held_back(beyond):
    """However far from the edge it has ended: the search found no way there."""
    x = beyond.fitted.x
    inside = np.array([1.0 if name == "C10" else 0.8 for name in beyond.fitted.names]) * x
    assert LawEdge(beyond, x).margins(inside).min() > STABILITY_MARGIN
    forces = zip(beyond.fitted.simulated, beyond.fitted.jacobians, strict=True)
    simulated = tuple(force + J @ (inside - x) for force, J in forces)
    early = State(beyond.problem, replace(beyond.fitted, x=inside, simulated=simulated))
    assert not LawEdge(early, inside).is_active
    edge = Beside(early, ()).edge
    assert edge.margins(edge.optimum).min() < 0.0
    assert edge.is_active


def test_a_law_of_one_parameter_has_no_edge(coupon):
    state = coupon().state
    assert not LawEdge(state, state.fitted.x).is_active
    assert not LawEdge(state, state.fitted.x).cut_off(-state.fitted.x)
