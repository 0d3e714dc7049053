"""Text of a test rig -> table of fields: encoding, header, delimiter and decimal sign are found out.

Nothing is skipped silently: below the first row of numbers every line is a row, a comment (#, %, //) or
empty, or the file is refused with the line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.decode import decoded
from bushcli.recording.fields import (
    ambiguous_thousands,
    begins_with_missing,
    is_number,
    says_missing,
    sentinel,
    to_float,
)
from bushcli.recording.header import is_units_row, named_columns

#: A slip or a code for an error; far below the largest float, so that products of measured values stay
#: finite.
_LARGEST = 1e100
_COMMENTS = ("#", "%", "//")
#: Bounds on the work: a line of a thousand columns has some ten thousand characters.
LONGEST_LINE, MOST_COLUMNS = 20_000, 1_000
#: Lines, spread over the file, by which delimiter and decimal sign are found out.
_SAMPLE = 4_000
_SHOWN = 40


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
    header_line : int
        Line number of the units, or of the names where they have no row of their own; 0 without a header.
    """

    path: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    decimal: str
    header_line: int = 0

    def label(self, column: int) -> str:
        """Return how a message names a column (from 0): ``column 2 (force_N)``."""
        name = self.names[column]
        return f"column {column + 1} ({name[:_SHOWN]})" if name else f"column {column + 1}"

    def numbers(self, column: int, accepted: Collection[float] = ()) -> NDArray[np.float64]:
        """Return a column (from 0) as numbers, (n,).

        Parameters
        ----------
        column : int
        accepted : collection of float
            Numbers that the user says were measured, in the unit of the file.

        Raises
        ------
        RecordingError
            At the first field that is empty, not a number, not finite, or looks like a code for a missing value,
            with line and column.
        """
        fields = [row[column] if column < len(row) else "" for row in self.rows]
        values = np.empty(len(fields))
        for i, field in enumerate(fields):
            if not is_number(field, self.decimal):
                what = f'"{field[:_SHOWN]}" is not a number' if field else "is empty"
                raise self._refused(i, column, what)
            if says_missing(field):
                raise self._refused(i, column, f"{field} is a missing value")
            values[i] = to_float(field, self.decimal)
            if not np.isfinite(values[i]):
                raise self._refused(i, column, f"{field[:_SHOWN]} is not a finite number")
            if abs(values[i]) > _LARGEST:
                raise self._refused(i, column, f"{field[:_SHOWN]} is no measurement")
        code = sentinel(fields, values, accepted)
        if code is not None:
            where = f"{self.path}:{self.lines[code]}"
            what = f"{self.label(column)}: {fields[code]} looks like a code for a missing value"
            expected = (
                "if it is one, delete the row or put # in front of it; if it was measured, "
                f"accept = [{values[code]:g}] in the table of the case file"
            )
            raise RecordingError(Problem(where, what, "", expected))
        return values

    def _refused(self, row: int, column: int, what: str) -> RecordingError:
        sign = "comma" if self.decimal == "," else "point"
        expected = f"numbers with a decimal {sign} and without thousands separators"
        if "missing value" in what:
            expected = "delete the row, or put # and a blank in front of it"
        return RecordingError(
            Problem(f"{self.path}:{self.lines[row]}", f"{self.label(column)}: {what}", "", expected)
        )


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
    lines = _lines(path, decoded(path))
    body = [line for line in lines if not line.comment]
    given = decimal
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
    if width > MOST_COLUMNS:
        what = f"has {width} columns"
        raise RecordingError(
            Problem(str(path), what, "", f"at most {MOST_COLUMNS}: leave out those not needed")
        )
    names, units, place = _header(path, lines, body[start].number, width, delimiter, decimal)
    numbers = [line.number for line in body[start:]]
    if given is None and (decimal == "," or delimiter in ";\t"):
        _refuse_thousands(path, split[start:], numbers, decimal)
    return TextTable(path, names, units, split[start:], numbers, decimal, place)


def _refuse_thousands(path: Path, rows: list[list[str]], lines: list[int], decimal: str) -> None:
    """Refuse numbers of which each could as well have a separator of thousands."""
    found = ambiguous_thousands(rows, decimal)
    if found is None:
        return
    row, column = found
    text = rows[row][column]
    plain = text.replace(decimal, "")
    what = f"column {column + 1}: {text} may be {text.replace(',', '.')} or {plain}, and no other number tells which"
    other = "comma" if decimal == "," else "point"
    expected = (
        f'decimal = "{decimal}" in the table of the case file, if it is a decimal {other}; else write {plain}'
    )
    raise RecordingError(Problem(f"{path}:{lines[row]}", what, "", expected))


def _lines(path: Path, text: str) -> list[Line]:
    lines = []
    for number, line in enumerate(re.split(r"\r\n|\n|\r", text), start=1):
        if len(line) > LONGEST_LINE:
            what = f"has {len(line)} characters"
            expected = f"at most {LONGEST_LINE} in a line: is this a recording, and are its lines ended?"
            raise RecordingError(Problem(f"{path}:{number}", what, "", expected))
        if line.strip():
            comment = line.lstrip().startswith(_COMMENTS) and not begins_with_missing(line)
            lines.append(Line(number, line, comment))
    return lines


def _split(text: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        text = text.replace("\t", " ").strip()
    # A single quotation mark is the unit of an inch, in a row of units.
    if text.count('"') % 2 == 0 and '"' in text:
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
    body = body[:: len(body) // _SAMPLE + 1]
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
) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return names and units by column and their line, from the lines above the first row of numbers (its line)."""
    empty = ("",) * width
    units, place, passed = empty, 0, []
    above = [line for line in lines if line.number < first]
    full: list[tuple[Line, list[str]]] = []
    for line in reversed(above):
        fields = _header_fields(re.sub(r"^\s*(#|%(?=\s)|//)+", "", line.text), delimiter, width)
        texts = fields is not None and any(re.search(r"[^\W\d_]|[%°\"']", f) for f in fields)
        if fields is None or not texts or _numeric(fields, decimal):
            passed += [] if line.comment else [line]
        else:
            full.append((line, fields))
    for i, (line, fields) in enumerate(full):
        further = [other for _, other in full[i + 1 :]]
        if units == empty and (is_units_row(fields) or _are_unknown_units(fields, further)):
            units, place = tuple(fields), line.number
        else:
            _no_data(path, [one for one in passed if one.number > line.number])
            return tuple(fields), units, place or line.number
    rows = [line for line in above if not line.comment]
    lost = [line for line in rows if len(_trimmed(_split(line.text, delimiter))) == width]
    _no_data(path, [line for line in lost if _numeric(_split(line.text, delimiter), decimal)])
    return empty, units, place


def _are_unknown_units(fields: list[str], above: Sequence[list[str]]) -> bool:
    """Whether a line is a row of units that are not known: it names no quantity, and a line above it does."""
    return not named_columns(fields) and any(named_columns(other) >= 2 for other in above)


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


def _no_data(path: Path, lines: Sequence[Line]) -> None:
    """Refuse lines between the header and the first row: they would be dropped silently."""
    for line in lines:
        if re.search(r"\w|[%°\"']", line.text):
            what = f'"{line.text.strip()[:_SHOWN]}" is neither a header nor a row of numbers'
            expected = "names, units or numbers in all columns; put # in front of a remark"
            raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))
