"""The same answers with other prior odds: how often effects occur in the decks, in place of an engineer's judgement.

Probabilities agree with frequencies only in a population that has the odds with which they were calculated. The tool's
odds are those of an engineer's recordings, of which three in four lack nothing; in the decks 85 % conceal something.
The likelihoods do not depend on the odds, so that every listed model's probability can be converted. Models below 0.1 %
are not in the ledgers and stay at zero.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from benchmarks.decks.answer import UNKNOWN, Names
from benchmarks.decks.score import Item
from bushcli.effects.effect import effects_on
from bushcli.effects.titles import FREE_LAW
from bushcli.evidence.prior import FREED_LAW, effect_odds, log_odds_together
from bushcli.evidence.prior import UNKNOWN as UNKNOWN_ODDS

# Frequency of sets of more than three effects, and of the unknown effect beside others: no deck conceals any, but they
# remain possible.
ABSENT = 1e-6
# Half a recording; and the probability from which on nothing is missing.
HALF = 0.5
# Odds of what is no effect of the catalogue.
_OTHERS = {"unknown": UNKNOWN_ODDS, FREE_LAW: FREED_LAW}
# Verdict by kind of answer.
VERDICTS = {"nothing": "explained", "effects": "missing_physics", "unknown": "unexplained"}


@dataclass(frozen=True)
class Frequencies:
    """How often sets of effects are concealed.

    Attributes
    ----------
    count : int
        Recordings.
    nothing, unknown, pairs, triples : int
        Recordings with nothing concealed, with physics outside the catalogue, with two effects, with three.
    single : mapping
        Effect -> recordings that conceal it alone.
    """

    count: int
    nothing: int
    unknown: int
    pairs: int
    triples: int
    single: Mapping[str, int]

    def of(self, names: Names) -> float:
        """Share of the recordings that conceal exactly these effects; pairs are equally frequent, triples likewise."""
        if names == UNKNOWN:
            return self.unknown / self.count
        if not names:
            return self.nothing / self.count
        if len(names) == 1:
            # Half a recording more, so that an effect that no recording conceals remains possible.
            return (self.single.get(next(iter(names)), 0) + HALF) / self.count
        several = {2: self.pairs, 3: self.triples}.get(len(names), 0)
        if several and "unknown" not in names:
            return several / self.count / math.comb(len(effects_on("static")), len(names))
        return ABSENT


def frequencies(items: Sequence[Item]) -> Frequencies:
    """Count what recordings conceal.

    Parameters
    ----------
    items : sequence of Item
    """
    truths = [frozenset(i.entry.truth) or (UNKNOWN if i.entry.outside else frozenset()) for i in items]
    return Frequencies(
        len(truths),
        sum(not names for names in truths),
        sum(names == UNKNOWN for names in truths),
        sum(len(names) == 2 for names in truths),
        sum(len(names) == 3 for names in truths),
        Counter(next(iter(names)) for names in truths if len(names) == 1 and names != UNKNOWN),
    )


def tool_odds(names: Names) -> float:
    """Prior odds of a set of effects in a diagnosis, without the division among rigs, branches and choices."""
    known = [name for name in names if name not in _OTHERS]
    return math.exp(log_odds_together(known)) * math.prod(_OTHERS[name] for name in names - set(known))


def independent_odds(names: Names) -> float:
    """Return those of the ledgers until `0e8e176`, in which no effect was more probable beside another."""
    return math.prod(_OTHERS[name] if name in _OTHERS else effect_odds(name) for name in names)


def reweigh(item: Item, odds: Callable[[Names], float], before: Callable[[Names], float] = tool_odds) -> Item:
    """Return the answer that these odds would have given.

    Parameters
    ----------
    item : Item
    odds, before : callable
        Odds of a set of effects; those with which the answer was calculated.
    """
    weights = {names: p * odds(names) / before(names) for names, p in item.answer.sets}
    total = sum(weights.values())
    if not total:
        return item
    sets = sorted(((names, weight / total) for names, weight in weights.items()), key=lambda pair: -pair[1])
    effects: dict[str, float] = {}
    for names, probability in sets:
        for name in names:
            effects[name] = effects.get(name, 0.0) + probability
    kind = _most_probable_kind(sets)
    named = next(names for names, _ in sets if _kind(names) == kind) - UNKNOWN
    answer = replace(item.answer, verdict=VERDICTS[kind], named=named, sets=tuple(sets), effects=effects)
    return replace(item, answer=answer)


def _kind(names: Names) -> str:
    return "unknown" if "unknown" in names else "effects" if names else "nothing"


def _most_probable_kind(sets: Sequence[tuple[Names, float]]) -> str:
    """Kind of answer, from sums over sets as in a diagnosis."""
    sums = dict.fromkeys(VERDICTS, 0.0)
    for names, probability in sets:
        sums[_kind(names)] += probability
    if sums["nothing"] >= HALF:
        return "nothing"
    return "unknown" if sums["unknown"] > sums["effects"] else "effects"
