"""Text of a test rig -> table of fields: encoding, header, delimiter and decimal sign are found out.

Nothing is skipped silently: below the first row of numbers every line is a row, a comment (#, %, //) or
empty, or the file is refused with the line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.decode import decoded
from bushcli.recording.header import is_units_row

_NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII),
    ",": re.compile(r"[+-]?(\d+(,\d+)?|,\d+)([eEdD][+-]?\d+)?", re.ASCII),
}
#: What programs write for a value that is none; it belongs to the table, so that it is refused by line and
#: column.
_NO_NUMBER = re.compile(r"[+-]?(nan|inf|infinity|-?1[.,]#\w+|#n/a|#nv|n/a|null)", re.IGNORECASE)
#: A slip or a code for an error; far below the largest float, so that products of measured values stay
#: finite.
_LARGEST = 1e100
_COMMENTS = ("#", "%", "//")


@dataclass(frozen=True)
class Line:
    """A line that is not empty: its number from 1, its text, and whether it is a comment."""

    number: int
    text: str
    comment: bool


@dataclass(frozen=True)
class TextTable:
    """The rows of a text file, as texts.

    Attributes
    ----------
    path : Path
    names, units : tuple of str
        Header by column, empty texts where there is none.
    rows : list of list of str
        Fields without surrounding spaces; every row has at least ``len(names)`` fields.
    lines : list of int
        Line number of each row, from 1.
    decimal : str
    """

    path: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    decimal: str

    def label(self, column: int) -> str:
        """Return how a message names a column (from 0): ``column 2 (force_N)``."""
        name = self.names[column]
        return f"column {column + 1} ({name})" if name else f"column {column + 1}"

    def numbers(self, column: int) -> NDArray[np.float64]:
        """Return a column (from 0) as numbers, (n,).

        Raises
        ------
        RecordingError
            At the first field that is empty, not a number, or not finite, with line and column.
        """
        values = np.empty(len(self.rows))
        for i, row in enumerate(self.rows):
            field = row[column] if column < len(row) else ""
            if not is_number(field, self.decimal):
                what = f'"{field}" is not a number' if field else "is empty"
                raise self._refused(i, column, what)
            values[i] = _to_float(field, self.decimal)
            if not np.isfinite(values[i]):
                raise self._refused(i, column, f"{field} is not a finite number")
            if abs(values[i]) > _LARGEST:
                raise self._refused(i, column, f"{field} is no measurement")
        return values

    def _refused(self, row: int, column: int, what: str) -> RecordingError:
        sign = "comma" if self.decimal == "," else "point"
        expected = f"numbers with a decimal {sign} and without thousands separators"
        return RecordingError(
            Problem(f"{self.path}:{self.lines[row]}", f"{self.label(column)}: {what}", "", expected)
        )


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number, including the ways in which programs write that it is none."""
    field = field.replace("\u2212", "-")
    return bool(_NUMBER[decimal].fullmatch(field) or _NO_NUMBER.fullmatch(field))


def read_table(path: Path, delimiter: str | None = None, decimal: str | None = None) -> TextTable:
    """Read a text file.

    Parameters
    ----------
    path : Path
    delimiter : str, optional
        "," ";" a tab or " " (any white space); found out when None.
    decimal : {".", ","}, optional
        Found out when None.

    Raises
    ------
    RecordingError
        When the file cannot be read, has no table of numbers, or has a line that does not fit.
    """
    lines = _lines(decoded(path))
    body = [line for line in lines if not line.comment]
    delimiter, decimal = _dialect(path, body, delimiter, decimal)
    split = [_split(line.text, delimiter) for line in body]
    start, raw, filled = _start(path, split, decimal)
    for line, fields in zip(body[start:], split[start:], strict=True):
        if len(fields) != raw and len(_trimmed(fields)) != filled:
            what = f"{len(_trimmed(fields))} fields, where the rows before have {filled}"
            last = " (the last line: was the recording cut off?)" if line is body[-1] else ""
            expected = f"{filled} numbers; delete the line or put # in front of it"
            raise RecordingError(Problem(f"{path}:{line.number}", what + last, "", expected))
    width = max(len(_trimmed(fields)) for fields in split[start:])
    names, units = _header(path, lines, body[start].number, width, delimiter, decimal)
    return TextTable(path, names, units, split[start:], [line.number for line in body[start:]], decimal)


def _to_float(field: str, decimal: str) -> float:
    text = field.replace("\u2212", "-").replace(decimal, ".").replace("D", "e").replace("d", "e")
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _lines(text: str) -> list[Line]:
    numbered = enumerate(re.split(r"\r\n|\n|\r", text), start=1)
    return [Line(i, line, line.lstrip().startswith(_COMMENTS)) for i, line in numbered if line.strip()]


