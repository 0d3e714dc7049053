"""Models that are worth a refit, from what the score tests promise: with one effect more, with two, with another law.

Their start values are those that the derivatives promise, at the points of an effect's grid that promise most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from bushcli.active import ActiveEffect, told_apart
from bushcli.diagnosis import any_law
from bushcli.diagnosis.model import Fitted, Hope, Model
from bushcli.diagnosis.rivals import Combination
from bushcli.diagnosis.score import Candidate, Score
from bushcli.diagnosis.usual import usual_value
from bushcli.effect import effect_name, effects
from forms.law import laws

# Effects that are refitted in each round.
REFITTED = 4
# Values of a shape parameter within this factor of each other are one beginning.
TWINS = 1.3
# An effect is refitted if it promises this share of what the best one promises, and a second beginning, this share of
# what its own best point promises.
SHARE, SECOND = 0.1, 0.8
# What promises this share of what the best does is its rival, and refitted however many there are.
ALIKE = 0.9
# A score test that promises less than this fall of chi square is not followed.
PROMISING = 10.0
# Pairs of effects that are refitted where none is taken alone.
PAIRS = 2
# Share of the promised fall of chi square that a start has to bring, or another one is looked at.
HOPED = 0.5
# An amplitude begins at no more than so many times its usual size, and where that cannot be solved, at so many.
MOST, RETREATS = 100.0, (3.0, 0.3)
# An amplitude that was tried at a finite size begins within this factor of it.
TRIED = 2.0
# Laws that are tried in place of a poorer one: name and, where it has optional terms, their number. All terms for
# coupons alone, which are solved in no time and show all that a law can do.
RICHER, RICHER_FOR_COUPONS = (("yeoh", None), ("ogden", 2)), (("yeoh", None), ("ogden", 2), ("ogden", 3))


@dataclass(frozen=True)
class Beginning:
    """An effect that is worth a refit.

    Attributes
    ----------
    drop : float
        Fall of chi square that is promised.
    models : list of Model
        With the effect, where its refit begins.
    others : list of Model
        Other points to begin at, for where the first ones do not lead to the noise.
    """

    drop: float
    models: list[Model]
    others: list[Model]


def singles(
    best: Fitted,
    table: Sequence[Candidate],
    scores: Sequence[Score],
    least: float = 0.0,
    count: int | None = REFITTED,
) -> list[Beginning]:
    """So many effects that promise most, if at least so much, and what promises as much as the best; all with None."""
    grids = {one.name: one for one in table}
    most = max((one.drop for one in scores if one.testable), default=0.0)
    promising = [one for one in scores if one.testable and one.drop > max(PROMISING, least, SHARE * most)]
    proposed = []
    for i, score in enumerate(promising):
        if count is not None and i >= count and score.drop < ALIKE * most:
            break
        one = grids[score.name]
        points = _apart(one, score)
        models = [_with(best.model, best, one, point, float(score.drops[point])) for point in points]
        # What had to be tried at finite sizes may fit at two of them, each a minimum of its own.
        at_once = len(models) if one.sizes is not None and one.sizes[points[0]] is not None else 1
        proposed.append(Beginning(score.drop, models[:at_once], models[at_once:]))
    return proposed


def _apart(one: Candidate, score: Score) -> list[int]:
    """The point of an effect's grid that promises most, and a second one, if it promises nearly as much elsewhere."""
    first, *others = (int(p) for p in np.argsort(-score.drops, kind="stable"))

    def is_twin(point: int) -> bool:
        if one.channels_at(point) != one.channels_at(first):
            return False
        if one.sizes is not None and one.sizes[point] != one.sizes[first]:
            return False
        near = (
            one.points[first][name] / value if value else 0.0 for name, value in one.points[point].items()
        )
        return all(1.0 / TWINS < ratio < TWINS for ratio in near)

    good = (p for p in others if score.drops[p] > SECOND * score.drop and not is_twin(p))
    return [first, *islice(good, 1)]


def unpromised(best: Fitted, table: Sequence[Candidate], scores: Sequence[Score]) -> list[Model]:
    """Every effect of the assembly beside another one of the assembly, whatever is promised of it.

    They are tested without each other (`candidates.columns`), and act upon each other: a ring that is bonded at one end
    only shifts the force once it is swaged, and softens before.
    """
    if not any(one.effect.acts == "assembly" for one in best.model.effects):
        return []
    grids = {one.name: one for one in table}
    known = effects()
    return [
        _with(best.model, best, grids[one.name], one.point, one.drop)
        for one in scores
        if one.testable
        and known[effect_name(one.name)].acts == "assembly"
        and one.name not in best.model.names
    ]


