"""Text file of a test rig -> table of fields: encoding, header, delimiter and decimal sign are recognised.

Nothing is skipped silently: below the first row of numbers every line is a row, a comment (#, %, //) or
empty, or else the file is refused with the number of the line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.recording.decode import decoded
from bushcli.recording.fields import (
    ambiguous_thousands,
    begins_with_missing,
    is_grouped,
    is_number,
    only_numbers,
    ungrouped,
)
from bushcli.recording.header import heading, is_units_row, match_quality, named_columns
from bushcli.recording.table import SHOWN, TextTable

_COMMENTS = ("#", "%", "//")
#: Bounds on the work: a line of a thousand columns has some ten thousand characters.
LONGEST_LINE, MOST_COLUMNS = 20_000, 1_000
#: Number of lines, spread over the file, by which delimiter and decimal sign are recognised.
_SAMPLE = 4_000


@dataclass(frozen=True)
class Line:
    """A line that is not empty: its number from 1, its text, and whether it is a comment."""

    number: int
    text: str
    comment: bool


def read_table(path: Path, delimiter: str | None = None, decimal: str | None = None) -> TextTable:
    """Read a text file.

    Parameters
    ----------
    path : Path
    delimiter : str, optional
        "," ";" a tab or " " (any white space); recognised from the file when None.
    decimal : {".", ","}, optional
        Recognised from the file when None.

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
    left_out = _without_thousands(split, decimal)
    start, width = _rows(path, body, split, decimal)
    names, units, place = _header(path, lines, body[start].number, width, delimiter, decimal)
    numbers = [line.number for line in body[start:]]
    if given is None and (decimal == "," or delimiter in ";\t"):
        _refuse_thousands(path, split[start:], numbers, decimal)
    return TextTable(
        path=path,
        names=names,
        units=units,
        header_line=place,
        rows=split[start:],
        lines=numbers,
        decimal=decimal,
        remarks=tuple(left_out),
    )


def table_of_fields(path: Path, part: str, cells: Sequence[tuple[int, Sequence[str]]]) -> TextTable:
    """Return the table of a sheet that is split into fields already.

    Parameters
    ----------
    path : Path
    part : str
        Name of the sheet.
    cells : sequence of (int, sequence of str)
        Number of each row that is not empty, from 1, and its fields; numbers with a decimal point.

    Raises
    ------
    RecordingError
        When there is no table of numbers, or a row does not fit.
    """
    body, lines, split = [], [], []
    for number, fields in cells:
        line = Line(number, "\t".join(fields), bool(fields) and fields[0].startswith(_COMMENTS))
        if not line.comment or begins_with_missing(line.text):
            body.append(line)
            split.append(list(fields))
        lines.append(line)
    decimal = max((".", ","), key=lambda sign: sum(_is_row(fields, sign) for fields in split))
    if not any(_is_row(fields, decimal) for fields in split):
        what = "has no table with two columns of numbers"
        raise RecordingError(Problem(f"{path} ({part})" if part else str(path), what))
    start, width = _rows(path, body, split, decimal)
    names, units, place = _header(path, lines, body[start].number, width, "\t", decimal)
    return TextTable(
        path=path,
        names=names,
        units=units,
        part=part,
        header_line=place,
        rows=split[start:],
        lines=[line.number for line in body[start:]],
        decimal=decimal,
    )


def _rows(path: Path, body: Sequence[Line], split: Sequence[list[str]], decimal: str) -> tuple[int, int]:
    """Return the index of the first row and the number of columns; refuse a line below it that does not fit."""
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
    return start, width


def _without_thousands(split: Sequence[list[str]], decimal: str) -> list[str]:
    """Remove thousands separators from the columns that certainly have them, and return remarks about it."""
    said = []
    for column in range(max(map(len, split), default=0)):
        fields = [row[column] if column < len(row) else "" for row in split]
        found = ungrouped(fields, decimal)
        for row, plain in found.items():
            split[row][column] = plain
        if found:
            row, plain = next(iter(found.items()))
            said.append(
                f"column {column + 1}: thousands separators are removed from {len(found)} numbers: "
                f"{fields[row]} is read as {plain}"
            )
    return said


def _refuse_thousands(path: Path, rows: list[list[str]], lines: list[int], decimal: str) -> None:
    """Refuse numbers if the decimal sign of each of them could as well be a thousands separator."""
    found = ambiguous_thousands(rows, decimal)
    if found is None:
        return
    row, column = found
    text = rows[row][column]
    plain = text.replace(decimal, "")
    what = f"column {column + 1}: {text} may be {text.replace(',', '.')} or {plain}, and no other number shows which"
    other = "comma" if decimal == "," else "point"
    expected = (
        f'decimal = "{decimal}" in the table of the case file, if it is a decimal {other}; else write {plain}'
    )
    raise RecordingError(Problem(f"{path}:{lines[row]}", what, "", expected))


