"""Which model is fitted next: the one whose fit may change the posterior most, or one that says more of it.

Two kinds of predictions are poor. Nothing is predicted of another law but a bound; beside effects of the plain law that
explain the recordings, its fit is soon given up. And a pair that was predicted beside the plain law has the errors of
two effects; beside the fit of one of them it has those of the other alone. Of models that differ in a dimension of the
mesh alone one is fitted first: its fit says how wrong the predictions of the others are (`neighbourhood`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from bushcli.selection.model import Key, Model
from bushcli.selection.neighbours import without_effects
from bushcli.selection.queued import OtherShares, Queued, Waiting
from bushcli.selection.state import State


@dataclass(frozen=True)
class FitOrder:
    """What is known when a fit is to begin.

    Attributes
    ----------
    plain : State
    states : mapping of Key to State
        Fitted models.
    begun : sequence of Model
        Models whose fits have begun and not ended.
    tried : set of Key
        All whose fits have begun.
    waiting : Waiting
        Models that are not fitted.
    others : OtherShares
    """

    plain: State
    states: Mapping[Key, State]
    begun: Sequence[Model]
    tried: AbstractSet[Key]
    waiting: Waiting
    others: OtherShares

    def next_model(self, least: float) -> Queued | None:
        """Return the model to be fitted next; None if all that matter wait for a fit that has begun.

        Parameters
        ----------
        least : float
            Logarithm of the posterior weight below which a model is not fitted in place of one that waits.
        """
        begun = {model.without_sizes for model in self.begun}
        for key in self.waiting.ordered_models(self.others):
            queued = self.waiting[key]
            chosen = self.law_first(queued) if queued.is_bound else self.single_first(queued)
            if chosen is not None and not chosen.is_bound:
                chosen = self.simpler_first(chosen, least)
            if chosen is not None and chosen.model.without_sizes in begun:
                chosen = None
            if chosen is not None or self.others.uncertain_weight(queued) < least:
                return chosen
        return None

    def law_first(self, bound: Queued) -> Queued | None:
        """Return what is fitted in place of another law: an effect of the plain law, or the other law without effects.

        None where one of these has begun.
        """
        alone = without_effects(bound.model)
        if any(model.structure == alone.structure for model in self.begun):
            return None
        if not any(state.model.effects for state in self.states.values()):
            if any(model.effects for model in self.begun):
                return None
            effects = [other for other in self.waiting.values() if not other.is_bound and other.model.effects]
            if effects:
                return self.single_first(max(effects, key=lambda other: other.predicted_weight))
        if bound.model.effects and alone.structure not in self.tried:
            return self.waiting.get(alone.structure, replace(bound, model=alone))
        return bound

    def single_first(self, queued: Queued) -> Queued | None:
        """Return what is fitted in place of a pair that was predicted beside the plain law: the better of its effects.

        None where the fit of one of them has begun.
        """
        if queued.base is not self.plain or len(queued.model.effects) < 2:
            return queued
        singles = {replace(queued.model, effects=(active,)).structure for active in queued.model.effects}
        if singles & self.states.keys():
            return queued
        if any(model.structure in singles for model in self.begun):
            return None
        waiting = [self.waiting[single] for single in singles & self.waiting.keys()]
        return max(waiting, key=lambda single: single.predicted_weight, default=queued)

    def simpler_first(self, queued: Queued, least: float) -> Queued | None:
        """Return what is fitted in place of an effect of fillers: one of its kind with fewer parameters, if it may do.

        None where the fit of such a model has begun.

        Parameters
        ----------
        queued : Queued
        least : float
            As in `next_model`.
        """
        if any(_is_simpler(model, queued.model) for model in self.begun):
            return None
        simpler = [
            other
            for key, other in self.waiting.items()
            if key not in self.tried
            and not other.is_bound
            and other.optimistic_weight > queued.predicted_weight
            and self.others.uncertain_weight(other) > least
            and _is_simpler(other.model, queued.model)
        ]
        return min(simpler, key=lambda other: (_count(other.model), -other.predicted_weight), default=queued)


def _is_simpler(model: Model, other: Model) -> bool:
    """Whether a model has another effect of fillers in place of one of its kind with more parameters."""
    if (model.law, model.terms, model.fixed) != (other.law, other.terms, other.fixed):
        return False
    mine, theirs = (
        [active for active in one.effects if active.identity not in two.identities]
        for one, two in ((model, other), (other, model))
    )
    if len(mine) != 1 or len(theirs) != 1 or _count(model) >= _count(other):
        return False
    kind = mine[0].effect.of_fillers
    return kind is not None and kind == theirs[0].effect.of_fillers


def _count(model: Model) -> int:
    """Number of parameters of a model's effects."""
    return sum(len(active.parameters) for active in model.effects)
