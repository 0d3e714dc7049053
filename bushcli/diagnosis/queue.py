"""Best-first search over models: the one whose predicted evidence is largest is fitted next.

Every fitted model that may still matter enters its neighbours into the queue: one effect more (or a branch more), two
more beside the plain law, one less, another law. What an effect would bring is predicted to first order beside the
model (`predict`), on the scale of the evidence. The search ends when what is in the queue cannot hold more than 1 % of
the posterior, or when the time allowed is over. Models are fitted in batches of one size, so that the answer does not
depend on the number of workers.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bushcli.diagnosis.columns import Trial, columns, trials, unfit
from bushcli.diagnosis.fit import Measured, fit
from bushcli.diagnosis.model import Fitted, Key, Model
from bushcli.diagnosis.predict import Addition, Beside
from bushcli.diagnosis.prior import log_odds
from bushcli.diagnosis.result import Trial as Row
from bushcli.diagnosis.state import Problem, State
from bushcli.effects.effect import Effect, spoken
from bushcli.runtime.workers import Workers
from forms.law import laws

Array = NDArray[np.float64]
Progress = Callable[[str, str, str], None]
"""Called with the stage, what is looked at, and what came of it."""

# Effects in one model, at most: more cannot be told from any recording seen so far.
MOST = 3
# Share of the posterior that may be left in the queue, and that makes a model worth neighbours.
LEFT = 0.01
# Models fitted at once.
BATCH = 2
# First order may underestimate what a fit brings: by such a share of what the model at hand leaves to be gained, and by
# so many nats at least. A guess from the first twenty fits on the development deck.
SHARE_SLACK, SLACK = 0.05, 1.5
# Natural logarithm of the likelihood that effects have to bring to first order for a fit to find more than that: half a
# nat. With less the optimum is that of the model beside which they are tried, where first order is exact.
FAINT = 0.5
# Share of an effect's change that has to be its own beside the fitted parameters: less is rounding.
OWN = 1e-3
# Fall of twice the negative log likelihood below which an effect cannot be seen: a nat, a factor of e.
VISIBLE = 2.0
# Terms of a law with optional ones; a coupon is solved in no time and shows all that a law can do.
TERMS, TERMS_OF_COUPON = 2, 3


@dataclass
class Queued:
    """A model that waits to be fitted.

    Attributes
    ----------
    model : Model
    predicted : float
        Log evidence and prior odds.
    optimistic : float
        The same with what first order may underestimate.
    """

    model: Model
    predicted: float
    optimistic: float


@dataclass(frozen=True)
class Faint:
    """A model whose further effect brings nothing, to first order.

    Attributes
    ----------
    base : State
        The model without it.
    effects : tuple of str
    weight : float
        Log evidence and prior odds.
    log_evidence : float
    """

    base: State
    effects: tuple[str, ...]
    weight: float
    log_evidence: float


@dataclass
class Search:
    """The search of one diagnosis.

    Attributes
    ----------
    states : dict of Key to State
        Fitted models.
    waiting : dict of Key to Queued
    faint : dict of Key to Faint
        Models that count by their predictions.
    rows : list
        What was fitted, in its order.
    lost : list of str
    untestable : dict
        Effects that the recordings cannot show, and why.
    ended : str
    """

    problem: Problem
    workers: Workers
    plain: State
    catalogue: Sequence[Effect]
    uniform: bool
    deadline: float
    progress: Progress
    states: dict[Key, State] = field(default_factory=dict)
    waiting: dict[Key, Queued] = field(default_factory=dict)
    faint: dict[Key, Faint] = field(default_factory=dict)
    rows: list[Row] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    untestable: dict[str, str] = field(default_factory=dict)
    ended: str = "nothing left"
    solves: int = 0
    failed: int = 0
    _columns: dict[tuple[object, ...], tuple[Array, ...] | None] = field(default_factory=dict)
    _expanded: set[Key] = field(default_factory=set)

    # -- the loop ------------------------------------------------------------------------------------------------

    def __post_init__(self) -> None:
        self._enter(self.plain, float("nan"))

    def run(self) -> None:
        """Search until nothing is left, or the time is over."""
        while True:
            for key in self._to_expand():
                self._expand(key)
                if time.perf_counter() > self.deadline:
                    break
            if self.left < LEFT:
                return
            if time.perf_counter() > self.deadline:
                self.ended = "budget"
                return
            self._fit_next()

    @property
    def left(self) -> float:
        """Share of the posterior that the queue may hold."""
        if not self.waiting:
            return 0.0
        known = self.total
        hoped = float(logsumexp([one.optimistic for one in self.waiting.values()]))
        return float(1.0 / (1.0 + math.exp(min(known - hoped, 700.0))))

    @property
    def total(self) -> float:
        """Logarithm of the sum of all posterior weights so far."""
        fitted = [w for one in self.states.values() for w in self.weights(one)]
        return float(logsumexp([*fitted, *(one.weight for one in self.counted)]))

    @property
    def counted(self) -> list[Faint]:
        """Models that count by their predictions: those that were not fitted all the same, nor wait to be."""
        return [one for key, one in self.faint.items() if key not in self.states and key not in self.waiting]

    def weights(self, state: State) -> tuple[float, float]:
        """Logarithm of the posterior weight of a model, and of the same with the unknown effect."""
        found = state.evidence
        return found.log + self.odds(state.model), found.log_unknown + self.odds(state.model, unknown=True)

    def odds(self, model: Model, unknown: bool = False) -> float:
        """Logarithm of the prior odds of a model against the plain law."""
        plain = self.plain.model
        return log_odds(
            model.effects,
            (model.law, model.terms) != (plain.law, plain.terms),
            plain.fixed and not model.fixed,
            unknown,
            len(self.problem.recordings),
            self.uniform,
        )

    # -- fits ----------------------------------------------------------------------------------------------------

    def _fit_next(self) -> None:
        order = sorted(self.waiting, key=lambda key: (-self.waiting[key].optimistic, key))
        # What is beaten by the first one if that is as good as predicted need not be fitted beside it.
        least = self.waiting[order[0]].predicted + math.log(LEFT)
        chosen = [self.waiting.pop(key) for key in order[:BATCH] if self.waiting[key].optimistic >= least]
        measured = Measured(self.problem.used, self.problem.likelihood.plain)
        questions = []
        for one in chosen:
            inside = [state for state in self.states.values() if one.model.contains(state.model)]
            inside.sort(key=lambda state: state.objective)
            least = inside[0].objective if inside else float("inf")
            questions.append(
                (self.problem.case, one.model, measured, tuple(s.model for s in inside[:1]), least)
            )

        def told(i: int, answer: Fitted | None) -> None:
            text = "cannot be solved" if answer is None else self._size(answer)
            text += f" (predicted {chosen[i].predicted - self.plain.evidence.log:.1f})"
            self.progress("fit", label(chosen[i].model), text)

        for one, fitted in zip(chosen, self.workers.run(fit, questions, told), strict=True):
            if fitted is None:
                name = label(one.model)
                self.lost.append(name)
                self.rows.append(
                    self._row(
                        one.model,
                        one.predicted,
                        float("nan"),
                        float("nan"),
                        "cannot be solved from any start",
                    )
                )
                continue
            self._enter(State(self.problem, fitted), one.predicted)

    def _size(self, fitted: Fitted) -> str:
        state = State(self.problem, fitted)
        gain = self.weights(state)[0] - self.plain.evidence.log
        return f"misfit {state.size:.3g} of the noise, log evidence {gain:+.1f}"

    def _enter(self, state: State, predicted: float) -> None:
        key = state.model.structure
        self.solves += state.fitted.solves
        self.failed += state.fitted.failed
        known = self.states.get(key)
        if known is None or state.evidence.log > known.evidence.log:
            self.states[key] = state
        self.waiting.pop(key, None)
        self.rows.append(self._row(state.model, predicted, self.weights(state)[0], state.size, ""))

    def _row(self, model: Model, predicted: float, found: float, size: float, text: str) -> Row:
        base = self.plain.evidence.log
        return Row(model.law, model.identities, predicted - base, found - base, size, text)

    # -- neighbours ----------------------------------------------------------------------------------------------

    def _to_expand(self) -> list[Key]:
        """Fitted models whose neighbours are not known yet, and that may matter; the plain law in any case."""
        total = self.total
        return [
            key
            for key, state in self.states.items()
            if key not in self._expanded
            and (state is self.plain or max(self.weights(state)) > total + math.log(LEFT))
        ]

    def _expand(self, key: Key) -> None:
        self._expanded.add(key)
        state = self.states[key]
        beside = Beside(state, self._additions(state))
        room = MOST - len(state.model.effects)
        predictions = beside.singles() if room > 0 else []
        if state is self.plain and room > 1:
            predictions += beside.pairs()
        for one in predictions:
            names = [active.effect.name for active in one.model.effects]
            if unfit(self.problem.case, names):
                continue
            if one.gain < FAINT and len(one.model.identities) > len(state.model.identities):
                self._count(one.model, one.log_evidence, state)
            else:
                self._queue(one.model, one.log_evidence, state)
        for model in self._other_laws(state.model):
            more = len(model.start) - (0 if state.model.fixed else len(state.model.start))
            self._queue(model, beside.any_law(more), state)
        for model, log_evidence in self._less(state):
            self._queue(model, log_evidence, state)

    def _count(self, model: Model, log_evidence: float, base: State) -> None:
        """Count a model by its prediction: a fit would end at the optimum of the one that it is beside."""
        key = model.structure
        weight = log_evidence + self.odds(model)
        known = self.faint.get(key)
        if known is None or weight > known.weight:
            self.faint[key] = Faint(base, model.identities, weight, log_evidence)

    def _queue(self, model: Model, log_evidence: float, base: State) -> None:
        key = model.structure
        predicted = log_evidence + self.odds(model)
        best_possible = self.problem.likelihood.judge(self.problem.likelihood.nothing).log
        gap = max(0.0, best_possible - base.evidence.judged.log)
        # Where the plain law is far off, as one of coupons may be, all of the gap is no measure of what is uncertain.
        slack = SLACK + min(SHARE_SLACK * gap, SLACK * len(self.problem.recordings))
        known = self.waiting.get(key)
        if key not in self.states and (known is None or predicted > known.predicted):
            self.waiting[key] = Queued(model, predicted, predicted + slack)

    def _less(self, state: State) -> list[tuple[Model, float]]:
        """The model without one of its effects, and its log evidence by how many standard errors that is from zero."""
        found = []
        for gone in state.model.effects if len(state.model.effects) > 1 else ():
            names = [gone.full_name(p) for p in gone.effect.amplitudes]
            where = [i for i, name in enumerate(state.fitted.names) if name in names]
            away = state.fitted.x[where] - np.array(state.off)[where]
            block = state.evidence.covariance[np.ix_(where, where)]
            wald = float(away @ np.linalg.pinv(block) @ away) if where else 0.0
            less = replace(state.model, effects=tuple(one for one in state.model.effects if one is not gone))
            found.append((less, state.evidence.log - 0.5 * wald))
        return found

    def _other_laws(self, model: Model) -> list[Model]:
        """The model with another law of at least as many parameters, or with the law set free."""
        if model.fixed:
            free = tuple(one for one in model.effects if not one.effect.needs_fixed_law)
            return [replace(model, fixed=False, effects=free)]
        coupon = self.problem.case.geometry.specimen == "coupon"
        terms = TERMS_OF_COUPON if coupon else TERMS
        found = []
        for name, other in laws().items():
            optional = any(p.optional for p in other.parameters)
            start = {p.name: p.start for p in other.parameters if not p.optional or int(p.name[-1]) <= terms}
            if name == model.law or len(start) < max(len(model.start), 2):
                continue
            found.append(
                replace(model, law=name, start=start, terms=terms if optional else None, anchor=None)
            )
        return found

    # -- derivatives ---------------------------------------------------------------------------------------------

    def _additions(self, state: State) -> list[Addition]:
        """What every effect would do beside a model, at every point of its grid."""
        asked: list[Trial] = []
        for effect in self.catalogue:
            some, reason = trials(self.problem.case, state.model, effect, self.problem.recordings)
            if not some and state is self.plain:
                self.untestable[effect.name] = reason
            asked += some
        names = [self._name(state, trial) for trial in asked]
        new = {name: trial for name, trial in zip(names, asked, strict=True) if name not in self._columns}

        def told(i: int, answer: object) -> None:
            trial = list(new.values())[i]
            point = ", ".join(
                (*(f"{k} {v:.3g}" for k, v in trial.shape.items()), *(trial.active.channels or ()))
            )
            self.progress(
                "screen", trial.effect.name, point if answer is not None else f"{point} cannot be solved"
            )

        questions = [(self.problem.case, state.model, trial) for trial in new.values()]
        self._columns |= dict(zip(new, self.workers.run(columns, questions, told), strict=True))
        found = []
        for name, trial in zip(names, asked, strict=True):
            known = self._columns[name]
            if known is None:
                continue
            slopes = tuple(
                one.of(column) for one, column in zip(self.problem.likelihood.features, known, strict=True)
            )
            if any(np.any(slope) for slope in slopes):
                found.append(Addition(trial, slopes))
        reasons = {trial.effect.name: "these recordings do not respond to it" for trial in asked}
        shown = []
        for one in found:
            if Beside(state, ()).share(one) < OWN:
                reasons[one.trial.effect.name] = (
                    "the law's parameters do all that it does to these recordings"
                )
            else:
                shown.append(one)
        if state is self.plain:
            names_ = {one.trial.effect.name for one in shown}
            self.untestable |= {name: reason for name, reason in reasons.items() if name not in names_}
        return shown

    def _name(self, state: State, trial: Trial) -> tuple[object, ...]:
        """What a derivative depends on: what acts in the bushing is tried without what else acts there."""
        base: tuple[object, ...] = ()
        own = [one for one in state.model.effects if one.identity == trial.active.identity]
        beside = [
            one
            for one in state.model.effects
            if trial.effect.acts == "rig" or one.effect.acts == "rig" or own
        ]
        if beside:
            base = (*sorted(state.model.values.items()), *state.model.identities)
        shape: Mapping[str, float] = trial.shape
        return (state.model.law, trial.active.identity, trial.amplitudes, *shape.items(), trial.size, base)


def label(model: Model) -> str:
    """A model in words: "yeoh + mullins + offset (radial)"."""
    return " + ".join([model.law, *map(spoken, model.identities)])
