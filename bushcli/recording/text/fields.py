"""Fields of a text table -> numbers: decimal signs, thousands separators, and codes for missing values."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A number by its decimal sign, without backtracking.
NUMBER = {
    ".": r"[+-]?+(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eEdD][+-]?+\d++)?+",
    ",": r"[+-]?+(?:\d++(?:,\d++)?+|,\d++)(?:[eEdD][+-]?+\d++)?+",
}
_NUMBER = {sign: re.compile(number, re.ASCII) for sign, number in NUMBER.items()}
#: Numbers and empty fields, one to a line: one look at many fields costs a fifth of one at each.
_NUMBERS = {sign: re.compile(rf"(?:{n})?(?:\n(?:{n})?)*", re.ASCII) for sign, n in NUMBER.items()}
# What spreadsheets write in English and German for a missing value.
_MISSING = (
    r"#(?:n/a|nv|n/d|na|nan|inf|\#+)|#(?:div/0|value|ref|num|null|wert|bezug|zahl|valeur|nombre|valor|calc|spill|io)!"
    r"|#name\?"
)
#: What programs write instead of a number; it belongs to the table, so that it is refused with its line and column.
_NO_NUMBER = re.compile(rf"[+-]?(nan|inf|infinity|-?1[.,]#\w+|n/a|null)|{_MISSING}", re.IGNORECASE)
_MISSING_FIRST = re.compile(rf"\s*(?:{_MISSING})\s*(?:[;,\t ]|$)", re.IGNORECASE)
#: "1,234" is 1.234 or 1234; "0,123", "12,34" and "1234,567" can only be decimal.
_THOUSANDS = {sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}[{sign}]\d{{3}}", re.ASCII) for sign in ".,"}
#: Thousands separators in use with a decimal point and with a decimal comma: 1,234.5  1.234,5  1'234.5  1 234,5.
_GROUPS = {".": ",'\u2019 \u00a0\u202f", ",": ".'\u2019 \u00a0\u202f"}
_GROUPED = {
    sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?P<by>[{signs}])\d{{3}}((?P=by)\d{{3}})*([{sign}]\d*)?", re.ASCII)
    for sign, signs in _GROUPS.items()
}
#: What loggers write for a missing value: 999 and more nines, -999.25 (LAS), the limits of 16, 24 and 32 bits and of
#: floating-point numbers, 9.91e37 (SCPI), 1e10 and beyond.
_CODE = re.compile(
    r"[+-]?(9{3,}([.,](0*|9+))?|3276[78]([.,]0*)?|6553[56]([.,]0*)?|214748364[78]([.,]0*)?"
    r"|8388607([.,]0*)?|16777215([.,]0*)?|999[.,]250*|[19]([.,][09]*)?[eE]\+?[1-9]\d|9[.,]9\d?[eE]\+?37"
    r"|3[.,]40?\d*[eE]\+?38|1[.,]79\d*[eE]\+?308)",
    re.ASCII,
)
_LIMITS = (32767.0, 32768.0, 65535.0, 65536.0, 8388607.0, 16777215.0, 2147483647.0, 2147483648.0)
#: Signs that are minus signs; and dashes and hyphens, which are such before a number that they do not join to another.
_MINUS = re.compile(r"[\u2212\ufe63\uff0d]|(?<![^\W_])[\u2010-\u2013](?=[.,]?\d)")
#: Distance of a code from the other values, as a multiple of their range; or its distance from both neighbours, if
#: there are at least this many other values: no peak of a measured curve is so sharp then.
_FAR, _JUMP, _DENSE = 2.0, 0.5, 20


def with_hyphens(text: str) -> str:
    """Return a text of a header with a hyphen for each minus sign of Unicode: ``−20 °C``, ``–20 °C``."""
    return _MINUS.sub("-", text)


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number, or what programs write instead of one, such as "nan"."""
    field = field.replace("\u2212", "-")
    return bool(_NUMBER[decimal].fullmatch(field) or _NO_NUMBER.fullmatch(field))


