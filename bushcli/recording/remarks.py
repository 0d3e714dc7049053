"""Texts in brackets behind the name of a column: a remark, ``Force (filtered)``, or a unit, ``Force (kN)``.

A text is a unit, known or not, unless it is one of a closed list of remarks.
"""

from __future__ import annotations

import re

from bushcli.recording.factors import factor_in
from bushcli.recording.quality import name_quality, plain_name
from bushcli.recording.units import tabulated_unit
from bushcli.recording.vocabulary import COUNTED, FILLING, POWER, REMARKS, WORDS, is_foreign, known_word

#: The number of a channel.
_CHANNEL = re.compile(r"\d{1,2}")
#: Numbers that are no channels: 0.1, 1,0, 0-5, 0..10; x2 may be a factor.
_VALUE = re.compile(r"\d\s*(?:[.,]+|[-–]|to|bis)\s*\d|(?<![^\W_])[xX](?:[02-9]|\d\d)", re.IGNORECASE)
#: What a nominal stress is, behind its name: "Stress (F/A0)".
_QUOTIENT = re.compile(r"\s*(?:force|load|kraft|f)\s*/\s*a_?0?\s*", re.IGNORECASE)
#: Words of a nominal stress or strain.
_NOMINAL = frozenset({"eng", "nom"})


def is_remark(inside: str, rest: str, timed: bool, has_unit: bool) -> bool:
    """Whether the text in brackets of a name is a remark, such as ``(Max)`` or ``(Ch. 2)``, and not a unit.

    Parameters
    ----------
    inside : str
        The text in brackets.
    rest : str
        The name without brackets.
    timed : bool
        Whether it names a time.
    has_unit : bool
        Whether the name has a known unit elsewhere; words of any quantity are remarks then: "Travel (Load frame) [mm]".
    """
    words = plain_name(inside).split()
    if words == ["min"]:
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        return not timed or inside.strip() != "min"
    if not words or tabulated_unit(inside) is not None or factor_in(inside) or _VALUE.search(inside):
        return False
    if timed and words == ["std"] and "Std" in inside:
        return False  # Stunden: hours
    if any(word.isdigit() for word in words) and any(tabulated_unit(word) is not None for word in words):
        return False  # "001 in"
    letter = words[0] if len(words) == 1 and len(words[0]) == 1 and words[0].isalpha() else ""
    if has_unit and not letter:
        return all(known_word(word) for word in words)
    name = plain_name(rest)
    kinds = {kind for kind in WORDS if name_quality(name, kind)}
    if letter:
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        return letter in "xyz" or any(letter in WORDS[kind] for kind in kinds)
    if "stress" in kinds and _QUOTIENT.fullmatch(inside):
        return True
    if len(words) == 1 and words[0].isdigit():
        return _CHANNEL.fullmatch(words[0]) is not None and not POWER.fullmatch(words[0])
    own = {word for kind in kinds for known in WORDS[kind] for word in known.split()}
    own |= _NOMINAL if kinds & {"stress", "strain"} else set()
    told = [word for i, word in enumerate(words) if not _fills(word) and _tells(words, i, own, timed)]
    return bool(told) and all(word in told or _fills(word) for word in words)


def _fills(word: str) -> bool:
    """Whether a word may stand in a remark beside others."""
    return word in FILLING or _CHANNEL.fullmatch(word) is not None


def _tells(words: list[str], i: int, own: set[str], timed: bool) -> bool:
    """Whether one of the words in brackets is a remark: one of the closed list, of the quantity, or of a channel."""
    word = words[i].rstrip("0123456789")
    if timed and word == "sample":
        return False  # Time [sample] counts samples
    if word in REMARKS or word in own or (is_foreign(word) and word not in COUNTED):
        return True
    # "Strain 1" is the name of a channel.
    numbered = word != words[i] or (i + 1 < len(words) and words[i + 1].isdigit())
    return numbered and any(word in known for known in WORDS.values())
