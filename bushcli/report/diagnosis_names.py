"""Laws, models and probabilities of a diagnosis in words; the JSON has the identifiers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bushcli.effects.titles import phrase
from bushcli.report.quantity import listed

# A probability beyond these is given as a limit, because no model is certain.
_ALMOST_NEVER, _ALMOST_CERTAIN = 0.01, 0.99


def law_title(name: str) -> str:
    """Return the name of a law as in the literature: "Mooney-Rivlin", "neo-Hookean"."""
    return "-".join(part if part == "neo" else part.capitalize() for part in name.split("_"))


def together(names: Sequence[str], none: str = "no effect") -> str:
    """Return a set of effects as part of a sentence: "Mullins softening with internal friction and offset".

    Parameters
    ----------
    names : sequence of str
        Names of effects, with their rigs.
    none : str
        Words for an empty set.
    """
    first, *others = [phrase(name) for name in names] or [none]
    return f"{first} with {listed(others)}" if others else first


def model_title(law: str, names: Sequence[str], variants: Mapping[str, str] | None = None) -> str:
    """Return a model as a table shows it: "Yeoh + Mullins softening + offset (radial)", "Yeoh alone".

    Parameters
    ----------
    law : str
        Name of the law.
    names : sequence of str
        Names of effects, with their rigs.
    variants : mapping of str to str, optional
        Effect -> what distinguishes it from the same effect in another model: "viscoelasticity, 2 branches".
    """
    if not names:
        return f"{law_title(law)} alone"
    known = variants or {}
    parts = [f"{phrase(name)} ({known[name]})" if known.get(name) else phrase(name) for name in names]
    return " + ".join((law_title(law), *parts))


def chance(probability: float) -> str:
    """Return a probability in words: "97 %", "more than 99 %", "less than 1 %"; never 0 or 100 %."""
    return short_chance(probability).replace(">", "more than").replace("<", "less than")


def short_chance(probability: float) -> str:
    """Return a probability for a table: "97 %", "> 99 %", "< 1 %"; a dash for nan."""
    if probability != probability:
        return "-"
    if probability < _ALMOST_NEVER:
        return "< 1 %"
    return "> 99 %" if probability > _ALMOST_CERTAIN else f"{100 * probability:.0f} %"
