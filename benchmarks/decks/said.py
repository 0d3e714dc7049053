"""What a diagnosis said, in one form for old and new results: sets of effects with probabilities.

Old results name effects and list rivals, sets that they hold for equally possible: each set has the same probability,
and an effect is stated for certain where it is in all of them. New ones have models with probabilities.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Names = frozenset[str]
Line = Mapping[str, Any]

UNKNOWN: Names = frozenset({"unknown"})
# Share of the posterior that the credible set holds, and the probability from which an effect counts as stated.
CREDIBLE = STATED = 0.95
# A sum of rounded probabilities that should be 0.95 counts as such.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Said:
    """An answer.

    Attributes
    ----------
    verdict : str
        Of the tool; "no result" where there is none.
    named : frozenset of str
        Effects that are named, without the rig.
    sets : tuple of (frozenset of str, float)
        Sets of effects and their probability, best first; {"unknown"} is physics that is not in the catalogue.
    effects : mapping
        Effect (and "unknown") -> probability.
    line : mapping
        Of the ledger.
    """

    verdict: str
    named: Names
    sets: tuple[tuple[Names, float], ...]
    effects: Mapping[str, float]
    line: Line

    @cached_property
    def credible(self) -> tuple[Names, ...]:
        """The smallest number of sets that hold 95 % together; all where they do not."""
        found, total = [], 0.0
        for names, probability in self.sets:
            found.append(names)
            total += probability
            if total >= CREDIBLE - ROUNDING:
                break
        return tuple(found)

    @cached_property
    def stated(self) -> Names:
        """Effects that are said to be there with 95 % or more."""
        return frozenset(n for n, p in self.effects.items() if p >= STATED - ROUNDING and n != "unknown")

    def of(self, right: Iterable[Names]) -> float:
        """Probability of all these sets together."""
        wanted = set(right)
        return min(1.0, sum(p for names, p in self.sets if names in wanted))

    @property
    def faults(self) -> Names:
        """Kinds of data faults that are said."""
        return frozenset(str(one["kind"]) for one in self.line.get("data_faults") or [])


def base(name: str) -> str:
    """An effect's name without its rig: "offset" of "offset@radial" or "offset (radial)"."""
    return name.partition("@")[0].partition(" (")[0]


def bases(names: Iterable[str]) -> Names:
    """Names without rigs."""
    return frozenset(map(base, names))


def said(line: Line) -> Said:
    """Read a line of a ledger."""
    if "verdict" not in line:
        return Said("no result", frozenset(), (), {}, line)
    named = bases(one["name"] for one in line["effects"])
    if "models" in line or "probability" in line:
        return _new(line, named)
    # What is named beside "unexplained" is the nearest that the catalogue has.
    sets = [UNKNOWN] if line["verdict"] == "unexplained" else []
    for names in (named, *map(bases, line["rivals"])):
        if names not in sets:
            sets.append(names)
    share = 1.0 / len(sets)
    effects = {n: share * sum(n in names for names in sets) for n in frozenset().union(*sets)}
    return Said(line["verdict"], named, tuple((names, share) for names in sets), effects, line)


def _new(line: Line, named: Names) -> Said:
    found: dict[Names, float] = {}
    for model in line.get("models") or []:
        names = bases(model["effects"])
        found[names] = found.get(names, 0.0) + float(model["probability"] or 0.0)
    sets = tuple(sorted(found.items(), key=lambda item: -item[1]))
    effects: dict[str, float] = {}
    # The same effect in two rigs: it is there where it is in either, which the models know and the sum does not.
    for name, probability in (line.get("probability") or {}).items():
        if name == "nothing":
            # The probability of no effect is not that of an effect.
            continue
        effects[base(name)] = max(effects.get(base(name), 0.0), float(probability or 0.0))
    for name in frozenset().union(*found) if found else ():
        effects[name] = max(effects.get(name, 0.0), sum(p for names, p in found.items() if name in names))
    return Said(line["verdict"], named, sets, {n: min(p, 1.0) for n, p in effects.items()}, line)
