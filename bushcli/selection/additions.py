"""Models of which first order says too little: those that relax, and poor effects with one branch more."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect, effect_in_force_law
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.selection.columns import trials
from bushcli.selection.derivatives import Derivatives
from bushcli.selection.model import Key, Model
from bushcli.selection.predict import Beside
from bushcli.selection.queued import Queued, slack_of
from bushcli.selection.state import CommonData, State

# Moduli of all branches together over the law's where their fit begins: what tables of filled rubber show in three
# decades is 0.1 to 0.6.
START = 0.3
# Modulus of a branch that a fit has left out.
FAINTEST = 1e-3
# Parts of a force law whose stress relaxes in a rest.
RELAXING = frozenset({"maxwell", "clock"})


class Fits(Protocol):
    """Fitted models and their weights, as a search has them."""

    problem: CommonData
    states: dict[Key, State]
    derivatives: Derivatives

    @property
    def total(self) -> float:
        """Logarithm of the sum of all posterior weights."""

    def weights(self, state: State) -> tuple[float, float]:
        """Logarithm of the posterior weight of a model, without and with the unknown effect."""

    def odds(self, model: Model) -> float:
        """Logarithm of the prior odds of a model against the plain law."""


def with_branch_more(fits: Fits, tried: Collection[Key], share: float) -> Iterator[Queued]:
    """Yield fitted single effects, the most probable first, with one branch more, where that may matter.

    First order says little of a further branch beside a fit that is far from the recordings: of a rig that grows softer
    under load one of constant compliance left 3.5 times the noise, and beside it a gain of 84 nats was predicted where
    144 were found (foreign 027, `benchmarks/decks`). A branch may gain twice what is predicted.

    Parameters
    ----------
    fits : Fits
    tried : collection of Key
        Models that are left out.
    share : float
        Least share of the posterior that a model must be able to reach.
    """
    least = fits.total + math.log(share)
    for state in sorted(fits.states.values(), key=lambda state: -fits.weights(state)[0]):
        own = [active.effect for active in state.model.effects if active.can_branch]
        missing = fits.problem.likelihood.log_without_misfit - state.evidence.judgement.log
        most = fits.weights(state)[0] + missing
        if len(state.model.effects) != 1 or not own or most < least:
            continue
        for more in Beside(state, fits.derivatives.additions_beside(state, among=own)).singles():
            odds, slack = fits.odds(more.model), slack_of(more.reach)
            queued = Queued(more.model, state, more.log_evidence, odds, slack, more.gain, most)
            if more.model.structure not in tried and queued.optimistic_weight > least:
                yield queued


def relaxing_models(fits: Fits, plain: Model, catalogue: Sequence[Effect]) -> Iterator[Model]:
    """Yield models that relax, with which a search begins where there are tables; each after the fit of the last one.

    No rubber is without loss, so that a law alone is too far from any table for its neighbours to be judged beside it:
    one branch of relaxation and more, whose times divide the range that tables show, and a spectrum over it.
    Temperature and amplitude change a table as much, where it has several; how relaxation depends on the amplitude is
    refined, too.
    """
    case, recordings, shear = fits.problem.case, fits.problem.recordings, fits.derivatives.shear
    vibrating = [recording for recording in recordings if isinstance(recording, RecordedTable)]
    if not vibrating:
        return
    fast = min(recording.times[0] for recording in vibrating)
    slow = max(recording.times[1] for recording in vibrating)
    maxwell, model = effect_in_force_law("maxwell"), replace(plain, anchor=plain.start)
    for count in range(1, maxwell.branches + 1) if maxwell in catalogue else ():
        own = np.geomspace(slow, fast, count + 2)[1:-1]
        values = {f"tau{i}": float(tau) for i, tau in enumerate(own, start=1)}
        values |= {f"g{i}": START / count for i in range(1, count + 1)}
        model = replace(model, effects=(ActiveEffect(maxwell, values).with_start_values(),))
        yield model
    relaxed = [model]
    if maxwell in catalogue:
        # A decade more to each side; its modulus per decade is as steep as the branches that were fitted last.
        decades, slope = math.log10(slow / fast) + 2.0, 0.0
        if model.structure in fits.states:
            fitted = fits.states[model.structure].model.effects[0].values
            moduli = [math.log(max(fitted[f"g{i}"], FAINTEST)) for i in range(1, maxwell.branches + 1)]
            times = [math.log(fitted[f"tau{i}"]) for i in range(1, maxwell.branches + 1)]
            slope = float(np.clip(np.polyfit(times, moduli, 1)[0], -1.0, 1.0))
        g = START / decades / math.sqrt(fast * slow) ** slope
        values = {"g1": g, "tau1": 10.0 * slow, "decades": decades, "slope": slope}
        model = replace(model, effects=(ActiveEffect(maxwell, values).with_start_values(),))
        yield model
        relaxed.append(model)
    thinned = [
        effect
        for effect in catalogue
        if effect.needs_amplitudes and trials(case, plain, effect, vibrating, shear)[0]
    ]
    for effect in thinned:
        active = ActiveEffect(effect).with_start_values()
        for finer in ({}, *({p.name: p.start} for p in effect.parameters if p.of_amplitude)):
            model = replace(model, effects=(replace(active, values=dict(active.values) | finer),))
            yield model
            if model.structure in fits.states:
                (active,) = fits.states[model.structure].model.effects
        relaxed.append(model)
    for warm in (effect for effect in catalogue if effect.needs_temperature):
        solved = (fits.states[model.structure] for model in relaxed if model.structure in fits.states)
        for beside in (state.model for state in solved):
            for trial in trials(case, beside, warm, recordings, shear)[0]:
                start = {name: warm.parameter(name).start for name in trial.amplitudes}
                active = replace(trial.active, values=dict(trial.active.values) | start)
                yield replace(trial, active=active).add_to(beside)


def unthinned(model: Model, catalogue: Collection[Effect]) -> Iterator[Model]:
    """Yield the model with viscoelasticity of the same spectrum in place of a Payne effect: no motion thins it."""
    maxwell = effect_in_force_law("maxwell")
    relaxing = [active for active in model.effects if active.effect.in_force_law in RELAXING]
    if maxwell not in catalogue or [active.effect.in_force_law for active in relaxing] != ["clock"]:
        return
    values = relaxing[0].values
    spectrum = {"g1": "g", "tau1": "tau", "decades": "decades", "slope": "slope"}
    start = {name: values[own] for name, own in spectrum.items()}
    others = tuple(active for active in model.effects if active is not relaxing[0])
    yield replace(model, effects=(ActiveEffect(maxwell, start), *others))
