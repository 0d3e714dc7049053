"""A diagnosis' answer in one form for old and new results: sets of effects with probabilities.

Old results name effects and list rivals, sets that they consider equally possible: each set gets the same probability,
and an effect counts as certain if it is in all of them. New results have models with probabilities.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Names = frozenset[str]
Line = Mapping[str, Any]

UNKNOWN: Names = frozenset({"unknown"})
# Share of the posterior in the credible set, and least probability of an effect that counts as stated.
CREDIBLE = STATED = 0.95
# Tolerance for a sum of rounded probabilities that should be 0.95.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Answer:
    """An answer.

    Attributes
    ----------
    verdict : str
        The tool's verdict; "no result" where there is none.
    named : frozenset of str
        Named effects, without their rigs.
    sets : tuple of (frozenset of str, float)
        Sets of effects and their probability, best first; {"unknown"} is physics that is not in the catalogue.
    effects : mapping
        Effect (and "unknown") -> probability.
    line : mapping
        Line of the ledger.
    """

    verdict: str
    named: Names
    sets: tuple[tuple[Names, float], ...]
    effects: Mapping[str, float]
    line: Line

    @cached_property
    def credible(self) -> tuple[Names, ...]:
        """The fewest sets that together hold 95 %; all sets if they hold less."""
        fewest, total = [], 0.0
        for names, probability in self.sets:
            fewest.append(names)
            total += probability
            if total >= CREDIBLE - ROUNDING:
                break
        return tuple(fewest)

    @cached_property
    def stated_effects(self) -> Names:
        """Effects that are stated with a probability of 95 % or more."""
        return frozenset(n for n, p in self.effects.items() if p >= STATED - ROUNDING and n != "unknown")

    def of(self, right: Iterable[Names]) -> float:
        """Sum of the probabilities of these sets."""
        wanted = set(right)
        return min(1.0, sum(p for names, p in self.sets if names in wanted))

    def misfit(self, wanted: Iterable[Names]) -> float | None:
        """Smallest misfit of the fits with these sets of effects, in standard deviations of the noise; None if none."""
        sets = set(wanted)
        trials = (self.line.get("searched") or {}).get("trials") or []
        fits = [t["misfit"] for t in trials if bases(t["effects"]) in sets and t.get("misfit") is not None]
        return min(map(float, fits), default=None)

    @property
    def faults(self) -> Names:
        """Kinds of data faults that are reported."""
        return frozenset(str(fault["kind"]) for fault in self.line.get("data_faults") or [])


def base(name: str) -> str:
    """An effect's name without its rig: "offset" of "offset@radial" or "offset (radial)"."""
    return name.partition("@")[0].partition(" (")[0]


def bases(names: Iterable[str]) -> Names:
    """Names without rigs."""
    return frozenset(map(base, names))


def answer_of(line: Line) -> Answer:
    """Read a line of a ledger."""
    if "verdict" not in line:
        return Answer("no result", frozenset(), (), {}, line)
    named = bases(effect["name"] for effect in line["effects"])
    if "models" in line or "probability" in line:
        return _new(line, named)
    # An effect named in addition to "unexplained" is only the nearest one of the catalogue.
    sets = [UNKNOWN] if line["verdict"] == "unexplained" else []
    for names in (named, *map(bases, line["rivals"])):
        if names not in sets:
            sets.append(names)
    share = 1.0 / len(sets)
    effects = {n: share * sum(n in names for names in sets) for n in frozenset().union(*sets)}
    return Answer(line["verdict"], named, tuple((names, share) for names in sets), effects, line)


def _new(line: Line, named: Names) -> Answer:
    probabilities: dict[Names, float] = {}
    for model in line.get("models") or []:
        names = bases(model["effects"])
        probabilities[names] = probabilities.get(names, 0.0) + float(model["probability"] or 0.0)
    sets = tuple(sorted(probabilities.items(), key=lambda item: -item[1]))
    effects: dict[str, float] = {}
    # An effect may be in either of two rigs: its probability follows from the models, not from the sum over rigs.
    for name, probability in (line.get("probability") or {}).items():
        if name == "nothing":
            # "nothing" is not an effect.
            continue
        effects[base(name)] = max(effects.get(base(name), 0.0), float(probability or 0.0))
    for name in frozenset().union(*probabilities) if probabilities else ():
        effects[name] = max(
            effects.get(name, 0.0), sum(p for names, p in probabilities.items() if name in names)
        )
    return Answer(line["verdict"], named, sets, {n: min(p, 1.0) for n, p in effects.items()}, line)