def pairs(
    best: Fitted,
    table: Sequence[Candidate],
    together: Sequence[Combination],
    begun: Sequence[ActiveEffect],
) -> list[Model]:
    """Models with two more effects at once.

    One effect of two that are missing may fit better and yet predict worse, because it stands for both.

    Parameters
    ----------
    together
        Combinations to first order, the most promising first; those of two effects that the model does not have count.
    begun
        Effects as other refits have left them: better start values than first order has.
    """
    grids = {one.name: one for one in table}
    ended = {one.identity: one for one in begun}
    models: list[Model] = []
    for pair in together:
        if len(pair.names) != 2 or set(best.model.names) & set(pair.names):
            continue
        model = best.model
        for name, point in zip(pair.names, pair.points, strict=True):
            model = _with(model, best, grids[name], point, pair.drop)
            as_ended = ended.get(grids[name].identity(point))
            if as_ended is not None:
                others = tuple(one for one in model.effects if one.identity != as_ended.identity)
                model = replace(model, effects=(*others, as_ended))
        models.append(model)
        if len(models) == PAIRS:
            break
    return models


def richer(best: Fitted, scores: Sequence[Score], coupon: bool) -> tuple[list[Model], list[Model]]:
    """Models with a richer law, where any law can do something about the misfit; or with a law set free.

    Ogden's apart: it takes longest, and is for what nothing else explains. Beside effects it takes longer still, and is
    tried only where any law promises more than any effect.

    Parameters
    ----------
    coupon
        Whether the specimen is one.
    """
    model = best.model
    if model.fixed:
        # A factor on a law that is free cannot be told.
        others = tuple(one for one in model.effects if not one.effect.needs_fixed_law)
        return ([replace(model, fixed=False, effects=others)] if others else []), []
    most = max((one.drop for one in scores if one.testable), default=0.0)
    promised = any_law.most(best.channels, best.used, best.linear)
    if promised < max(PROMISING, SHARE * most):
        return [], []
    poorer: list[Model] = []
    richest: list[Model] = []
    for name, terms in RICHER_FOR_COUPONS if coupon else RICHER:
        if name != model.law and len(laws()[name].parameters) >= len(model.start):
            start = {
                p.name: p.start
                for p in laws()[name].parameters
                if terms is None or not p.optional or int(p.name[-1]) <= terms
            }
            other = replace(model, law=name, start=start, terms=terms, anchor=None)
            (richest if name == RICHER[-1][0] else poorer).append(other)
    return poorer, richest if not model.effects or promised > most else []


def _with(model: Model, fitted: Fitted, one: Candidate, point: int, drop: float) -> Model:
    """The model with an effect at a point of its grid and its first-order amplitude.

    First order promises too much far from the off value; where that cannot be solved, there are smaller amplitudes.

    Parameters
    ----------
    drop
        Fall of chi square that is promised.
    """
    effect = effects()[effect_name(one.name)]
    present = next((e for e in model.effects if e.name == one.name), None)
    known: dict[str, float] = dict(present.values) if present is not None else {}
    channels = present.channels if present is not None else one.channels_at(point)
    there = [channel.recording for channel in fitted.channels]
    recordings = [recording for recording in there if channels is None or recording.name in channels]
    columns_ = fitted.linear.left(one.columns[point])
    size = np.maximum(np.sum(columns_**2, axis=0), 1e-300)
    asked = -(columns_.T @ fitted.linear.rest) / size
    tried = one.sizes[point] if one.sizes is not None else None
    if tried is not None:
        # What a finite size would change says little of sizes far from it.
        asked[0] = np.clip(asked[0], tried / TRIED, TRIED * tried)

    def sized(most: float) -> dict[str, float]:
        values = dict(known)
        for name, value, sign in zip(one.amplitudes, asked, one.signs, strict=True):
            parameter = effect.parameter(name)
            amplitude = float(parameter.off or 0.0) + (max(value, 0.0) if sign > 0 else value)
            usual = usual_value(effect, parameter, recordings)
            amplitude = float(np.clip(amplitude, -most * abs(usual), most * abs(usual)))
            if amplitude == parameter.off:
                amplitude = usual
            values[name] = float(np.clip(amplitude, parameter.lower, parameter.upper))
        return values | dict(one.points[point])

    others = [e for e in model.effects if e.name != one.name]
    *others, active = told_apart([*others, ActiveEffect(effect, sized(MOST), channels).started()])
    smaller = [replace(active, values=sized(most)).started() for most in RETREATS]
    named = [{e.full_name(p): e.values[p.name] for p in e.parameters} for e in smaller]
    retreats = [{**old, **new} for old, new in zip(model.retreats or [{}] * len(named), named, strict=True)]
    return replace(
        model,
        effects=(*others, active),
        # Solid bodies are compared on a coarse mesh from here on; what it misses is known at the law alone.
        anchor=dict(model.start) if model.anchor is None else model.anchor,
        retreats=tuple(retreats),
        hoped=Hope(float(fitted.linear.misfit @ fitted.linear.misfit) - HOPED * drop, fitted.used),
    )
