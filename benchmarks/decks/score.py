"""Compare right and given answers; `about.md` states the rules in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.concealed.score import NORMAL, Count, Interval
from benchmarks.decks.answer import UNKNOWN, Answer, Names
from benchmarks.decks.manifest import Entry

# Least probability of a right set, since models are listed down to 0.1 %.
FLOOR = 1e-3
# Share of the located misfit that must lie where the truth puts it.
HALF = 0.5
# Bins of the reliability diagram: narrower at the ends, where statements matter most.
BINS = (0.01, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 0.99, 1.0)


@dataclass(frozen=True)
class Item:
    """A recording and the answer to it (None = not diagnosed yet)."""

    entry: Entry
    answer: Answer

    @property
    def right(self) -> frozenset[Names]:
        """Sets that are right: for physics outside the catalogue "unknown", or the effect that was added later."""
        if self.entry.outside:
            later = {frozenset(self.entry.truth)} if self.entry.truth else set()
            return frozenset({UNKNOWN, *later})
        return self.entry.right

    @property
    def possible(self) -> Names:
        """Effects that are in any right set."""
        return frozenset().union(*self.right)


# -- one recording -----------------------------------------------------------------------------------------------


def in_set(item: Item) -> bool:
    """Whether a right set of effects is in the credible set."""
    return any(names in item.right for names in item.answer.credible)


def first(item: Item) -> bool:
    """Whether a right set of effects is the most probable one."""
    return any(names in item.right for names, _ in item.answer.sets[:1])


def is_outright(item: Item) -> bool:
    """Whether exactly the right effects are named, without rivals."""
    answer = item.answer
    return (
        answer.verdict not in ("unexplained", "no result", "faulty_data")
        and answer.named in item.right
        and len(answer.credible) == 1
    )


def wrong_effects(item: Item) -> Names:
    """Effects that are stated with 95 % or more, but are absent."""
    return item.answer.stated_effects - item.possible


def is_unexplained(item: Item) -> bool:
    """Whether the verdict is that the catalogue does not explain the recording."""
    return item.answer.verdict == "unexplained"


def is_explained(item: Item) -> bool:
    """Whether the verdict is that the plain law suffices, without any effect."""
    return item.answer.verdict == "explained" and not item.answer.named


def outside_right(item: Item) -> bool:
    """Whether outside physics is unexplained and rightly located, or named as the effect that was added later."""
    later = frozenset(item.entry.truth)
    if later and any(names == later for names in item.answer.credible):
        return True
    return is_unexplained(item) and is_located(item)


def is_located(item: Item) -> bool:
    """Whether more than half of the located misfit lies where the truth puts it."""
    where = item.entry.where
    parts = item.answer.line.get("mismatch") or []
    if not where:
        return bool(parts)
    total = sum(part["share"] for part in parts)
    right = sum(part["share"] for part in parts if _there(part, item))
    return total > 0 and right > HALF * total


def _there(part: dict[str, Any], item: Item) -> bool:
    where = item.entry.where
    first, last = _cycles(part)
    if "cycle" in where:
        soft = "too_soft" if where["softer"] else "too_stiff"
        stiff = "too_stiff" if where["softer"] else "too_soft"
        return bool(
            (last < where["cycle"] and part["sign"] == soft)
            or (first >= where["cycle"] and part["sign"] == stiff)
        )
    if "falls_with" in where:
        return bool(part["sign"] == ("too_soft" if last <= 3 else "too_stiff" if first >= 4 else ""))
    if "channel" in where:
        # A wrong gain may be attributed to either channel.
        return part["sign"] in ("too_soft", "too_stiff")
    if "grows_with" in where:
        return part["sign"] in ("too_high", "too_low") or first >= 4
    if where.get("sign") == "+":
        return float(part["displacement_to"]) > 0 and float(part["displacement_from"]) >= 0
    if "rate" in where:
        return first >= 4
    if "displacement" in where:
        reach = _amplitude(item, str(part.get("channel", "")))
        at = where["displacement"] * reach
        low, high = sorted((float(part["displacement_from"]), float(part["displacement_to"])))
        return low - 0.15 * reach <= at <= high + 0.15 * reach
    return True


def _amplitude(item: Item, channel: str) -> float:
    amplitude = item.entry.specimen.amplitude
    return float(amplitude.get(channel, next(iter(amplitude.values()))))


def _cycles(part: dict[str, Any]) -> tuple[int, int]:
    cycle = part.get("cycle")
    if isinstance(cycle, Sequence):
        return int(cycle[0]), int(cycle[-1])
    return (int(cycle), int(cycle)) if cycle is not None else (0, 10**6)


def intervals(item: Item) -> list[Interval]:
    """Intervals of the parameters, where exactly the concealed effects of the catalogue's own formulas are named."""
    if item.entry.part != "own" or not item.entry.effects or item.answer.named not in item.right:
        return []
    effect_intervals = []
    for effect in item.answer.line["effects"]:
        for name, truth in item.entry.effects.get(effect["name"], {}).items():
            parameter = effect["parameters"].get(name)
            if not isinstance(parameter, dict) or not parameter.get("std"):
                continue
            lower = parameter.get("lower", parameter["value"] - NORMAL * parameter["std"])
            upper = parameter.get("upper", parameter["value"] + NORMAL * parameter["std"])
            effect_intervals.append(
                Interval(item.entry.name, f"{effect['name']}.{name}", truth, lower, upper)
            )
    return effect_intervals


def log_score(item: Item) -> float:
    """Logarithm of the probability of the right answer, no less than that of FLOOR."""
    return math.log(max(item.answer.of(item.right), FLOOR))


# -- many --------------------------------------------------------------------------------------------------------


def count(items: Sequence[Item], good: Callable[[Item], bool]) -> Count:
    """Count the items for which `good` holds."""
    return Count(sum(map(good, items)), len(items))


def statements(item: Item) -> Iterator[tuple[float, bool]]:
    """Stated probabilities of effects, and whether the effect is present; effects that may be either are left out."""
    truth = frozenset(item.entry.truth)
    for name, probability in item.answer.effects.items():
        if name == "unknown":
            true = item.entry.outside
            if true and truth:
                continue  # right by its name or as unknown, depending on the catalogue
        elif item.entry.outside and name in truth:
            continue
        else:
            true = name in truth
            if not true and name in item.possible:
                continue
        yield probability, true


def models(item: Item) -> Iterator[tuple[float, bool]]:
    """Stated probabilities of sets of effects, and whether the set is right."""
    for names, probability in item.answer.sets:
        yield probability, names in item.right


@dataclass(frozen=True)
class Bin:
    """Statements with a probability in a range.

    Attributes
    ----------
    low, high : float
    count : int
    mean : float
        Mean of the probabilities.
    true : Count
    """

    low: float
    high: float
    mean: float
    true: Count


def reliability(statements: Sequence[tuple[float, bool]]) -> list[Bin]:
    """Bins of probability with the share of true statements; statements below 1 % are left out."""
    bins, low = [], BINS[0]
    for high in BINS[1:]:
        inside = [(p, t) for p, t in statements if low <= p < high or (high == 1.0 and p == 1.0)]
        if inside:
            mean = sum(p for p, _ in inside) / len(inside)
            bins.append(Bin(low, high, mean, Count(sum(t for _, t in inside), len(inside))))
        low = high
    return bins


def calibration_error(bins: Sequence[Bin]) -> float:
    """Mean distance of stated probability and true share, weighted by the number of statements."""
    total = sum(b.true.all for b in bins)
    return sum(b.true.all * abs(b.mean - b.true.share) for b in bins) / total if total else math.nan