def _lines(path: Path, text: str) -> list[Line]:
    lines = []
    for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1):
        if len(line) > LONGEST_LINE:
            what = f"has {len(line)} characters"
            expected = f"at most {LONGEST_LINE} in a line: is this a recording, and does it have line ends?"
            raise RecordingError(Problem(f"{path}:{number}", what, "", expected))
        if line.strip():
            comment = line.lstrip().startswith(_COMMENTS) and not begins_with_missing(line)
            lines.append(Line(number, line, comment))
    return lines


def _split(text: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        text = text.replace("\t", " ").strip()
    # In a row of units, a single quotation mark means an inch.
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
    if only_numbers(fields, decimal):
        return len(fields) - fields.count("")
    return sum(is_number(field, decimal) or is_grouped(field, decimal) for field in fields)


def _is_row(fields: list[str], decimal: str) -> bool:
    """Whether a line looks like data: at least two numbers, and not more texts (a clock) than numbers."""
    count = _numeric(fields, decimal)
    return count >= 2 and 2 * count >= len(fields) - fields.count("")


def _dialect(path: Path, body: Sequence[Line], delimiter: str | None, decimal: str | None) -> tuple[str, str]:
    """Return the delimiter and decimal sign that make the most lines rows of numbers."""
    best, score = None, 0.0
    body = body[:: len(body) // _SAMPLE + 1]
    for sep in (delimiter,) if delimiter else (";", "\t", ",", " "):
        split = [_split(line.text, sep) for line in body]
        for sign in (decimal,) if decimal else (".", ","):
            rows = [fields for fields in split if _is_row(fields, sign)]
            common = Counter(len(fields) for fields in rows).most_common(1)
            # Rows without any text weigh more: "0,5 1,5" can also be split into three fields, two of them numbers.
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


def _start(path: Path, split: Sequence[list[str]], decimal: str) -> tuple[int, int, int]:
    """Return the index of the first row, and the most frequent number of fields, with and without empty last ones."""
    like = [_is_row(fields, decimal) for fields in split]
    raw = Counter(len(f) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    filled = Counter(len(_trimmed(f)) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    fits = [row and raw == len(f) for f, row in zip(split, like, strict=True)]
    for i, fit in enumerate(fits):
        if fit and (i + 1 == len(fits) or fits[i + 1]):
            return i, raw, filled
    raise RecordingError(Problem(str(path), "has no two consecutive rows of numbers"))


def _header(
    path: Path, lines: Sequence[Line], first: int, width: int, delimiter: str, decimal: str
) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Return names and units by column and the number of their line, from the lines above the first row of numbers."""
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
            _refuse_percent(path, line, fields[0], units[0])
            return tuple(fields), units, place or line.number
    rows = [line for line in above if not line.comment]
    lost = [line for line in rows if len(_trimmed(_split(line.text, delimiter))) == width]
    _no_data(path, [line for line in lost if _numeric(_split(line.text, delimiter), decimal)])
    return empty, units, place


def _refuse_percent(path: Path, line: Line, name: str, unit: str) -> None:
    """Refuse a header that begins with "% strain": the sign may begin a comment or be the unit of the first column."""
    if not line.text.lstrip().startswith("%") or unit or name.startswith("%") or heading(name).written:
        return
    if match_quality(name, "strain"):
        what = f'"% {name[:SHOWN]}": the % may begin a comment or be the unit of the strain'
        expected = f'"# {name[:SHOWN]}" or "{name[:SHOWN]} [%]"'
        raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))


def _are_unknown_units(fields: list[str], above: Sequence[list[str]]) -> bool:
    """Whether a line is a row of unknown units: it names no quantity, but a line above it does."""
    return not named_columns(fields) and any(named_columns(other) >= 2 for other in above)


def _header_fields(text: str, delimiter: str, width: int) -> list[str] | None:
    """Return the fields of a header line if it has one field for each column."""
    attempts = [_split(text, delimiter)]
    if delimiter in " \t":
        # A header may be aligned with blanks above columns separated by tabs; in "Weg [mm]  Kraft [N]" names may
        # contain single spaces, and a unit belongs to the name before it.
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
            what = f'"{line.text.strip()[:SHOWN]}" is neither a header nor a row of numbers'
            expected = "names, units or numbers in all columns; put # in front of a remark"
            raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))
