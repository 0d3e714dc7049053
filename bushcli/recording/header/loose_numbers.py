"""Numbers in the name of a column without a unit of their own: the range of ``Force ±25``, the 2.5 of ``Force 2.5``.

A number behind a word such as "channel", and a whole number of one or two digits, is the number of a channel.
"""

from __future__ import annotations

import re

from bushcli.recording.header.units import tabulated_unit
from bushcli.recording.header.vocabulary import NUMBERED_WORDS, POWER

_N = r"\d+(?:[.,]\d+)?"
#: No further digit, letter, degree or percent behind a number: these would belong to it.
_END = r"(?![\w°%]|[.,]\d|\s*[°%])"
#: A range with its sign: "±25", "+/- 2.5", "< 25", "-25...+25", "-25 to 25", "0-10".
_RANGE = re.compile(
    rf"(?:±|\+\s*/?\s*[-−–]|(?<![<>=])[<≤]=?)\s*{_N}{_END}(?!\s*k?[^\W\d_])"
    rf"|(?<![\w.,])(?:[-−–]\s*{_N}|0)\s*(?:\.{{2,}}|…|[-–/]|to\b|bis\b|à\b)\s*\+?\s*{_N}{_END}(?!\s*k?[^\W\d_])"
)
#: A number that stands alone. Behind a hyphen or a slash it belongs to the word before it: "LC-1500", "1-2".
_ALONE = re.compile(rf"(?<![^\W_])(?<![.,:/−–-]){_N}{_END}(?![-:/]\d)")
_BEFORE = re.compile(r"(#|[^\W\d_]+)[\s._:,(-]*$")
#: Words before the number of a test or a device.
_NUMBERED = NUMBERED_WORDS | {
    "run", "test", "specimen", "sample", "probe", "part", "versuch", "messung", "serie", "series", "id", "sn", "module",
    "modul", "slot", "port", "#",
}  # fmt: skip
#: A word beside a range.
_RANGE_WORDS = frozenset({"range", "bereich", "messbereich", "plage", "gamme", "campo", "rango"})
#: Smallest whole number that is more likely a range or a factor than the number of a channel; judgement.
_LARGE = 100


def ranges_in(text: str) -> list[str]:
    """Return the ranges, as written, that a text gives with a sign and without a unit: ``±25``."""
    return [found[0].strip() for found in _RANGE.finditer(text)]


def without_ranges(text: str) -> str:
    """Return a text without the ranges that it gives with a sign and without a unit."""
    return _RANGE.sub(" ", text)


def loose_numbers(name: str) -> list[str]:
    """Return the numbers of a name without brackets that may be factors or ranges: the ``2.5`` of ``Force 2.5``."""
    found = []
    name = without_ranges(name)
    for match in _ALONE.finditer(name):
        before = _BEFORE.search(name[: match.start()])
        digits = match[0]
        numbered = before is not None and before[1].lower() in _NUMBERED
        if numbered or (digits[0] == "0" and digits.isdigit()):
            continue
        large = digits.isdigit() and (int(digits) >= _LARGE or POWER.fullmatch(digits) is not None)
        if large or (not digits.isdigit() and float(digits.replace(",", ".")) != 1.0):
            found.append(digits)
    return found


def number_and_unit(word: str) -> str:
    """Return the unit in a word such as ``10kN``, or an empty text."""
    found = re.fullmatch(r"\d+(?:[.,]\d+)?([^\W\d_]+)", word)
    return found[1] if found and tabulated_unit(found[1]) is not None else ""


def without_range_words(words: list[str]) -> list[str]:
    """Return the words of a name that gives a range without those that say so: the "range" of ``Force range ±25``."""
    return [word for word in words if word.lower() not in _RANGE_WORDS]


def largest(text: str) -> float:
    """Return the largest number in a range as written."""
    return max(float(number.replace(",", ".")) for number in re.findall(_N, text))
