"""Best-first search over models: the one whose fit may change the posterior most is fitted next.

Every fitted model that may still matter adds its neighbours to the queue: models with one effect more (or a branch
more), with two more beside the plain law, with fewer effects, with one in place of others, or with another law. Their
evidence is predicted to first order beside the fitted model (`predict`). The nearer the two models are, the more
reliable is the prediction; a reliable one counts like a fit. The search ends when further fits could change no more
than a few per cent of the posterior, or when the time allowed is over. What says more of others is fitted before them
(`order`). Several fits run at once: when the oldest ends, its neighbours are predicted and the next one begins beside
the others. What is chosen depends on the fits received, in the order in which they were begun, so that the answer does
not depend on the number of processes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import Effect
from bushcli.evidence.prior import log_odds
from bushcli.evidence.stopping_rule import needed_of
from bushcli.runtime.workers import Workers
from bushcli.selection.additions import RELAXING, relaxing_models, unthinned, with_branch_more
from bushcli.selection.columns import incompatibility, shear_modulus
from bushcli.selection.derivatives import Derivatives
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.model import Fitted, Key, Model
from bushcli.selection.neighbours import label, other_laws, with_law_of, without_effects
from bushcli.selection.order import FitOrder
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import FAINT, Addition, Prediction
from bushcli.selection.queued import FAR, Queued, Waiting, slack_of
from bushcli.selection.search_extent import Ended, TriedModel
from bushcli.selection.state import CommonData, State

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]
"""Called with the stage, its subject, and a text about it."""

# Largest number of effects in a model: no recording so far could distinguish more.
MOST_EFFECTS = 3
# Share of the posterior that further fits may still change when the search ends. Accepted error of the probabilities.
LEFT = 0.05
# Least share of the posterior for the neighbours of a fitted model to be tried. Other values change probabilities by
# less than 0.002 (`benchmarks/constants.md`).
NEIGHBOURS = 0.01
# Fits at once. One number, so that the answer does not depend on the workers. With three, of which two run, neither of
# two processes waits for the other: in 003 of the development deck they work 82 in place of 68 % of the time, and the
# models fitted are the same; in five others one more is fitted in two (`benchmarks/reduced.md`).
AT_ONCE = 3
# Factor on the predicted gain, from which the slack follows, if the derivatives are those beside the plain law:
# judgement, since beside the fitted effects they differ by an unknown share.
BORROWED = 2.0


@dataclass(frozen=True)
class _Begun:
    """A fit that another process does, or this one when its answer is waited for."""

    queued: Queued
    answer: Callable[[], Fitted | None]


@dataclass
class Search:
    """The search of one diagnosis.

    Attributes
    ----------
    states : dict of Key to State
        Fitted models.
    waiting : Waiting
        Models that are not fitted.
    rows : list of TriedModel
        Fits in their order.
    lost : dict of Key to str
        Models that cannot be solved, in words.
    derivatives : Derivatives
        By the effects of the catalogue.
    """

    problem: CommonData
    workers: Workers
    plain: State
    catalogue: Sequence[Effect]
    uniform: bool
    deadline: float
    progress: Progress
    states: dict[Key, State] = field(default_factory=dict)
    waiting: Waiting = field(default_factory=Waiting)
    rows: list[TriedModel] = field(default_factory=list)
    lost: dict[Key, str] = field(default_factory=dict)
    solves: int = 0
    failed: int = 0
    _begun: list[_Begun] = field(default_factory=list)
    _expanded: set[Key] = field(default_factory=set)
    _tried: set[Key] = field(default_factory=set)
    _relaxing: list[Key] = field(default_factory=list)
    _beside_plain: Mapping[str, list[Addition]] = field(default_factory=dict)
    _borrowed: dict[Key, Beside] = field(default_factory=dict)

    # -- the loop ------------------------------------------------------------------------------------------------

    def __post_init__(self) -> None:
        shear = shear_modulus(self.plain.model, self.problem.case)
        self.derivatives = Derivatives(self.problem, self.workers, self.catalogue, self.progress, shear)
        self._enter(self.plain, float("nan"))

    def run(self) -> Ended:
        """Search until no model is left that matters, or the time limit is reached; return which of the two."""
        for model in relaxing_models(self, self.plain.model, self.catalogue):
            if model.structure not in self._tried and time.perf_counter() < self.deadline:
                self._tried.add(model.structure)
                # Beside relaxation the law is softer than alone.
                best = max(self.states.values(), key=lambda state: state.evidence.log)
                begun = replace(model, start=best.model.start)
                self.fit_anyway(Queued(begun, best, self.plain.evidence.log, self.odds(model)))
                self._relaxing.append(model.structure)
        try:
            return self._search()
        finally:
            self._give_back()

    def _search(self) -> Ended:
        while True:
            for key in self._expandable_models():
                self._expand(key)
                if time.perf_counter() > self.deadline:
                    break
            enough = self.share_left < LEFT and not self._begun
            outweighed = self._better_predicted_model() or self._otherwise_relaxing() if enough else None
            if enough and outweighed is None:
                if self._queue_branch_more():
                    continue
                return "nothing left"
            if time.perf_counter() > self.deadline:
                while self._begun and self.workers.has_others:
                    self._receive_oldest()
                return "budget"
            if outweighed is None:
                self._begin_next()
                self._receive_oldest()
            else:
                self._tried.add(outweighed.model.structure)
                self.fit_anyway(outweighed)

    @property
    def share_left(self) -> float:
        """Share of the posterior that further fits may change; all of it before any neighbour is predicted."""
        if not self.waiting:
            return 0.0 if self._expanded else 1.0
        return float(1.0 / (1.0 + math.exp(min(self.total - self.waiting.uncertain_weight, 700.0))))

    @property
    def total(self) -> float:
        """Logarithm of the sum of all posterior weights so far."""
        fitted = [w for state in self.states.values() for w in self.weights(state)]
        return float(logsumexp([*fitted, *(queued.predicted_weight for queued in self.counted_models)]))

    @property
    def counted_models(self) -> list[Queued]:
        """Models that count with their predictions: reliable ones that are not predicted to be the best."""
        most = max(max(self.weights(state)) for state in self.states.values())
        return [
            queued for queued in self.waiting.values() if queued.is_sure and queued.predicted_weight < most
        ]

    def smallest_equivalent(self, key: Key) -> Key:
        """Return the smallest fitted model that a model contains and that describes the recordings equally well."""
        state, least = self.states[key], key
        for other, simpler in self.states.items():
            lost = state.evidence.judgement.log - simpler.evidence.judgement.log
            # A further effect, or a further branch of one.
            more = max(len(state.model.identities) - len(simpler.model.identities), 1)
            if state.model.contains(simpler.model) and lost < FAINT * more:
                least = min(least, other, key=len)
        return least

    def weights(self, state: State) -> tuple[float, float]:
        """Logarithm of the posterior weight of a model, without and with the unknown effect."""
        model, evidence = state.model, state.evidence
        return evidence.log + self.odds(model), evidence.log_unknown + self.odds(model, unknown=True)

    def odds(self, model: Model, unknown: bool = False) -> float:
        """Logarithm of the prior odds of a model against the plain law.

        Parameters
        ----------
        model : Model
        unknown : bool
            Whether the unknown effect acts as well.
        """
        plain = self.plain.model
        return log_odds(
            model.effects,
            (model.law, model.terms) != (plain.law, plain.terms),
            plain.fixed and not model.fixed,
            unknown,
            [(recording.mode, recording.kind) for recording in self.problem.recordings],
            self.uniform,
            of_one_parameter=len(plain.start) == 1,
        )

    # -- fits ----------------------------------------------------------------------------------------------------

    @property
    def _total_with_begun(self) -> float:
        """Logarithm of the sum of all posterior weights if the fits that have begun turn out as predicted."""
        return float(logsumexp([self.total, *(begun.queued.predicted_weight for begun in self._begun)]))

    def _begin_next(self) -> None:
        """Begin the fits that may change the posterior most, as many as may run at once."""
        while len(self._begun) < AT_ONCE and self.waiting:
            # If those that have begun turn out as predicted, the search may end without others.
            if self.waiting.uncertain_weight <= self._total_with_begun + math.log(LEFT):
                return
            queued = self._next_model()
            if queued is None:
                return
            self._begun.append(self._begin(queued))

    def fit_anyway(self, *models: Queued) -> None:
        """Fit models, whether or not their fits may change the posterior."""
        self._begun += [self._begin(queued, matters=True) for queued in models]
        try:
            while self._begun:
                self._receive_oldest()
        finally:
            self._give_back()

    def _begin(self, queued: Queued, matters: bool = False) -> _Begun:
        measured = FittedSamples(self.problem.used, self.problem.likelihood.plain, self.problem.noises)
        contained = (state for state in self.states.values() if queued.model.contains(state.model))
        best = min(contained, key=lambda state: state.objective, default=None)
        inner, least = (None, math.inf) if best is None else (best.model, best.objective)
        odds = self.odds(queued.model), self.odds(queued.model, unknown=True)
        needed = None if matters else needed_of(self.total, *odds)
        question = (self.problem.case, queued.model, measured, inner, least, needed)
        return _Begun(queued, self.workers.ask(fit, question))

    def _give_back(self) -> None:
        """Queue the models again whose fits have not ended: the time is over, or the user has interrupted them."""
        for begun in self._begun:
            self.waiting.put(begun.queued)
        self._begun.clear()

    def _receive_oldest(self) -> None:
        """Wait for the fit that began first, and enter it, or note that the model cannot be solved."""
        queued = self._begun[0].queued
        answer = self._begun[0].answer()
        state = None if answer is None else State(self.problem, answer)
        text = "cannot be solved"
        if state is not None:
            gain = self.weights(state)[0] - self.plain.evidence.log
            text = f"misfit {state.size:.3g} times the noise, log evidence {gain:+.1f}"
        text += f" (predicted {queued.predicted_weight - self.plain.evidence.log:.1f})"
        self.progress("fit", label(queued.model), text)
        del self._begun[0]
        if state is not None:
            self._enter(state, queued.predicted_weight)
            return
        none, why = float("nan"), "cannot be solved from any start"
        self.lost[queued.model.structure] = label(queued.model, variants=True)
        self.waiting.pop(queued.model.structure, None)
        self.rows.append(self._row(queued.model, queued.predicted_weight, none, none, why))

    def _next_model(self) -> Queued | None:
        """Take the model to be fitted next; None if those that matter wait for a fit that has begun."""
        begun = [other.queued.model for other in self._begun]
        order = FitOrder(self.plain, self.states, begun, self._tried, self.waiting)
        queued = order.next_model(self._total_with_begun + math.log(NEIGHBOURS))
        if queued is not None:
            self._tried.add(queued.model.structure)
            self.waiting.pop(queued.model.structure, None)
        return queued

    def _enter(self, state: State, predicted: float) -> None:
        key = state.model.structure
        self.solves += state.fitted.solves
        self.failed += state.fitted.failed
        known = self.states.get(key)
        if known is None or state.evidence.log > known.evidence.log:
            self.states[key] = state
        self.waiting.pop(key, None)
        self.lost.pop(key, None)
        if not state.model.effects:
            # Models with this law and effects can be predicted now.
            for other in [self.states[key] for key in self._expanded if self.states[key].model.effects]:
                for model in other_laws(self.problem.case, other.model):
                    self._exchange_law(other, model)
        elif (state.model.law, state.model.terms) == (self.plain.model.law, self.plain.model.terms):
            self._queue_with_one_more(state)
        else:
            self._exchange_law(state, with_law_of(self.plain.model, state.model))
        row = self._row(state.model, predicted, self.weights(state)[0], state.size, "")
        self.rows.append(replace(row, solves=state.fitted.solves))

    def _row(self, model: Model, predicted: float, fitted: float, size: float, text: str) -> TriedModel:
        base = self.plain.evidence.log
        return TriedModel(model.law, model.identities, predicted - base, fitted - base, size, text)

    # -- neighbours ----------------------------------------------------------------------------------------------

    def _expandable_models(self) -> list[Key]:
        """Return fitted models that may matter and whose neighbours are not predicted yet; the plain law always."""
        # A fit that has begun and is predicted far better may leave nothing to the others.
        least = self._total_with_begun + math.log(NEIGHBOURS)
        new = [(key, state) for key, state in self.states.items() if key not in self._expanded]
        keys = [key for key, state in new if state is self.plain or max(self.weights(state)) > least]
        if not keys and any(recording.kind == "dynamic" for recording in self.problem.recordings):
            # Beside tables fits are cheap, and an unknown effect may outweigh all of them but the right one.
            best = max(self.states, key=lambda key: self.weights(self.states[key])[0])
            keys = [best] if best not in self._expanded else []
        return keys

    def _better_predicted_model(self) -> Queued | None:
        """Return a model that is predicted better than all fitted ones without an unknown effect, or None.

        Beside branches that leave ten times the noise of a table, first order finds half of what a fit of the right
        effect does, and an unknown effect outweighs it: it counts when no known one is left that may do better.
        """
        known, unknown = (max(w) for w in zip(*map(self.weights, self.states.values()), strict=True))
        if unknown < known or all(recording.kind == "static" for recording in self.problem.recordings):
            return None
        better = [
            queued
            for queued in self.waiting.values()
            if not queued.is_bound and queued.predicted_weight > known
        ]
        return max(better, key=lambda queued: queued.predicted_weight, default=None)

    def _otherwise_relaxing(self) -> Queued | None:
        """Return a probable model with another relaxation in place of its own that is not tried, or None.

        One relaxation says nothing of how well another one does beside the same effects, and first order cannot. Tables
        were fitted with several; the Payne effect without thinning is a spectrum of viscoelasticity.
        """
        fitted = [self.states[key] for key in self._relaxing if key in self.states]
        alone = [state for state in fitted if len(state.model.effects) == 1]
        best = max(self.states.values(), key=lambda state: self.weights(state)[0])
        others = tuple(active for active in best.model.effects if active.effect.in_force_law not in RELAXING)
        models = [
            (replace(state.model, effects=(*state.model.effects, *others)), state)
            for state in alone
            if not any(other.model.contains(state.model) for other in alone)
        ]
        probable = self._states_above(LEFT)
        models += [(model, state) for state in probable for model in unthinned(state.model, self.catalogue)]
        for model, state in models:
            if model.structure not in {*self.states, *self._tried}:
                return Queued(model, state, self.plain.evidence.log, self.odds(model))
        return None

    def _queue_branch_more(self) -> bool:
        """Queue an effect with one branch more if every probable model leaves a misfit; return whether there is one."""
        if not all(state.leaves_misfit for state in self._states_above(NEIGHBOURS)):
            return False
        queued = next(with_branch_more(self, self.states.keys() | self._tried, LEFT), None)
        if queued is not None:
            self._tried.add(queued.model.structure)
            self.waiting[queued.model.structure] = queued
        return queued is not None

    def _states_above(self, share: float) -> list[State]:
        """Return the fitted models with more than a share of the posterior."""
        least = self.total + math.log(share)
        return [state for state in self.states.values() if max(self.weights(state)) > least]

    def _queue_with_one_more(self, state: State) -> None:
        """Queue a model with one effect more, whose derivatives are those beside the plain law.

        The prediction of a pair beside the plain law has the errors of both effects; here one of the two is fitted.
        """
        if self._beside_plain and len(state.model.identities) < MOST_EFFECTS:
            for prediction in self._with_borrowed(state).singles():
                self._queue(prediction, state, slack_of(BORROWED * prediction.reach))

    def _expand(self, key: Key) -> None:
        state = self.states[key]
        beside = self.beside(state)
        if state is self.plain:
            self._beside_plain = beside.grouped
        further = MOST_EFFECTS - len(state.model.effects)
        self._queue_larger(state, beside.singles() if further > 0 else [])
        for model in other_laws(self.problem.case, state.model):
            if not self._exchange_law(state, model):
                more = len(model.start) - (0 if state.model.fixed else len(state.model.start))
                bound = beside.any_law(more)
                self._queue(Prediction(model, bound, 0.0, bound, 0.0), state, 0.0, is_bound=True)
        best = max(other.evidence.coarse for other in self.states.values())
        if state is self.plain and further > 1 and best < state.evidence.coarse + FAR:
            if time.perf_counter() < self.deadline:
                # Pairs are predicted while the first laws and single effects are fitted.
                self._begin_next()
            self._queue_larger(state, beside.pairs())
        self._expand_without(state, beside)
        # Not before: an interrupted search has not looked at these neighbours.
        self._expanded.add(key)

    def _queue_larger(self, state: State, predictions: Sequence[Prediction]) -> None:
        """Queue models with further effects beside a fitted one."""
        for prediction in predictions:
            larger = len(prediction.model.identities) > len(state.model.identities)
            silent = larger and prediction.gain < FAINT
            far = state is self.plain and len(prediction.model.effects) == 1 and prediction.reach > FAR
            slack = slack_of(BORROWED * prediction.reach if far else prediction.reach)
            self._queue(prediction, state, 0.0 if silent else slack, is_silent=silent)

    def beside(self, state: State) -> Beside:
        """Return further effects with their derivatives beside a model, or beside the plain law where that will do.

        The derivative beside the plain law is a fair estimate. Where it predicts no visible gain beside the model, by a
        factor of `BORROWED`, or a model whose neighbours would not be tried, the effect is not solved anew.
        """
        if state is self.plain or not state.model.effects:
            return Beside(state, self.derivatives.additions_beside(state, state is self.plain))
        borrowed, least = self._with_borrowed(state), self.total + math.log(NEIGHBOURS)
        silent, visible = {points[0].trial.effect.name for points in borrowed.grouped.values()}, set[str]()
        for points, prediction in zip(borrowed.grouped.values(), borrowed.singles(), strict=True):
            most = prediction.log_evidence + slack_of(BORROWED * prediction.reach)
            if BORROWED * prediction.gain >= FAINT and most + self.odds(prediction.model) > least:
                visible.add(points[0].trial.effect.name)
        silent -= visible
        among = [effect for effect in self.catalogue if effect.name not in silent]
        every = [addition for points in borrowed.grouped.values() for addition in points]
        own = [
            *self.derivatives.additions_beside(state, among=among),
            *(addition for addition in every if addition.trial.effect.name in silent),
        ]
        return Beside(state, own, before=borrowed)

    def _with_borrowed(self, state: State) -> Beside:
        """Return further effects with their derivatives beside the plain law."""
        key = state.model.structure
        if key not in self._borrowed or self._borrowed[key].state is not state:
            every = [addition for points in self._beside_plain.values() for addition in points]
            self._borrowed[key] = _without_own(state, every)
        return self._borrowed[key]

    def _expand_without(self, state: State, beside: Beside) -> None:
        """Queue the model without some of its effects, and with another effect in their place.

        First order is poor beside a model that is far from the recordings, as the plain law may be. Beside a model that
        explains them, an effect that explains them equally well is recognised. Nothing is predicted where a fit
        shows that first order is wrong (`_is_refuted`).
        """
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
                self._queue(other.alone(), state, slack_of(lost))
                for prediction in other.singles():
                    if prediction.gain >= FAINT:
                        self._queue(prediction, state, slack_of(lost + prediction.reach))

    def _is_refuted(self, smaller: Beside, state: State) -> bool:
        """Whether first order beside a larger model promises more than the smaller one's fit found, beyond the slack.

        The stiffness of a stop that has been reached hardly changes the curves any more; its absence does.
        """
        known = self.states.get(smaller.state.model.structure)
        if known is None:
            return False
        found = known.evidence.judgement.log
        return smaller.alone().log_likelihood > found + slack_of(state.evidence.judgement.log - found)

    def _exchange_law(self, state: State, model: Model) -> bool:
        """Queue a model with another law if that law alone has been fitted; return whether it has."""
        own = self.states.get(without_effects(state.model).structure)
        alone = self.states.get(without_effects(model).structure)
        if own is None or alone is None or not model.effects:
            return False
        other = Beside(state.with_law(alone, own), ())
        self._queue(other.alone(), state, slack_of(state.evidence.coarse - other.coarse_likelihood))
        return True

    def _queue(
        self,
        prediction: Prediction,
        base: State,
        slack: float,
        is_bound: bool = False,
        is_silent: bool = False,
    ) -> None:
        """Queue a model that is not fitted, unless its effects exclude each other."""
        names = [active.effect.name for active in prediction.model.effects]
        known = {*self.states, *(begun.queued.model.structure for begun in self._begun)}
        if prediction.model.structure in known or incompatibility(self.problem.case, names):
            return
        odds, likelihood = self.odds(prediction.model), self.problem.likelihood
        # No model is better than one that leaves nothing but noise.
        gain = likelihood.log_without_misfit - prediction.log_likelihood
        limit = prediction.log_evidence + odds + max(gain, 0.0)
        log, hope = prediction.log_evidence, prediction.hope
        self.waiting.put(Queued(prediction.model, base, log, odds, slack, hope, limit, is_bound, is_silent))


def _without_own(state: State, additions: Sequence[Addition]) -> Beside:
    """Return predictions beside a model with those additions that it does not have and that its law cannot imitate."""
    recordings = state.problem.recordings
    everywhere = [recording.name for recording in recordings]

    def is_new(active: ActiveEffect) -> bool:
        having = [r.name for r in recordings if active.acts_on(r.name, r.mode, r.kind)]
        differs = active.effect.differs_from_law(having, everywhere, state.model.fixed)
        return differs and not active.is_among(state.model.effects)

    return Beside(state, [addition for addition in additions if is_new(addition.trial.active)])
