"""Numbers in the name of a column: factors, ``Force x 10``, never applied, ranges, ``Force ±25``, and others."""

from __future__ import annotations

import re

from bushcli.recording.header.vocabulary import NUMBERED_WORDS, POWER

_SIGNED_NUMBER = r"\d+(?:[.,]\d+)?(?:[eE][-+−]?\d+)?"
#: A factor in a name, with its number in a group: "Force/10", "2*Force", "2x Force", "Travel x 0.1", "Gain 5". An upper
#: X before a number may be an axis; "Force 2 x" may be the axis x of the second sensor.
_TIMES = re.compile(
    rf"(?:[×*÷·/]|(?<![^\W_])x)\s*(?P<behind>[-+−]?{_SIGNED_NUMBER})"
    rf"|(?<![\w.,])(?P<before>[-−]?{_SIGNED_NUMBER})(?:\s*[×*]|x(?![^\W_]))|^\W*(?P<first>{_SIGNED_NUMBER})\s+x(?=[\s_])"
    rf"|(?<![^\W_])(?:scale|scaling|gain|factor|faktor|multiplier)\W*(?P<called>{_SIGNED_NUMBER})",
)
#: A power of ten or another number that cannot be that of a channel: "10^3", "e-3", "1e3", "E3", "0.5 Force".
_TENS = re.compile(
    r"(?<![\d.])10\s*\^\s*[-+−]?\d+|(?<![\d.])10[⁻⁺]?[¹²³⁴-⁹]+|X\s*10+(?![\d.])"
    r"|(?<![^\W_])(?:\d+(?:[.,]\d+)?)?(?:[eE][-+−]\d+|e\d+)(?![^\W_])|(?<![^\W_])(?:\d[\d.,]*E\d+|E[3-9])(?![^\W_])"
    r"|^\W*\d+[.,]\d+(?=\s)|(?<![\w.,])0[.,]\d+\W*$"
    # Thousands as in accounts: "'000 N", "000's N".
    r"|['’‘´`]0+(?![^\W_]|[.,]\d)|(?<![\w.,])0{2,}['’]?s(?![^\W_])"
)
#: Factors in words; a prefix apart from its unit, "Force mega N", at the end of the name, after which the unit stood.
_WORDED = re.compile(
    r"(?<![^\W_])(?:(?:ten|hundred|thousand|million)(?:th)?s?|tsd|tausend(?:stel)?|hundertstel|zehntel)(?![^\W_])",
    re.IGNORECASE,
)
_PREFIX = re.compile(r"(?<![^\W_])(?:giga|mega|kilo|hecto|deca|deci|centi|milli|micro)\W*$", re.IGNORECASE)
#: Before the "/50" in the type of a sensor, WA/50, S9M/5kN, and before the "/-25" of a range, +/-25.
_TYPE = re.compile(r"(?<![^\W_])(?:WA|[A-EG-QS-Z]\d+[A-Z]\w*)$|\+$")

_N = r"\d+(?:[.,]\d+)?"
#: No further digit, letter, degree or percent behind a number: these would belong to it.
_END = r"(?![\w°%]|[.,]\d|\s*[°%])"
#: A range with its sign: "±25", "+/- 2.5", "< 25", "-25...+25", "-25 to 25", "0-10".
RANGE = re.compile(
    rf"(?:±|\+\s*/?\s*[-−–]|(?<![<>=])[<≤]=?)\s*{_N}{_END}(?!\s*k?[^\W\d_])"
    rf"|(?<![\w.,])(?:[-−–]\s*{_N}|0)\s*(?:\.{{2,}}|…|[-–/]|to\b|bis\b|à\b)\s*\+?\s*{_N}{_END}(?!\s*k?[^\W\d_])"
)
#: A number that stands alone. Behind a hyphen or a slash it belongs to the word before it: "LC-1500", "1-2".
_ALONE = re.compile(rf"(?<![^\W_])(?<![.,:/−–-]){_N}{_END}(?![-:/]\d)")
_BEFORE = re.compile(r"(#|[^\W\d_]+)[\s._:,(-]*$")
#: Words before the number of a test or a device.
_COUNTING = NUMBERED_WORDS | {
    "run", "test", "specimen", "sample", "probe", "part", "versuch", "messung", "serie", "series", "id", "sn", "module",
    "modul", "slot", "port", "#",
}  # fmt: skip
#: A word beside a range.
RANGE_WORDS = frozenset({"range", "bereich", "messbereich", "plage", "gamme", "campo", "rango"})
#: Smallest whole number that is more likely a range or a factor than the number of a channel; judgement.
_LARGE = 100


def number_of(text: str) -> float:
    """Return a number with a decimal point or comma."""
    return float(text.replace(",", ".").replace("−", "-"))


def largest(text: str) -> float:
    """Return the largest number in a range as written."""
    return max(map(number_of, re.findall(_N, text)))


def factor_in(name: str) -> str:
    """Return the factor that the name of a column contains, as written, or an empty text; a factor of 1 is none."""
    factors = [match[0] for form in (_TENS, _WORDED, _PREFIX) if (match := form.search(name))]
    factors += [
        match[0]
        for match in _TIMES.finditer(name)
        if not (match[0].startswith("/") and _TYPE.search(name[: match.start()]))
        and number_of(in_groups(match)) != 1.0
    ]
    return factors[0].strip() if factors else ""


def ranges_in(text: str) -> list[str]:
    """Return the ranges, as written, that a text gives with a sign and without a unit: ``±25``."""
    return [match[0].strip() for match in RANGE.finditer(text)]


def loose_numbers(name: str) -> list[str]:
    """Return the numbers of a name without brackets that may be factors or ranges: the ``2.5`` of ``Force 2.5``.

    A number behind a word such as "channel", and a whole number of one or two digits, is the number of a channel.
    """
    numbers, name = [], RANGE.sub(" ", name)
    for match in _ALONE.finditer(name):
        before, digits = _BEFORE.search(name[: match.start()]), match[0]
        whole = digits.isdigit()
        counts = (before is not None and before[1].lower() in _COUNTING) or (digits[0] == "0" and whole)
        large = whole and (int(digits) >= _LARGE or POWER.fullmatch(digits) is not None)
        if not counts and (large or (not whole and number_of(digits) != 1.0)):
            numbers.append(digits)
    return numbers


def in_groups(match: re.Match[str]) -> str:
    """Return the text of the only group of a match that took part in it."""
    return next(text for text in match.groups() if text is not None)
