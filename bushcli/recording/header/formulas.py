"""Names of columns that are formulas: ``abs(Force)``, ``-Force``, ``Force^2``, ``1/Displacement``."""

from __future__ import annotations

import re

from bushcli.recording.header.quality import name_quality, plain_name
from bushcli.recording.header.vocabulary import WORDS

#: A function of something in brackets, or something between bars. "Force|N" has a single bar.
_FUNCTION = re.compile(
    r"(?<![^\W_])(?:abs|absolute|absolut|betrag|sqrt|sqr|sq|log|log10|log2|ln|exp|sum|cumsum|diff|int|integral|d|der|norm"
    r"|rms|sign|neg|var|std|fft)[(\[{](?=([^()\[\]{}]*))|(?:^|[\s(\[=+])[|‖∥]+\s*([^|‖∥]+?)\s*[|‖∥]",
    re.IGNORECASE,
)
_NEGATIVE = re.compile(r"\s*[-−–—]\s*[^\W\d_]")
_INVERSE = re.compile(r"\W*1\s*/\s*[^\W\d_]")
#: A power of something else than a number: "10^3" is a factor.
_POWER = re.compile(r"(?<![\d\s])\s*(?:\^|\*\*)\s*[-+−(]?\d|(?<=[^\W\d_])[²³](?![^\W_])")
#: Quantities by which others are divided: a force over a travel is a stiffness.
_DIVISORS = ("length", "angle", "time", "strain", "stretch")


def is_formula(text: str, rest: str) -> bool:
    """Whether a name is a formula of a quantity, so that its column is not the quantity as it was measured."""
    inside = [next(part for part in found.groups() if part is not None) for found in _FUNCTION.finditer(text)]
    if (
        any(_kinds(part) for part in inside)
        or _NEGATIVE.match(text)
        or _INVERSE.match(text)
        or _POWER.search(rest)
    ):
        return True
    over, slash, under = rest.partition("/")
    first, second = (_kinds(over), _kinds(under)) if slash else (set(), set())
    return bool(first and second.intersection(_DIVISORS)) and not first & second


def _kinds(text: str) -> set[str]:
    """Return the quantities that a text may name."""
    return {kind for kind in WORDS if name_quality(plain_name(text), kind)}
