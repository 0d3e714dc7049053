"""Best-first search over models: the one whose fit may change the posterior most is fitted next.

Every fitted model that may still matter adds its neighbours to the queue: models with one effect more (or a branch
more), with two more beside the plain law, with fewer effects, with one in place of others, or with another law. Their
evidence is predicted to first order beside the fitted model (`predict`). The nearer the two models are, the more
reliable is the prediction; a reliable one counts like a fit. The search ends when further fits could change no more
than a few per cent of the effects' probability, or when the time allowed is over. What says more of others is fitted
before them (`order`). Several fits run at once: when the oldest ends, its neighbours are predicted and the next one
begins beside the others. A fit that has begun is abandoned where the last result leaves its model next to nothing; the
model waits again. What is chosen depends on the fits received, in the order in which they were begun, so that
the answer does not depend on the number of processes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress

from scipy.special import logsumexp

from bushcli.effects.effect import Effect
from bushcli.evidence.prior import log_odds
from bushcli.evidence.stopping_rule import NEGLIGIBLE, needed_of
from bushcli.runtime.workers import Pending, Workers
from bushcli.selection.additions import RELAXING, relaxing_models, unthinned, with_branch_more
from bushcli.selection.columns import shear_modulus
from bushcli.selection.derivatives import Derivatives
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.model import Key, Model
from bushcli.selection.neighbourhood import MOST_EFFECTS, NEIGHBOURS, Neighbourhood
from bushcli.selection.neighbours import label, other_laws, with_law_of
from bushcli.selection.order import FitOrder
from bushcli.selection.prediction import FAINT
from bushcli.selection.queued import FAR, OtherShares, Queued, Waiting
from bushcli.selection.search_extent import Ended, TriedModel
from bushcli.selection.state import CommonData, State

Progress = Callable[[str, str, str], None]
"""Called with the stage, its subject, and a text about it."""

# Share of the effects' probability that further fits may still change when the search ends: its accepted error.
LEFT = 0.05
# Fits at once. One number, so that the answer does not depend on the workers. With three, of which two run, neither of
# two processes waits for the other: in 003 of the development deck they work 82 in place of 68 % of the time, and the
# models fitted are the same; in five others one more is fitted in two (`benchmarks/reduced.md`).
AT_ONCE = 3


@dataclass(frozen=True)
class _Begun:
    """A fit that another process does, or this one when its answer is waited for.

    Attributes
    ----------
    queued : Queued
        The prediction with which it began.
    latest : Queued
        The most reliable prediction of the model so far.
    as_predicted : bool
        Whether it is fitted because of its prediction. Then the error of the prediction corrects those of models that
        differ in a dimension of the mesh alone.
    may_matter : bool
        Whether it might change the posterior when it began, by its prediction.
    """

    queued: Queued
    latest: Queued
    asked: Pending
    as_predicted: bool
    may_matter: bool


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
    neighbourhood : Neighbourhood
        What is predicted beside the fitted models.
    meanwhile : callable
        Called whenever fits have begun, for work that the caller needs at the end.
    """

    problem: CommonData
    workers: Workers
    plain: State
    catalogue: Sequence[Effect]
    uniform: bool
    deadline: float
    progress: Progress
    meanwhile: Callable[[], object] = lambda: None
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
    _again: set[tuple[Key, Key]] = field(default_factory=set)

    # -- the loop ------------------------------------------------------------------------------------------------

    def __post_init__(self) -> None:
        shear = shear_modulus(self.plain.model, self.problem.case)
        self.derivatives = Derivatives(self.problem, self.workers, self.catalogue, self.progress, shear)
        self.neighbourhood = Neighbourhood(self)
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
            outweighed = self._doubtful_model() if enough else None
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
                self.meanwhile()
                self._receive_oldest()
            else:
                self._tried.add(outweighed.model.structure)
                self.fit_anyway(outweighed, matters=False)

    @property
    def share_left(self) -> float:
        """Share of the posterior of the effects that further fits may change; all of it before any prediction."""
        if not self.waiting:
            return 0.0 if self._expanded else 1.0
        uncertain = self.waiting.uncertain_weight(self._other_shares)
        return float(1.0 / (1.0 + math.exp(min(self.total - uncertain, 700.0))))

    @property
    def _other_shares(self) -> OtherShares:
        fitted = [(state.model, self.weights(state)[0]) for state in self.states.values()]
        counted = [(queued.model, queued.predicted_weight) for queued in self.counted_models]
        return OtherShares.of([*fitted, *counted], self.total)

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

    def put(self, queued: Queued) -> None:
        """Add the prediction of a model that is not fitted; of several for one model the most reliable counts.

        Parameters
        ----------
        queued : Queued
        """
        for i, begun in enumerate(self._begun):
            if begun.queued.model.structure == queued.model.structure:
                if queued.rank > begun.latest.rank:
                    self._begun[i] = replace(begun, latest=queued)
                return
        self.waiting.put(queued)

    @property
    def begun_models(self) -> list[Model]:
        """Models whose fits have begun and not ended."""
        return [begun.queued.model for begun in self._begun]

    # -- fits ----------------------------------------------------------------------------------------------------

    @property
    def _total_with_begun(self) -> float:
        """Logarithm of the sum of all posterior weights if the fits that have begun turn out as predicted."""
        return float(logsumexp([self.total, *(begun.queued.predicted_weight for begun in self._begun)]))

    def _begin_next(self) -> None:
        """Begin the fits that may change the posterior most, as many as may run at once."""
        while len(self._begun) < AT_ONCE and self.waiting:
            # If those that have begun turn out as predicted, the search may end without others.
            if self.waiting.uncertain_weight(self._other_shares) <= self._total_with_begun + math.log(LEFT):
                return
            queued = self._next_model()
            if queued is None:
                return
            self._begun.append(self._begin(queued, as_predicted=True, matters=False))

    def fit_anyway(self, *models: Queued, matters: bool = True) -> None:
        """Fit models whatever is predicted of them.

        Parameters
        ----------
        models : Queued
        matters : bool
            Whether their fits go to the end even if they change the posterior by nothing.
        """
        self._begun += [self._begin(queued, as_predicted=False, matters=matters) for queued in models]
        try:
            while self._begun:
                self._receive_oldest()
        finally:
            self._give_back()

    def _begin(self, queued: Queued, as_predicted: bool, matters: bool) -> _Begun:
        measured = FittedSamples(self.problem.used, self.problem.likelihood.plain, self.problem.noises)
        contained = (state for state in self.states.values() if queued.model.contains(state.model))
        best = min(contained, key=lambda state: state.objective, default=None)
        inner, least = (None, math.inf) if best is None else (best.model, best.objective)
        odds = self.odds(queued.model), self.odds(queued.model, unknown=True)
        needed = None if matters else needed_of(self.total, *odds)
        question = (self.problem.case, queued.model, measured, inner, least, needed)
        may_matter = as_predicted and not self._is_negligible(queued)
        return _Begun(queued, queued, self.workers.ask(fit, question), as_predicted, may_matter)

    def _is_negligible(self, queued: Queued) -> bool:
        """Whether the fit of a model can hardly change the posterior."""
        return self._other_shares.uncertain_weight(queued) < self.total + math.log(NEGLIGIBLE)

    def _give_back(self) -> None:
        """Queue the models again whose fits have not ended: the time is over, or the user has interrupted them."""
        for begun in self._begun:
            self.waiting.put(begun.latest)
        self._begun.clear()

    def _receive_oldest(self) -> None:
        """Wait for the fit that began first, and enter it, or note that the model cannot be solved."""
        begun = self._begun[0]
        queued, answer = begun.queued, begun.asked.answer()
        state = None if answer is None else State(self.problem, answer)
        text = "cannot be solved"
        if state is not None:
            gain = self.weights(state)[0] - self.plain.evidence.log
            text = f"misfit {state.misfit_over_noise:.3g} times the noise, log evidence {gain:+.1f}"
        text += f" (predicted {queued.predicted_weight - self.plain.evidence.log:.1f})"
        self.progress("fit", label(queued.model), text)
        del self._begun[0]
        if state is not None:
            self._enter(state, queued.predicted_weight)
            if begun.as_predicted:
                error = self.weights(state)[0] - queued.predicted_weight
                self.neighbourhood.correct(state, queued, error)
            self._abandon_negligible()
            return
        none, why = float("nan"), "cannot be solved from any start"
        self.lost[queued.model.structure] = label(queued.model, variants=True)
        self.waiting.pop(queued.model.structure, None)
        self.rows.append(self._row(queued.model, queued.predicted_weight, none, none, why))

    def _abandon_negligible(self) -> None:
        """Queue the models again whose fits might matter when they began, and cannot since the last one ended."""
        is_idle = [begun.may_matter and self._is_negligible(begun.latest) for begun in self._begun]
        idle = list(compress(self._begun, is_idle))
        self._begun = [begun for begun, gone in zip(self._begun, is_idle, strict=True) if not gone]
        for begun in idle:
            begun.asked.abandon()
            self._tried.discard(begun.queued.model.structure)
            self.waiting.put(begun.latest)

    def _next_model(self) -> Queued | None:
        """Take the model to be fitted next; None if those that matter wait for a fit that has begun."""
        order = FitOrder(
            self.plain, self.states, self.begun_models, self._tried, self.waiting, self._other_shares
        )
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
                    self.neighbourhood.queue_law(other, model)
        elif (state.model.law, state.model.terms) == (self.plain.model.law, self.plain.model.terms):
            self.neighbourhood.queue_borrowed(state)
        else:
            self.neighbourhood.queue_law(state, with_law_of(self.plain.model, state.model))
        row = self._row(state.model, predicted, self.weights(state)[0], state.misfit_over_noise, "")
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

    def _expand(self, key: Key) -> None:
        """Predict and queue the neighbours of a fitted model."""
        state, near = self.states[key], self.neighbourhood
        beside = near.beside(state)
        if state is self.plain:
            near.lend(beside)
        further = MOST_EFFECTS - len(state.model.effects)
        near.queue_larger(state, beside.singles() if further > 0 else [])
        near.queue_other_laws(beside)
        best = max(other.evidence.coarse for other in self.states.values())
        if state is self.plain and further > 1 and best < state.evidence.coarse + FAR:
            if time.perf_counter() < self.deadline:
                # Pairs are predicted while the first laws and single effects are fitted.
                self._begin_next()
                self.meanwhile()
            near.queue_larger(state, beside.pairs())
        near.queue_without(beside)
        # Not before: an interrupted search has not looked at these neighbours.
        self._expanded.add(key)

    def _doubtful_model(self) -> Queued | None:
        """Return a model of which first order says too little for the search to end without its fit, or None."""
        return self._better_predicted_model() or self._otherwise_relaxing() or self._with_rival()

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
            known = self.states.get(model.structure)
            again = (model.structure, state.model.structure)
            # A spectrum has several minima: one that leaves more than the thinned one is searched for beside that.
            worse = known is not None and known.objective > state.objective and again not in self._again
            if worse or model.structure not in {*self.states, *self._tried}:
                self._again.add(again)
                return Queued(model, state, self.plain.evidence.log, self.odds(model))
        return None

    def _with_rival(self) -> Queued | None:
        """Return a probable model with a rival in place of an effect that tables alone show, if it is not fitted.

        First order says little of the rival: beside a mass with a lag, the same lag with a resonance was predicted 54
        nats worse than its fit is (dynamic 028 of *fourth*, `benchmarks/dynamic_deck`).
        """
        fitted = {state.model.identities for state in self.states.values()}
        swapped = []
        for state in self._states_above(LEFT):
            own = {active.identity: active.effect for active in state.model.effects}
            for queued in self.waiting.values():
                new = {active.identity: active.effect for active in queued.model.effects}
                out, into = own.keys() - new.keys(), new.keys() - own.keys()
                if (
                    queued.base is state
                    and len(out) == len(into) == 1
                    and queued.model.identities not in fitted
                ):
                    old, rival = own[out.pop()], new[into.pop()]
                    if old.kinds == rival.kinds == frozenset({"dynamic"}) and rival.name in old.rivals:
                        swapped.append(queued)
        return max(swapped, key=lambda queued: queued.predicted_weight, default=None)

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