def _split(text: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        text = text.replace("\t", " ").strip()
    if '"' in text:
        try:
            fields = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
            return [f.strip() for f in fields if f.strip() or delimiter != " "]
        except (csv.Error, StopIteration):
            pass
    return text.split() if delimiter == " " else [field.strip() for field in text.split(delimiter)]


def _trimmed(fields: list[str]) -> list[str]:
    """Return the fields without empty ones at the end: trailing delimiters."""
    end = len(fields)
    while end and not fields[end - 1]:
        end -= 1
    return fields[:end]


def _numeric(fields: list[str], decimal: str) -> int:
    return sum(is_number(field, decimal) for field in fields)


def _is_row(fields: list[str], decimal: str) -> bool:
    """Whether a line looks like data: two numbers at least, and not more texts (a clock) than numbers."""
    count = _numeric(fields, decimal)
    return count >= 2 and 2 * count >= len([field for field in fields if field])


def _dialect(path: Path, body: Sequence[Line], delimiter: str | None, decimal: str | None) -> tuple[str, str]:
    """Return the delimiter and decimal sign that make the most lines rows of numbers."""
    best, score = None, 0.0
    for sep in (delimiter,) if delimiter else (";", "\t", ",", " "):
        split = [_split(line.text, sep) for line in body]
        for sign in (decimal,) if decimal else (".", ","):
            rows = [fields for fields in split if _is_row(fields, sign)]
            common = Counter(len(fields) for fields in rows).most_common(1)
            # Rows without any text weigh more: "0,5 1,5" is also three fields of which two are numbers.
            whole = sum(_numeric(fields, sign) == len(_trimmed(fields)) for fields in rows)
            points = (common[0][1] if common else 0) + 2.0 * whole
            if points > score:
                best, score = (sep, sign), points
    if best is None:
        what = "has no table with two columns of numbers"
        if delimiter or decimal:
            what += " for this delimiter and decimal sign"
        raise RecordingError(Problem(str(path), what, expected="e.g. time_s,displacement_mm,force_N"))
    return best


def _start(path: Path, split: list[list[str]], decimal: str) -> tuple[int, int, int]:
    """Return the index of the first row, and the usual number of fields, with and without empty last ones."""
    like = [_is_row(fields, decimal) for fields in split]
    raw = Counter(len(f) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    filled = Counter(len(_trimmed(f)) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    fits = [row and raw == len(f) for f, row in zip(split, like, strict=True)]
    for i, fit in enumerate(fits):
        if fit and (i + 1 == len(fits) or fits[i + 1]):
            return i, raw, filled
    raise RecordingError(Problem(str(path), "has no two rows of numbers below each other"))


def _header(
    path: Path, lines: Sequence[Line], first: int, width: int, delimiter: str, decimal: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units by column, from the lines above the first row of numbers (its line number)."""
    empty = ("",) * width
    units, passed = empty, []
    above = [line for line in lines if line.number < first]
    for line in reversed(above):
        text = re.sub(r"^\s*(#|%(?=\s)|//)+", "", line.text)
        fields = _header_fields(text, delimiter, width)
        if (
            fields is None
            or _numeric(fields, decimal)
            or not any(re.search(r"[^\W\d_]|[%°]", f) for f in fields)
        ):
            passed += [] if line.comment else [line]
        elif units == empty and is_units_row(fields):
            units = tuple(fields)
        else:
            _no_data(path, passed, delimiter, decimal)
            return tuple(fields), units
    just_above = [line for line in above if not line.comment][-1:]
    if just_above and len(_trimmed(_split(just_above[0].text, delimiter))) == width:
        _no_data(path, just_above, delimiter, decimal)
    return empty, units


def _header_fields(text: str, delimiter: str, width: int) -> list[str] | None:
    """Return the fields of a header line when there is one for each column."""
    attempts = [_split(text, delimiter)]
    if delimiter in " \t":
        # A header over tabs may be laid out with blanks; in "Weg [mm]  Kraft [N]" names may hold single
        # spaces, and a unit belongs to the name before it.
        attempts.append(re.split(r"\s{2,}|\t", text.strip()))
        attempts.append(text.split())
        attempts.append(re.sub(r"\s+([\[(][^\])]*[\])])", r"\1", text).split())
    for fields in attempts:
        fields = _trimmed(fields)
        if len(fields) == width:
            return fields
    return None


def _no_data(path: Path, lines: Sequence[Line], delimiter: str, decimal: str) -> None:
    """Refuse lines with numbers between the header and the first row: they would be dropped silently."""
    for line in lines:
        if _numeric(_split(line.text, delimiter), decimal):
            what = f'"{line.text.strip()[:40]}" is neither a header nor a row of numbers'
            expected = "numbers in all columns; put # in front of a remark"
            raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))
