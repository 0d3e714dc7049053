"""From the evidence of models to probabilities: of each model, each effect, of nothing, and of something unknown."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from typing import Literal

import numpy as np

from bushcli.diagnosis.resemblance import resemblances
from bushcli.diagnosis.result import Group
from bushcli.effects.effect import effects
from bushcli.effects.names import effect_name
from bushcli.effects.titles import FREE_LAW, UNKNOWN, phrase
from bushcli.selection.model import Key, Model
from bushcli.selection.queue import AT_ONCE, LEFT, Search
from bushcli.selection.queued import Queued
from bushcli.selection.search_extent import Ended
from bushcli.selection.state import State

# Share of the posterior that the credible set holds. Convention.
CREDIBLE = 0.95
# Least probability of a model that is shown. Words only: less would be shown as 0.0 %.
SHOWN = 1e-3
# Least probability of an effect that is a member of a group, unless the group needs it to be certain; and of a group.
# Words only: what the credible set leaves out, and more probable than not.
MEMBER, GROUP = 0.05, 0.5


@dataclass(frozen=True)
class WeighedModel:
    """A model with its probability.

    Attributes
    ----------
    unknown : bool
        Whether the unknown effect acts beside the model's own.
    freed : bool
        Whether the law is identified from the recordings although coupons give one.
    predicted : Model, optional
        The model if it is not fitted; the state is then that of the model beside which it was predicted.
    searched : State, optional
        The model as the search has fitted it, with the error of form, if the answer was fitted further.
    """

    state: State
    unknown: bool
    probability: float
    log_evidence: float
    freed: bool = False
    predicted: Model | None = None
    searched: State | None = None

    @property
    def model(self) -> Model:
        """The model, with its values."""
        return self.state.model if self.predicted is None else self.predicted

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects with their rigs, then a law that coupons give and that is freed, the unknown effect."""
        return (
            *self.model.identities,
            *((FREE_LAW,) if self.freed else ()),
            *((UNKNOWN,) if self.unknown else ()),
        )

    @property
    def kind(self) -> Literal["law", "effects", "unknown"]:
        """Whether it has the unknown effect, only effects of the catalogue, or none."""
        if self.unknown:
            return "unknown"
        return "effects" if self.model.identities else "law"

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects in the catalogue, and of the unknown one."""
        return frozenset(map(effect_name, self.effects))


def posterior(search: Search) -> tuple[WeighedModel, ...]:
    """All models, each with and without the unknown effect; first the most probable set of the most probable kind.

    A model with an effect whose size the recordings do not show counts as the model without it: the recordings cannot
    distinguish the two, and "present" means present in a size that matters. So does a model with an effect that is an
    error of form of the others, with the probability of that (`resemblance`).
    """
    models = _weighed_models(search)
    sets = _set_probabilities(models)
    # Models with the same effects and different laws stand together, because the effects are the answer.
    models.sort(
        key=lambda model: (
            -sets[model.effects],
            model.effects,
            model.predicted is not None,
            -model.probability,
        )
    )
    kind = _kind(models)
    # The first model has to be a fitted one, because the report shows its values.
    fitted = [model for model in models if model.predicted is None]
    best = next((model for model in fitted if model.kind == kind), fitted[0]).effects
    return tuple(sorted(models, key=lambda model: model.effects != best))


def _set_probabilities(models: Iterable[WeighedModel]) -> dict[tuple[str, ...], float]:
    """Return the probability of each set of effects."""
    sets: dict[tuple[str, ...], float] = {}
    for model in models:
        sets[model.effects] = sets.get(model.effects, 0.0) + model.probability
    return sets


def _weighed_models(search: Search) -> list[WeighedModel]:
    """Return all models, in no particular order."""
    total, fixed = search.total, search.plain.model.fixed
    share: dict[tuple[Key, bool], float] = {}
    # Models that are not fitted, of which errors of form make others: the largest part, its state, and the sum.
    parts: dict[tuple[Key, bool], tuple[float, WeighedModel]] = {}
    models = []

    def add(key: Key, unknown: bool, probability: float) -> None:
        at = search.smallest_equivalent(key), unknown
        share[at] = share.get(at, 0.0) + probability

    for key, state in search.states.items():
        both = [float(np.exp(weight - total)) for weight in search.weights(state)]
        for unknown, probability in enumerate(both):
            add(key, bool(unknown), probability)
        if search.smallest_equivalent(key) != key:
            continue
        for removed, log in resemblances(state, search.uniform, search.states):
            smaller = state.without(removed).model
            for unknown, probability in enumerate(both):
                part = probability * math.exp(log)
                if smaller.structure in search.states:
                    add(smaller.structure, bool(unknown), part)
                else:
                    model = WeighedModel(
                        state, bool(unknown), part, 0.0, fixed and not smaller.fixed, smaller
                    )
                    so_far, most = parts.get((smaller.structure, bool(unknown)), (0.0, model))
                    larger = max(model, most, key=lambda each: each.probability)
                    parts[smaller.structure, bool(unknown)] = so_far + part, larger
    for part, model in parts.values():
        # The evidence with which it has this weight.
        log = total + math.log(max(part, 1e-300)) - search.odds(model.model, unknown=model.unknown)
        models.append(replace(model, probability=part, log_evidence=log))
    for queued in search.counted_models:
        probability = float(np.exp(queued.predicted_weight - total))
        if queued.is_silent:
            add(queued.base.model.structure, False, probability)
            continue
        freed = fixed and not queued.model.fixed
        models.append(WeighedModel(queued.base, False, probability, queued.log_evidence, freed, queued.model))
    for (key, unknown), probability in share.items():
        state = search.states[key]
        log = state.evidence.log_unknown if unknown else state.evidence.log
        models.append(WeighedModel(state, unknown, probability, log, fixed and not state.model.fixed))
    # Errors of form that resemble an effect add to the sum over models.
    weight_of_all = sum(model.probability for model in models)
    return [replace(model, probability=model.probability / weight_of_all) for model in models]


def run_with_shown(search: Search) -> Ended:
    """Search, then fit the models that the report shows; return why it ended.

    Such a fit may predict further models, which may matter: then the search goes on.
    """
    ended, tried = search.run(), set[Key]()
    while ended == "nothing left" and time.perf_counter() < search.deadline:
        models = list(islice(unfitted_models(posterior(search), tried), AT_ONCE))
        if not models:
            break
        tried |= {queued.model.structure for queued in models}
        search.fit_anyway(*(replace(queued, odds=search.odds(queued.model)) for queued in models))
        if search.share_left >= LEFT:
            ended = search.run()
    return ended


def unfitted_models(models: Sequence[WeighedModel], tried: Collection[Key] = ()) -> Iterator[Queued]:
    """Yield the most probable model of each set of effects that the report shows, and of which no model is fitted.

    Where errors of form resemble an effect, the model without it may have been abandoned by its fit, or never fitted.
    How large such an error is, is known to first order only until then. Those `tried` are not yielded.
    """
    kind = _kind(models)
    total = _set_probabilities(models)
    answer = max(
        (model.effects for model in models if model.kind == kind), key=lambda effects: total[effects]
    )
    shown = [names for names in sorted(total, key=lambda names: -total[names]) if total[names] >= MEMBER]
    for names in dict.fromkeys((answer, *shown)):
        group = [model for model in models if model.effects == names]
        # A law without effects is fitted once more in any case, as `bushcli inverse` fits it.
        fitted = [model.state for model in group if model.predicted is None]
        if any(state.fitted.converged or not state.model.effects for state in fitted):
            continue
        best = max(group, key=lambda model: model.probability)
        if best.model.structure not in tried:
            yield Queued(best.model, best.state, best.log_evidence)


def _kind(models: Sequence[WeighedModel]) -> str:
    """Kind of the answer: a law alone if that is at least as probable as not, else the more probable other kind.

    It follows from sums over models, since several effects may be probable together though none is alone.
    """
    total = {
        kind: sum(model.probability for model in models if model.kind == kind)
        for kind in ("law", "effects", "unknown")
    }
    if total["law"] >= 0.5 * sum(total.values()):
        return "law"
    return "unknown" if total["unknown"] >= total["effects"] else "effects"


def probabilities(models: Sequence[WeighedModel], considered: Sequence[str]) -> dict[str, float]:
    """Probability of each considered effect, of a law freed from the coupons, of the unknown effect, and of nothing."""
    free = (FREE_LAW,) if any(model.freed for model in models) else ()
    probability = {
        name: sum(model.probability for model in models if name in model.names)
        for name in (*considered, *free, UNKNOWN)
    }
    probability["nothing"] = sum(model.probability for model in models if not model.effects)
    return {name: min(1.0, value) for name, value in probability.items()}


def credible_sets(models: Sequence[WeighedModel]) -> list[tuple[str, ...]]:
    """The fewest sets of effects that hold 95 % of the posterior together, the most probable first."""
    credible, total = [], 0.0
    for names, probability in sorted(
        _set_probabilities(models).items(), key=lambda item: (-item[1], item[0])
    ):
        credible.append(names)
        total += probability
        if total >= CREDIBLE:
            break
    return credible


def groups(models: Sequence[WeighedModel], probability: Mapping[str, float]) -> tuple[Group, ...]:
    """Return groups of effects of which one is probable, though none of them is by itself.

    Two effects belong together if two models of the credible set differ only in which of the two they have, and if
    each is probable enough to be named, or the two reach the probability of the credible set only together.
    """
    held, chosen = 0.0, []
    for model in models:
        chosen.append(model)
        held += model.probability
        if held >= CREDIBLE:
            break
    together: list[set[str]] = []
    for a, b in combinations(chosen, 2):
        only = a.names - b.names, b.names - a.names
        if not all(len(part) == 1 for part in only):
            continue
        pair = set(only[0] | only[1])
        chances = [probability.get(name, 0.0) for name in pair]
        if UNKNOWN in pair or max(chances) >= CREDIBLE:
            continue
        if (
            min(chances) < MEMBER
            and sum(model.probability for model in models if model.names & pair) < CREDIBLE
        ):
            continue
        near = [group for group in together if group & pair]
        together = [group for group in together if not group & pair] + [pair.union(*near)]
    alternatives = []
    for members in together:
        total = sum(model.probability for model in models if model.names & members)
        if total >= GROUP:
            names = tuple(sorted(members, key=lambda name: (-probability[name], name)))
            known = [set(effects()[name].families) if name in effects() else set() for name in names]
            family = min(set.intersection(*known), default="")
            alternatives.append(Group(family, names, min(1.0, total), _text(family, names)))
    return tuple(sorted(alternatives, key=lambda group: -group.probability))


def _text(family: str, names: Sequence[str]) -> str:
    titles = [phrase(name) for name in names]
    text = titles[0] if len(titles) == 1 else f"{', '.join(titles[:-1])} or {titles[-1]}"
    return f"{f'{family}: ' if family else ''}{text}, which these recordings cannot tell apart"
