"""Models beside the path of the search: one effect at a time may go astray, or hide a rival.

A stand-in may be taken for two effects that act together; what promised little to first order may be what is missing;
and what nearly explained as much as the effect taken is its rival beside all effects found later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bushcli.active import ActiveEffect
from bushcli.diagnosis.beginnings import REFITTED, pairs, singles, unpromised
from bushcli.diagnosis.model import Fitted, Hope, Model, chi_square
from bushcli.diagnosis.plausible import plausibility
from bushcli.diagnosis.rivals import STRONG
from bushcli.diagnosis.selected import Round, Selection, at_noise, form_error, key

if TYPE_CHECKING:
    from bushcli.diagnosis.selection import Search

# Share of the fall of chi square by an effect from which on another effect had nearly the same, and how many of these
# are refitted in its place beside what was found since. Their start may be worse by such a factor.
NEARLY, RIVALS, WORSE = 0.7, 3, 1.5
# Effects beyond the most promising that are refitted beside a model, and how many before it is asked whether that did.
LEFT, AT_ONCE = 6, 2
# Share of the plain law's sum of squares below which effects have explained most of the misfit.
EXPLAINED = 0.1


def reconsidered(search: Search, found: Selection, asked: float) -> bool:
    """Look for a better model beside the path, the cheaper way first; whether there was one."""
    return exchanged(search, found, asked) or floated(search, found, asked) or leftover(search, found, asked)


def exchanged(search: Search, found: Selection, asked: float) -> bool:
    """Put a pair of effects in place of those at hand; whether one was better.

    One effect at a time does not find two that act together where a third one stands for part of both. Beside the
    plain law, first order may promise more of the two than the model at hand has brought.
    """
    if at_noise(found.best) is not None:
        return False
    table = found.rounds[0].table
    left = chi_square(found.best.channels, found.plain.used)
    whole = float(found.plain.linear.rest @ found.plain.linear.rest)
    known = {frozenset(one.model.identities) for one in found.refits.values()}
    grids = {one.name: one for one in table}
    promised = [
        one
        for one in found.combined
        if whole - one.drop < left
        and frozenset(grids[n].identity(p) for n, p in zip(one.names, one.points, strict=True)) not in known
        and search.is_possible(one.names)
    ]
    tried: dict[tuple[str, ...], Fitted] = {}
    search.refit(found, tried, pairs(found.plain, table, promised, found.best.model.effects))
    return search.take(found, tried, asked)


def floated(search: Search, found: Selection, asked: float) -> bool:
    """Take one of two effects out again, and look for another one in its place; whether one was better.

    What was found first was found beside the plain law alone. It may stand for what is only seen beside the second one:
    a bushing that is bonded at one end shifts the force, as an offset does, once it is swaged. An effect whose values
    no real bushing has goes first. This is the floating search of Pudil, Novovicova and Kittler (1994), Pattern
    Recognit. Lett. 15:1119-1125, doi:10.1016/0167-8655(94)90127-9.
    """
    real = _are_real(found.best)
    if len(real) != 2 or (at_noise(found.best) is not None and all(real.values())):
        return False
    for name in sorted(real, key=lambda name: real[name]):
        base = found.refits.get(key(found.best.model.without(name), found.plain.model))
        if base is None:
            continue
        beside = _round(search, found, base)
        promised = [model for one in singles(base, beside.table, beside.scores) for model in one.models]
        others = unpromised(base, beside.table, beside.scores) if not real[name] else []
        for models in (promised, others):
            tried: dict[tuple[str, ...], Fitted] = {}
            search.refit(found, tried, _unknown(models, found))
            if search.take(found, tried, asked):
                return True
            if not real[name]:
                # What a real bushing can have need not be better than what it cannot, and may be worse by what the form
                # of effects may err; but what is no noise does not take the place of what is.
                real_ones = {
                    k: f
                    for k, f in tried.items()
                    if all(_are_real(f).values())
                    and (at_noise(f) is not None or at_noise(found.best) is None)
                    and f.bic() > found.best.bic() - asked
                }
                if search.take(found, real_ones, -max(STRONG, form_error(found))):
                    return True
    return False


def _unknown(models: Sequence[Model], found: Selection) -> list[Model]:
    """Those that have not been fitted, from whatever start."""
    return [model for model in models if key(model, found.plain.model) not in found.refits]


def _are_real(fitted: Fitted) -> dict[str, bool]:
    """Whether each effect of a model has values that real bushings have, by its name there."""
    recordings = [channel.recording for channel in fitted.channels]
    std = fitted.standard_errors()
    return {
        one.name: plausibility(
            one, recordings, {p.name: std.get(one.full_name(p), 0.0) for p in one.parameters}
        )[0]
        for one in fitted.model.effects
    }


def _round(search: Search, found: Selection, base: Fitted) -> Round:
    """What is promised beside a model, which may have been asked before."""
    name = key(base.model, found.plain.model)
    known = next((one for one in found.rounds if key(one.base.model, found.plain.model) == name), None)
    if known is not None:
        return known
    table, scores = search.screened(base)
    found.rounds.append(Round(base, table, scores))
    return found.rounds[-1]


def leftover(search: Search, found: Selection, asked: float) -> bool:
    """Refit what promised less than the few that are refitted in each round; whether one was better.

    Two effects that act upon each other may be far from what derivatives promise of the second beside the first: the
    shrinkage of a ring that is bonded all over only stiffens, and of one that is debonded at an end shifts the force.
    """
    for one in reversed(found.rounds):
        if len(one.base.model.effects) > 1:
            continue
        if at_noise(found.best) is not None:
            return False
        if not one.base.model.effects and found.best.chi_square < EXPLAINED * found.plain.chi_square:
            # One effect alone that promised little does not do what two have done.
            continue
        begun = singles(one.base, one.table, one.scores, count=None)[REFITTED:]
        models = _unknown([model for each in begun for model in each.models], found)[:LEFT]
        names = [model.identities for model in models]
        others = _unknown(unpromised(one.base, one.table, one.scores), found)
        models += [model for model in others if model.identities not in names]
        tried: dict[tuple[str, ...], Fitted] = {}
        for i in range(0, len(models), AT_ONCE):
            search.refit(found, tried, models[i : i + AT_ONCE])
            if any(at_noise(fitted) is not None for fitted in tried.values()):
                break
        if search.take(found, tried, asked):
            return True
    return False


def rivalled(search: Search, found: Selection) -> None:
    """Put what nearly explained as much as each effect, when that was taken, beside the effects found since.

    The alternatives to the effect that was taken last have been refitted beside all others already.
    """
    best = found.best
    swapped: dict[frozenset[str], tuple[float, Model]] = {}
    known = {frozenset(one.model.identities) for one in found.refits.values()}
    for name in best.model.identities if len(best.model.effects) > 1 else ():
        others = frozenset(best.model.identities) - {name}
        for fitted in found.refits.values():
            near = _nearly(found, fitted, name)
            if near is None or others | {near.identity} in known:
                continue
            kept = tuple(one for one in best.model.effects if one.identity != name)
            hoped = Hope(WORSE * float(best.linear.misfit @ best.linear.misfit), best.used)
            model = replace(best.model, effects=(*kept, near), hoped=hoped)
            swapped.setdefault(others | {near.identity}, (fitted.chi_square, model))
    tried: dict[tuple[str, ...], Fitted] = {}
    search.refit(
        found, tried, [model for _, model in sorted(swapped.values(), key=lambda pair: pair[0])][:RIVALS]
    )
    search.take(found, tried, STRONG)


def _nearly(found: Selection, fitted: Fitted, name: str) -> ActiveEffect | None:
    """The one effect that a fit had in place of another one (its identity), if it explained nearly as much there."""
    model, best = fitted.model, found.best.model
    new = [one for one in model.effects if one.identity not in best.identities]
    if len(new) != 1 or name in model.identities or (model.law, model.fixed) != (best.law, best.fixed):
        return None
    kept = [one for one in model.identities if one != new[0].identity]
    same = [
        one.chi_square
        for one in found.refits.values()
        if sorted(one.model.identities) == sorted([*kept, name]) and one.model.law == model.law
    ]
    without = [
        one.chi_square
        for one in found.refits.values()
        if sorted(one.model.identities) == sorted(kept) and one.model.law == model.law
    ]
    if not same or not without:
        return None
    fall, wanted = min(without) - fitted.chi_square, min(without) - min(same)
    return new[0] if fall >= NEARLY * wanted else None