def only_numbers(fields: Sequence[str], decimal: str) -> bool:
    """Whether each field is a number or empty."""
    text = "\n".join(fields)
    return text.count("\n") < max(len(fields), 1) and _NUMBERS[decimal].fullmatch(text) is not None


def to_float(field: str, decimal: str) -> float:
    """Return the value of a field, nan where it is not a number."""
    text = field.replace("\u2212", "-").replace(decimal, ".").replace("D", "e").replace("d", "e")
    try:
        return float(text)
    except ValueError:
        return float("nan")


def is_grouped(field: str, decimal: str) -> bool:
    """Whether a field can only be a number with thousands separators: ``1.234,5``, but not ``1.234``."""
    match = _GROUPED[decimal].fullmatch(field)
    return match is not None and (decimal in field or match["by"] not in ".," or field.count(match["by"]) > 1)


def is_thousands(field: str, sign: str) -> bool:
    """Whether a sign may separate thousands in a number: ``1,234``, but not ``0,123`` or ``12,34``."""
    return _THOUSANDS[sign].fullmatch(field) is not None


def without_thousands(fields: Sequence[str], decimal: str) -> dict[int, str]:
    """Return the fields of a column that have thousands separators, by index, without the separators.

    One number that can only be written with separators, such as ``1.234,5``, proves that the sign separates thousands
    in the others too.
    """
    # Most columns have no such sign at all: one look at all fields costs a fiftieth of one at each.
    text = "".join(fields)
    signed = any(sign in text for sign in _GROUPS[decimal])
    proved = signed and any(is_grouped(field, decimal) for field in fields)
    matches = ((i, _GROUPED[decimal].fullmatch(field)) for i, field in enumerate(fields if proved else ()))
    return {i: match[0].replace(match["by"], "") for i, match in matches if match is not None}


def says_missing(field: str) -> bool:
    """Whether a field is what spreadsheets write for a missing value."""
    return bool(_NO_NUMBER.fullmatch(field)) and field.startswith("#")


def begins_with_missing(line: str) -> bool:
    """Whether a line begins with a missing value: ``#N/A;0.1;12`` is a row, not a comment."""
    return _MISSING_FIRST.match(line) is not None


def ambiguous_thousands(rows: Sequence[Sequence[str]], decimal: str) -> tuple[int, int] | None:
    """Return row and column of the first number whose sign may separate thousands; None if any rules this out."""
    first = None
    for i, row in enumerate(rows):
        for j, field in enumerate(row):
            if decimal not in field or not _NUMBER[decimal].fullmatch(field):
                continue
            if not is_thousands(field, decimal):
                return None
            first = first or (i, j)
    return first


def sentinel(values: Array, written: Callable[[int], str], accepted: Collection[float]) -> int | None:
    """Return the index of the first value that looks like a code for a missing one, such as -9999, or None."""
    size = np.abs(values)
    # Nearly a power of ten (three nines and more), a limit of integers, or beyond 1e10: only these are looked at.
    tens = 10.0 ** np.ceil(np.log10(np.maximum(size, 1.0)))
    may_be = (size >= 999.0) & ((size >= 0.999 * tens) | (size >= 1e10) | np.isin(np.floor(size), _LIMITS))
    codes = np.zeros(len(values), dtype=bool)
    for i in np.flatnonzero(may_be & ~np.isin(values, list(accepted))):
        codes[i] = _CODE.fullmatch(written(int(i))) is not None
    others = values[~codes]
    if not codes.any() or len(others) < 2:
        return None
    low, high = others.min(), others.max()
    span = max(high - low, 1e-12 * max(abs(low), abs(high)), 1e-300)
    far = (values < low - _FAR * span) | (values > high + _FAR * span)
    plain_rows = np.flatnonzero(~codes)
    if len(others) >= _DENSE:
        place = np.searchsorted(plain_rows, np.arange(len(values)))
        before, after = others[np.maximum(place - 1, 0)], others[np.minimum(place, len(others) - 1)]
        jump = np.minimum(np.abs(values - before), np.abs(values - after))
        far |= (jump > _JUMP * span) & ((values > before) == (values > after))
    rows = np.flatnonzero(codes & far)
    return int(rows[0]) if len(rows) else None
