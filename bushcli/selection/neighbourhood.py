"""Models near a fitted one: what its fit says of them to first order, and by how much that may be wrong.

Beside a fitted model others are predicted with one effect more (or a branch more), with two more beside the plain law,
with fewer effects, with one in place of others, and with another law. They enter the queue of the search.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Protocol

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect
from bushcli.evidence.stopping_rule import NEGLIGIBLE
from bushcli.selection.additions import Fits
from bushcli.selection.columns import incompatibility
from bushcli.selection.model import Key, Model
from bushcli.selection.neighbours import other_laws, without_effects
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import FAINT, Addition, Prediction
from bushcli.selection.queued import FAR, Queued, Waiting, slack_of
from bushcli.selection.state import State

# Largest number of effects in a model: no recording so far could distinguish more.
MOST_EFFECTS = 3
# Least share of the posterior for the neighbours of a fitted model to be tried. Other values change probabilities by
# less than 0.002 (`benchmarks/constants.md`).
NEIGHBOURS = 0.01
# Factor on the predicted gain, from which the slack follows, if the derivatives are those beside the plain law:
# judgement, since beside the fitted effects they differ by an unknown share.
BORROWED = 2.0


class Searched(Fits, Protocol):
    """What is known of a search: its fitted models and their weights, and its queue."""

    plain: State
    catalogue: Sequence[Effect]
    waiting: Waiting

    def put(self, queued: Queued) -> None:
        """Add the prediction of a model that is not fitted."""


class Neighbourhood:
    """Predictions beside the fitted models of a search.

    Parameters
    ----------
    search : Searched
    """

    def __init__(self, search: Searched) -> None:
        self._search = search
        self._beside_plain: Mapping[str, list[Addition]] = {}
        self._borrowed: dict[Key, Beside] = {}

    def beside(self, state: State) -> Beside:
        """Return further effects with their derivatives beside a model, or beside the plain law where that will do.

        The derivative beside the plain law is a fair estimate. Where it predicts no visible gain beside the model, by a
        factor of `BORROWED`, or a model whose neighbours would not be tried, the effect is not solved anew.

        Parameters
        ----------
        state : State
        """
        search = self._search
        if state is search.plain or not state.model.effects:
            return Beside(state, search.derivatives.additions_beside(state, state is search.plain))
        borrowed, least = self._with_borrowed(state), search.total + math.log(NEIGHBOURS)
        silent, visible = {points[0].trial.effect.name for points in borrowed.grouped.values()}, set[str]()
        predictions = borrowed.singles(self._least(state), _borrowed_slack)
        for points, prediction in zip(borrowed.grouped.values(), predictions, strict=True):
            most = prediction.log_evidence + _borrowed_slack(prediction.reach)
            if BORROWED * prediction.gain >= FAINT and most + search.odds(prediction.model) > least:
                visible.add(points[0].trial.effect.name)
        silent -= visible
        among = [effect for effect in search.catalogue if effect.name not in silent]
        every = [addition for points in borrowed.grouped.values() for addition in points]
        own = [
            *search.derivatives.additions_beside(state, among=among),
            *(addition for addition in every if addition.trial.effect.name in silent),
        ]
        return Beside(state, own, before=borrowed)

    def lend(self, beside: Beside) -> None:
        """Keep the derivatives beside the plain law, which serve beside other models, too.

        Parameters
        ----------
        beside : Beside
        """
        self._beside_plain = beside.grouped

    def _with_borrowed(self, state: State) -> Beside:
        """Return further effects with their derivatives beside the plain law."""
        key = state.model.structure
        if key not in self._borrowed or self._borrowed[key].state is not state:
            every = [addition for points in self._beside_plain.values() for addition in points]
            self._borrowed[key] = _without_own(state, every)
        return self._borrowed[key]

    def queue_borrowed(self, state: State) -> None:
        """Queue models with one effect more, whose derivatives are those beside the plain law.

        The prediction of a pair beside the plain law has the errors of both effects; here one of the two is fitted.

        Parameters
        ----------
        state : State
        """
        if self._beside_plain and len(state.model.identities) < MOST_EFFECTS:
            for prediction in self._with_borrowed(state).singles(self._least(state), _borrowed_slack):
                self.queue(prediction, state, _borrowed_slack(prediction.reach))

    def _least(self, state: State) -> float:
        """Return the log evidence with which a model that has more effects than this one may matter."""
        return self._search.total - self._search.odds(state.model) + math.log(NEGLIGIBLE)

    def queue_larger(self, state: State, predictions: Sequence[Prediction]) -> None:
        """Queue models with further effects beside a fitted one.

        Parameters
        ----------
        state : State
        predictions : sequence of Prediction
        """
        for prediction in predictions:
            larger = len(prediction.model.identities) > len(state.model.identities)
            silent = larger and prediction.gain < FAINT
            far = (
                state is self._search.plain and len(prediction.model.effects) == 1 and prediction.reach > FAR
            )
            slack = (_borrowed_slack if far else slack_of)(prediction.reach)
            self.queue(prediction, state, 0.0 if silent else slack, is_silent=silent)

    def queue_other_laws(self, beside: Beside) -> None:
        """Queue a fitted model with each other law, or a bound of what that law may do.

        Parameters
        ----------
        beside : Beside
            The predictions beside the model.
        """
        state = beside.state
        for model in other_laws(self._search.problem.case, state.model):
            if not self.queue_law(state, model):
                own = 0 if state.model.fixed else len(state.model.start)
                bound = beside.any_law(has_more=len(model.start) > own)
                self.queue(Prediction(model, bound, 0.0, bound, 0.0), state, 0.0, is_bound=True)

    def queue_law(self, state: State, model: Model) -> bool:
        """Queue a model with another law if that law alone has been fitted; return whether it has.

        Parameters
        ----------
        state : State
            The fitted model with its own law.
        model : Model
            The same with the other law.
        """
        states = self._search.states
        own = states.get(without_effects(state.model).structure)
        alone = states.get(without_effects(model).structure)
        if own is None or alone is None or not model.effects:
            return False
        other = Beside(state.with_law(alone, own), ())
        self.queue(other.alone(), state, slack_of(state.evidence.coarse - other.coarse_likelihood))
        return True

    def queue_without(self, beside: Beside) -> None:
        """Queue a fitted model without some of its effects, and with another effect in their place.

        First order is poor beside a model that is far from the recordings, as the plain law may be. Beside a model that
        explains them, an effect that explains them equally well is recognised. Nothing is predicted where a fit
        shows that first order is wrong (`_is_refuted`).

        Parameters
        ----------
        beside : Beside
            The predictions beside the model.
        """
        state = beside.state
        pool = {name: points for name, points in self._beside_plain.items() if name not in beside.grouped}
        pool |= beside.grouped
        identities = state.model.identities
        every = [addition for points in pool.values() for addition in points]
        for count in range(1, len(identities) + 1):
            for removed in combinations(identities, count):
                others = [addition for addition in every if addition.trial.active.identity not in removed]
                smaller = state.without(removed)
                other = _without_own(smaller, others)
                if self._is_refuted(other, state):
                    continue
                lost = abs(state.evidence.coarse - other.coarse_likelihood)
                self.queue(other.alone(), state, slack_of(lost))
                slack = partial(_slack_after, lost)
                for prediction in other.singles(self._least(smaller), slack):
                    if prediction.gain >= FAINT:
                        self.queue(prediction, state, slack(prediction.reach))

    def _is_refuted(self, smaller: Beside, state: State) -> bool:
        """Whether first order beside a larger model promises more than the smaller one's fit found, beyond the slack.

        The stiffness of a stop that has been reached hardly changes the curves any more; its absence does.
        """
        known = self._search.states.get(smaller.state.model.structure)
        if known is None:
            return False
        found = known.evidence.judgement.log
        return smaller.alone().log_likelihood > found + slack_of(state.evidence.judgement.log - found)

    def correct(self, state: State, fitted: Queued, error: float) -> None:
        """Correct what is predicted of models that differ from a fitted one in a dimension of the mesh alone.

        Sleeves of 1, 2 and 4 mm do nearly the same with other moduli, and their predictions err alike: in development
        003 by 0.3, 0.3 and 0.1 nats, in 013 by 0.3 three times, in foreign 037 by 98 and 96. A fit that was given up
        says nothing of them.

        Parameters
        ----------
        state : State
        fitted : Queued
            What was predicted of the model.
        error : float
            Logarithm of its weight over the predicted one.
        """
        if fitted.is_bound or not state.fitted.converged:
            return
        for other in list(self._search.waiting.values()):
            same = other.model.without_sizes == state.model.without_sizes and other.base is fitted.base
            if same and not other.is_silent:
                log = other.log_evidence + error
                slack = slack_of(other.predicted_weight - fitted.predicted_weight)
                self._search.waiting.put(replace(other, base=state, log_evidence=log, slack=slack, hope=0.0))

    def queue(
        self,
        prediction: Prediction,
        base: State,
        slack: float,
        is_bound: bool = False,
        is_silent: bool = False,
    ) -> None:
        """Queue a model that is not fitted, unless its effects exclude each other.

        Parameters
        ----------
        prediction : Prediction
        base : State
            The model beside which it was predicted.
        slack : float
            Possible error of the prediction, in nats.
        is_bound, is_silent : bool
            As in `Queued`.
        """
        search = self._search
        names = [active.effect.name for active in prediction.model.effects]
        if prediction.model.structure in search.states or incompatibility(search.problem.case, names):
            return
        odds, likelihood = search.odds(prediction.model), search.problem.likelihood
        # No model is better than one that leaves nothing but noise. One that is predicted to leave less shows that the
        # noise is overestimated: by how much others leave less is not known then.
        gain = likelihood.log_without_misfit - prediction.log_likelihood
        limit = prediction.log_evidence + odds + gain if gain >= 0.0 else math.inf
        log, hope = prediction.log_evidence, prediction.hope
        search.put(Queued(prediction.model, base, log, odds, slack, hope, limit, is_bound, is_silent))


def _slack_after(lost: float, reach: float) -> float:
    """Return the slack of a prediction beside a model that is itself predicted, `lost` nats from a fitted one."""
    return slack_of(lost + reach)


def _borrowed_slack(reach: float) -> float:
    """Return the slack of a prediction whose derivatives are those beside the plain law."""
    return slack_of(BORROWED * reach)


def _without_own(state: State, additions: Sequence[Addition]) -> Beside:
    """Return predictions beside a model with those additions that it does not have and that its law cannot imitate."""
    recordings = state.problem.recordings
    everywhere = [recording.name for recording in recordings]

    def is_new(active: ActiveEffect) -> bool:
        having = [r.name for r in recordings if active.acts_on(r.name, r.mode, r.kind)]
        differs = active.effect.differs_from_law(having, everywhere, state.model.fixed)
        return differs and not active.is_among(state.model.effects)

    return Beside(state, [addition for addition in additions if is_new(addition.trial.active)])
