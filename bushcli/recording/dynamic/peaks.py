"""What a text says of an amplitude: the peak, the double amplitude from peak to peak, or the root mean square."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Literal

Peak = Literal["peak", "double", "rms", ""]

#: The peak of a sine over the number that is said to be this.
FACTORS: Mapping[str, float] = {"peak": 1.0, "double": 0.5, "rms": math.sqrt(2.0), "": 1.0}

#: Between the two ends of a cycle's travel: "-", "to", "2", or nothing; and the ends.
_TO = r"[\s_/\u2010-\u2014-]*(?:(?:to|2|zu|à|a|t)[\s_\u2010-\u2014-]*)?"
_TOP = r"(?:peaks?|pk|spitzen?|crest|cr[êe]te|pico?|picco)"
_BOTTOM = r"(?:valleys?|troughs?|tal|creux|valle)"
_TRAVEL = (
    rf"(?:p{_TO}p|{_TOP}{_TO}(?:{_TOP}|{_BOTTOM})|p[-/2]v|max{_TO}min|doubled?|doppel\w*|schwing(?:breite|weite)|range"
    r"|dda|total|full(?=[\s_-]*(?:amplitude|peak|travel|stroke|wave)))"
)
_HALF = r"(?:half|semi|halbe[nrs]?|demi|½|1\s?/\s?2|0[.,]5)"
#: What is said, by the words that say it, those first that contain others: half of what is double is a peak.
_SAID: tuple[tuple[Peak, str], ...] = (
    ("peak", rf"{_HALF}[\s_()\[*-]*(?:of[\s_]+)?(?:the[\s_]+)?{_TRAVEL}|{_TRAVEL}[\s_)\]]*/\s?2"),
    ("double", _TRAVEL),
    ("peak", rf"(?:0|zero|null|zéro){_TO}(?:{_TOP}|p)"),
    ("rms", r"r\.?m\.?s|eff|effektiv\w*|quadratic mean"),
    ("peak", rf"{_TOP}|half|semi|halbe[nrs]?|single|einfache?[nrs]?|scheitel\w*"),
)
_SIGN = r"±|\+/-"
_PATTERNS = [(said, re.compile(rf"(?<![^\W_])(?:{form})(?![^\W_])")) for said, form in _SAID]
#: Words that say it, behind a number and its unit.
BEHIND = "(?i:" + "|".join(form for _, form in _SAID) + ")"
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z][a-z])")


def said_of_peak(text: str) -> tuple[Peak, str]:
    """Return what a text says of an amplitude, and the text in lower case without the words that say it.

    Nothing is said where a text says two things, as "peak amplitude rms".
    """
    rest = re.sub(_SIGN, " peak ", _CAMEL.sub(" ", text)).lower()
    said: set[Peak] = set()
    for meant, form in _PATTERNS:
        if form.search(rest):
            said.add(meant)
            rest = form.sub(" ", rest)
    return said.pop() if len(said) == 1 else "", rest
