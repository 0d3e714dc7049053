"""Factors in the name of a column, "Force x 10": they are not applied."""

from __future__ import annotations

import re

#: Before a factor among the units of a column.
FACTOR = "factor"
_N = r"\d+(?:[.,]\d+)?(?:[eE][-+−]?\d+)?"
#: A factor in a name, with its number in a group: "Force/10", "2*Force", "2x Force", "Travel x 0.1", "Gain 5". An upper
#: X before a number may be an axis; "Force 2 x" may be the axis x of the second sensor.
_TIMES = re.compile(
    rf"(?:[×*÷·/]|(?<![^\W_])x)\s*(?P<behind>[-+−]?{_N})"
    rf"|(?<![\w.,])(?P<before>[-−]?{_N})(?:\s*[×*]|x(?![^\W_]))|^\W*(?P<first>{_N})\s+x(?=[\s_])"
    rf"|(?<![^\W_])(?:scale|scaling|gain|factor|faktor|multiplier)\W*(?P<called>{_N})",
)
#: A power of ten or another number that cannot be that of a channel: "10^3", "e-3", "1e3", "E3", "0.5 Force".
_POWERS = re.compile(
    r"(?<![\d.])10\s*\^\s*[-+−]?\d+|(?<![\d.])10[⁻⁺]?[¹²³⁴-⁹]+|X\s*10+(?![\d.])"
    r"|(?<![^\W_])(?:\d+(?:[.,]\d+)?)?(?:[eE][-+−]\d+|e\d+)(?![^\W_])|(?<![^\W_])(?:\d[\d.,]*E\d+|E[3-9])(?![^\W_])"
    r"|^\W*\d+[.,]\d+(?=\s)|(?<![\w.,])0[.,]\d+\W*$"
    # Thousands as in accounts: "'000 N", "000's N".
    r"|['’‘´`]0+(?![^\W_]|[.,]\d)|(?<![\w.,])0{2,}['’]?s(?![^\W_])"
)
#: Before the "/50" in the type of a sensor, WA/50, S9M/5kN, and before the "/-25" of a range, +/-25.
_TYPE = re.compile(r"(?<![^\W_])(?:WA|[A-EG-QS-Z]\d+[A-Z]\w*)$|\+$")
_WORDS = re.compile(
    r"(?<![^\W_])(?:(?:ten|hundred|thousand|million)(?:th)?s?|tsd|tausend(?:stel)?|hundertstel|zehntel)(?![^\W_])",
    re.IGNORECASE,
)
#: A prefix apart from its unit, "Force mega N": at the end of the name, after which the unit stood.
_PREFIX = re.compile(r"(?<![^\W_])(?:giga|mega|kilo|hecto|deca|deci|centi|milli|micro)\W*$", re.IGNORECASE)


def factor_in(name: str) -> str:
    """Return the factor that the name of a column contains, as written, or an empty text; a factor of 1 is none."""
    for found in (_POWERS.search(name), _WORDS.search(name), _PREFIX.search(name)):
        if found:
            return found[0].strip()
    for found in _TIMES.finditer(name):
        if found[0].startswith("/") and _TYPE.search(name[: found.start()]):
            continue
        if number_of(next(text for text in found.groups() if text is not None)) != 1.0:
            return found[0].strip()
    return ""


def number_of(text: str) -> float:
    """Return a number with a decimal point or comma."""
    return float(text.replace(",", ".").replace("−", "-"))
