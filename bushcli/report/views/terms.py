"""Terms of a verdict, explained beside it on the page."""

from __future__ import annotations

import re
from collections.abc import Iterable

# By the words in which a verdict uses the term.
_TERMS = {
    r"misfit": (
        "misfit",
        "simulated minus recorded force; as one number its root mean square over all samples",
    ),
    r"\brms\b": ("rms", "root mean square over all samples, in percent of the recorded force range"),
    r"force range": ("force range", "the largest recorded force minus the smallest one"),
    r"\bnoise\b": (
        "noise",
        "scatter of the recorded force about a smooth curve: one standard deviation of it",
    ),
    r"too (soft|stiff)": (
        "too soft, too stiff",
        "at the same displacement the simulated force is smaller, or larger, than the recorded one",
    ),
    r"N(?: mm)?/(?:mm|deg)": (
        "stiffness in N/mm or N mm/deg",
        "secant from one end of the curve to the other",
    ),
    r"factor of .* on the stiffness": (
        "factor on the stiffness",
        "the number by which all simulated forces would have to be multiplied",
    ),
    r" ± ": ("±", "one standard error"),
    r"(than|about|\() ?\d+ %\)": (
        "percentage after an effect",
        "probability, given these recordings and how common the effect is, that it is there",
    ),
    r"formulas? .* err": (
        "error of the formulas",
        "how far the formulas of the law are assumed to be from the true behaviour of rubber",
    ),
    r"held out": ("held out", "not used to fit the model, but predicted by it"),
    r"hardly plausible": ("hardly plausible", "hardly any bushing has a value so far from the usual ones"),
    r"poorly determined": ("poorly determined", "many values of it describe the recordings nearly as well"),
}


def terms(lines: Iterable[str]) -> list[tuple[str, str]]:
    """Return the terms that occur in these lines, each with its meaning."""
    text = "\n".join(lines)
    return [meaning for words, meaning in _TERMS.items() if re.search(words, text, re.IGNORECASE)]
