"""Texts in brackets behind the name of a column: a remark, ``Force (filtered)``, or a unit, ``Force (kN)``.

A text is a unit, known or not, unless it is one of a closed list of remarks.
"""

from __future__ import annotations

import re

from bushcli.recording.header.factors import factor_in
from bushcli.recording.header.loose_numbers import ranges_in
from bushcli.recording.header.quality import name_quality, plain_name
from bushcli.recording.header.units import AMBIGUOUS, find_unit, tabulated_unit
from bushcli.recording.header.vocabulary import (
    COUNTED,
    FILLING,
    POWER,
    REMARKS,
    WORDS,
    is_code,
    is_foreign,
    known_word,
)

#: The number of a channel.
_CHANNEL = re.compile(r"\d{1,2}")
#: Numbers that are no channels: 0.1, 1,0, 0-5, 0..10; x2 may be a factor.
_VALUE = re.compile(r"\d\s*(?:[.,]+|[-–]|to|bis)\s*\d|(?<![^\W_])[xX](?:[02-9]|\d\d)", re.IGNORECASE)
#: What a nominal stress is, behind its name: "Stress (F/A0)".
_QUOTIENT = re.compile(r"\s*(?:force|load|kraft|f)\s*/\s*a_?[0o]?\s*", re.IGNORECASE)
#: The same of a strain and a stretch: "Strain (dL/L0)", "Stretch (L/L0)".
_RATIOS = {
    "strain": re.compile(r"\s*[dΔδ]\s*l\s*/\s*l_?[0o]?\s*", re.IGNORECASE),
    "stretch": re.compile(r"\s*l\s*/\s*l_?[0o]\s*", re.IGNORECASE),
}
#: Numbers with units: the range of a sensor, the rate of samples, the speed of a test.
_RANGE = re.compile(r"(?:[±<>=~]|\+/?-|-)?\d+(?:[.,]\d+)?\s?k?(?:[^\W\d_]|[°%/])*")
#: An input of a device: "Dev1/ai0".
_PORT = re.compile(r"\w*\d[\w.]*[/_]a?[io]\d{1,3}", re.IGNORECASE)
#: Prefixes and systems of units.
_ABOUT_UNITS = frozenset(
    ["kilo", "mega", "milli", "micro", "si", "imperial", "metric", "metrisch", "english", "british", "us"]
)
#: A mark or a date.
_MARK = re.compile(r"[+*]+|\d{4}-\d\d-\d\d|\d\d?\.\d\d?\.\d{4}")
#: A serial number.
_SERIAL = re.compile(r"\b(?:s/?n|ser(?:ial)?\.?(?: ?no)?)\b\W*\w+", re.IGNORECASE)
#: Words of a nominal stress or strain.
_NOMINAL = frozenset({"eng", "nom"})


def is_remark(inside: str, rest: str, timed: bool, has_unit: bool) -> bool:
    """Whether the text in brackets of a name is a remark, such as ``(Max)`` or ``(Ch. 2)``, and not a unit."""
    words = plain_name(inside).split()
    if words == ["min"]:
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        return not timed or inside.strip() != "min"
    if ranges_in(inside) == [inside.strip()] and not inside.strip()[0].isdigit():
        return True
    if is_code(inside.strip()) or _PORT.fullmatch(inside.strip()) or (has_unit and _is_beside_unit(inside)):
        return True
    if not words or tabulated_unit(inside) is not None or factor_in(inside) or _VALUE.search(inside):
        return False
    if timed and words == ["std"] and "Std" in inside:
        return False  # Stunden: hours
    if any(word.isdigit() for word in words) and any(tabulated_unit(word) is not None for word in words):
        return False  # "001 in"
    letter = words[0] if len(words) == 1 and len(words[0]) == 1 and words[0].isalpha() else ""
    # A name that stands in brackets as a whole, as Simulink writes: "<Force>".
    name = plain_name(rest) or ("" if len(inside.strip()) == 1 else plain_name(inside))
    kinds = {kind for kind in WORDS if name_quality(name, kind)}
    if letter:
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        return letter in "xyz" or any(letter in WORDS[kind] for kind in kinds)
    if "stress" in kinds and _QUOTIENT.fullmatch(inside):
        return True
    if any(kind in kinds and form.fullmatch(inside) for kind, form in _RATIOS.items()):
        return True
    if len(words) == 1 and words[0].isdigit():
        return _CHANNEL.fullmatch(words[0]) is not None and not POWER.fullmatch(words[0])
    own = {word for kind in kinds for known in WORDS[kind] for word in known.split()}
    own |= _NOMINAL if kinds & {"stress", "strain"} else set()
    told = [word for i, word in enumerate(words) if not _fills(word) and _tells(words, i, own, timed)]
    return bool(told) and all(word in told or _fills(word) for word in words)


def is_unknown_word(inside: str) -> bool:
    """Whether a text in brackets is a single word that is not known from names of columns."""
    return re.fullmatch(r"\W*[^\W_]+\W*", inside) is not None and not known_word(re.sub(r"\W", "", inside))


def _is_beside_unit(inside: str) -> bool:
    """Whether a text in brackets is a remark beside a known unit: it is no unit itself, has none, and is no factor.

    A number with a unit is a range or a rate: "Load cell (25 kN) [kN]", "Force (LP 100 Hz) [N]".
    """
    if _SERIAL.fullmatch(inside.strip()) or _MARK.fullmatch(inside.strip()):
        return True
    ranged = _RANGE.sub(" ", inside)
    if tabulated_unit(inside) is not None or factor_in(inside):
        return False
    words = re.split(r"[\s,;:=]+", ranged)
    named = [word for word in words if len(re.sub(r"[\W\d_]", "", word)) > 1]
    has_number = ranged != inside and re.search(r"[^\W\d_]", inside) is not None
    if not (named or has_number):
        return False
    return not any(tabulated_unit(word) is not None or _is_unit(word) for word in named)


def _is_unit(word: str) -> bool:
    """Whether an unknown word is a unit of any quantity, or says something about one."""
    if word.lower() in AMBIGUOUS or word.lower() in _ABOUT_UNITS:
        return True
    if known_word(word):
        return False
    # The fs of "fs = 1 kHz" are no femtoseconds.
    found = [find_unit(word, kind) for kind in ("force", "length")]
    return any(unit is not None and unit.measured != "time" for unit in found)


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
