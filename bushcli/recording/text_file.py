"""Text file of a test rig -> table of fields: encoding, header, delimiter and decimal sign are recognised.

Nothing is skipped silently: below the first row of numbers every line is a row, a comment (#, %, //) or
empty, or else the file is refused with the number of the line. Headers that are repeated and text below the last row
are left out, and a remark says so.
"""

from __future__ import annotations

import re
from bisect import bisect
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from bushcli.errors import Problem, RecordingError, count_of
from bushcli.recording.header.head import header, unify_column_order
from bushcli.recording.header.name import named_columns
from bushcli.recording.text.decode import read_text
from bushcli.recording.text.fields import ambiguous_thousands, begins_with_missing, without_thousands
from bushcli.recording.text.lines import (
    COMMENTS,
    Dialect,
    Line,
    Sheet,
    lines_of,
    numbers_in,
    split_line,
    trim_end,
)
from bushcli.recording.text.rows import AlikeRows, Form, SplitRows, end_of_head, split_runs
from bushcli.recording.text.table import CALCULATE, SHOWN, TextTable

#: Most columns of a table.
MOST_COLUMNS = 1_000
#: Number of lines, spread over the file, by which delimiter and decimal sign are recognised.
_SAMPLE = 1_000
_EXAMPLE = "e.g. time_s,displacement_mm,force_N"
#: Numbers, dates and times of day in a line above the names.
_NUMBERS = re.compile(r"\d[\d.,:/]*")


#: Whether a line that is no row may stand between the names and the last row.
_Between = Callable[[str], object]


class _Given(NamedTuple):
    """What is known of a text before it is read, see `read_table`."""

    delimiter: str | None
    decimal: str | None
    single: bool
    between: _Between | None


def read_table(
    path: Path,
    delimiter: str | None = None,
    decimal: str | None = None,
    single: bool = False,
    between: _Between | None = None,
) -> TextTable:
    """Read a text file.

    Parameters
    ----------
    path : Path
    delimiter : str, optional
        "," ";" a tab or " " (any white space); recognised from the file when None.
    decimal : {".", ","}, optional
        Recognised from the file when None.
    single : bool
        Whether a single column is enough.
    between : callable, optional
        Whether a line that is no row may stand between the names and the last row, because it states a condition of
        the rows below it.

    Raises
    ------
    RecordingError
        When the file cannot be read, has no table of numbers, or has a line that does not fit.
    """
    text, given = read_text(path), _Given(delimiter, decimal, single, between)
    end, table = end_of_head(text), None
    if end:
        try:
            body = [line for line in lines_of(path, text[:end]) if not line.comment]
            form = Form.of_head(body, *_dialect(path, body, given))
        except RecordingError:
            form = None
        lines, runs = ([], []) if form is None else split_runs(path, text, end, form)
        table = _table(path, lines, runs, given) if runs else None
    if table is None:
        table = _table(path, lines_of(path, text), [], given)
    assert table is not None
    return table


def _table(path: Path, lines: list[Line], runs: list[AlikeRows], given: _Given) -> TextTable | None:
    """Return the table of a text from its lines but for those of runs; None where only all lines together tell more."""
    body = [line for line in lines if not line.comment]
    single = _of_one_column(body, given) if given.single else None
    dialect = single or _dialect(path, body, given)
    sheet = Sheet(path, lines, body, [split_line(line.text, dialect.delimiter) for line in body], dialect)
    remarks = _remove_thousands(sheet.split, dialect.decimal)
    sheet, width, repeats, reordered = _rows(sheet, 1 if single else 2, given.between)
    rows = sheet.split[sheet.start :]
    grouped = None
    if given.decimal is None and (dialect.decimal == "," or dialect.delimiter in ";\t"):
        grouped = ambiguous_thousands(rows, dialect.decimal)
    differs = runs and dialect != (runs[0].form.delimiter, runs[0].form.decimal)
    if runs and (reordered or differs or grouped is not None):
        return None
    # A sign in front of rows of numbers makes them comments.
    below = (line for line in sheet.lines if line.comment and line.number > sheet.first_row_line)
    split = ((line.number, split_line(line.content.strip(), dialect.delimiter)) for line in below)
    commented = [n for n, cells in split if len(cells) == numbers_in(cells, dialect.decimal) == width]
    if commented:
        several = len(commented) > 1
        rows_are = (
            f"{len(commented)} rows of numbers behind # or % are"
            if several
            else "a row of numbers behind # or % is"
        )
        place = f"line {commented[0]}{' and others' if several else ''}"
        repeats.append(f"{rows_are} left out as comments ({place})")
    table = _with_header(sheet, width, len(rows[0]), (*remarks, *repeats))
    if grouped is not None:
        # The decimal sign of each number could as well be a thousands separator.
        row, column = grouped
        shown, sign = table.text(row, column), dialect.decimal
        plain = shown.replace(sign, "")
        either = f"{shown} may be {shown.replace(',', '.')} or {plain}"
        what = f"column {column + 1}: {either}, and no other number shows which"
        other = f"if it is a decimal {'comma' if sign == ',' else 'point'}; else write {plain}"
        raise table.refusal(what, f'decimal = "{sign}" in the table of the case file, {other}', row)
    parts: list[SplitRows | AlikeRows] = []
    start, numbers = 0, [line.number for line in body[sheet.start :]]
    for run in runs:
        stop = bisect(numbers, run.at)
        parts += [SplitRows(rows[start:stop], numbers[start:stop]), run]
        start = stop
    return replace(table, parts=(*parts, SplitRows(rows[start:], numbers[start:])))


def _with_header(sheet: Sheet, width: int, most: int, remarks: tuple[str, ...], part: str = "") -> TextTable:
    """Return the table of a sheet; last columns that have a name, but no value in any row, are among the columns."""
    delimiter = sheet.dialect.delimiter
    above = (trim_end(split_line(line.content, delimiter)) for line in sheet.above)
    widths = (len(f) for f in above if width < len(f) <= most and named_columns(f) >= 2)
    top = header(sheet, max(widths, default=width))
    numbers = [line.number for line in sheet.body[sheet.start :]]
    row_numbers = set(numbers)
    # Comments between the names and the first row belong to the rows below, as those between rows do.
    above_names = top.preamble[-1][0] if top.preamble else 0
    inside = (
        line
        for line in sheet.lines
        if above_names < line.number < numbers[-1] and (line.comment or line.number > numbers[0])
    )
    return TextTable(
        path=sheet.path,
        names=top.names,
        units=top.units,
        part=part,
        header_line=top.line,
        preamble=top.preamble,
        parts=(SplitRows(sheet.split[sheet.start :], numbers),),
        decimal=sheet.dialect.decimal,
        remarks=remarks,
        between=tuple((line.number, line.content) for line in inside if line.number not in row_numbers),
    )


def table_of_fields(path: Path, part: str, cells: Sequence[tuple[int, Sequence[str]]]) -> TextTable:
    """Return the table of a sheet that is split into fields already."""
    body, lines, split = [], [], []
    for number, fields in cells:
        line = Line(number, "\t".join(fields), bool(fields) and fields[0].startswith(COMMENTS))
        if not line.comment or begins_with_missing(line.text):
            body.append(line)
            split.append(list(fields))
        lines.append(line)
    counts = []
    for least, sign in ((2, "."), (2, ","), (1, "."), (1, ",")):
        are_rows = [_is_row(fields, sign, least) for fields in split]
        # Where single numbers count, all lines below the first must be such.
        if any(are_rows) and (least > 1 or (sum(are_rows) > 1 and all(are_rows[are_rows.index(True) :]))):
            counts.append((least, sum(are_rows), sign))
    fewest, _, decimal = max(counts, key=lambda count: count[:2], default=(0, 0, "."))
    if not fewest:
        what, expected = "has no table with two columns of numbers", ""
        if any(field.startswith("=") for fields in split for field in fields):
            what, expected = f"{what}: its formulas have no values", CALCULATE
        raise RecordingError(Problem(f"{path} ({part})" if part else str(path), what, "", expected))
    sheet = Sheet(path, lines, body, split, Dialect("\t", decimal))
    sheet, width, remarks, _ = _rows(sheet, fewest)
    return _with_header(sheet, width, MOST_COLUMNS, tuple(remarks), part)


def _rows(sheet: Sheet, fewest: int, between: _Between | None = None) -> tuple[Sheet, int, list[str], bool]:
    """Return a sheet with its first row, the number of columns, remarks, and whether columns were reordered.

    A line below that does not fit is refused. Headers that are repeated between the rows, as some rigs write them for
    each cycle, are removed.
    """
    body, split, decimal = sheet.body, sheet.split, sheet.dialect.decimal
    are_rows = [_is_row(fields, decimal, fewest) for fields in split]
    rows = [fields for fields, row in zip(split, are_rows, strict=True) if row]
    raw = Counter(map(len, rows)).most_common(1)[0][0]
    filled = Counter(len(trim_end(fields)) for fields in rows).most_common(1)[0][0]
    fits = [row and raw == len(f) for f, row in zip(split, are_rows, strict=True)]
    starts = (i for i, fit in enumerate(fits) if fit and (i + 1 == len(fits) or fits[i + 1]))
    start = next(starts, None)
    if start is None:
        raise RecordingError(Problem(str(sheet.path), "has no two consecutive rows of numbers"))
    sheet = replace(sheet, start=start)
    reordered = unify_column_order(sheet)
    remarks = [*reordered, *_remove_text_below(sheet)]
    if between is not None:
        above = (line.number < sheet.first_row_line and not line.comment for line in sheet.lines)
        stating = [
            replace(line, comment=True) if is_above and between(line.text) else line
            for line, is_above in zip(sheet.lines, above, strict=True)
        ]
        sheet = replace(sheet, lines=stating)
    for i in reversed(range(start, len(body))):
        text = not are_rows[i] and not numbers_in(split[i][:1], decimal)
        if between is not None and text and between(body[i].text):
            del body[i], split[i]
    below = list(enumerate(split[start:], start=start))
    wrong = [i for i, fields in below if len(fields) != raw and len(trim_end(fields)) != filled]
    # A header has as many fields as the rows have.
    full = [i for i, fields in below if len(fields) == raw and fields[-1][:1].isalpha()]
    texts = [i for i in full if not numbers_in(split[i], decimal)]
    repeated = _repeated_lines(sheet, sorted({*wrong, *texts}), filled)
    for i in wrong:
        if i not in repeated:
            fields = len(trim_end(split[i]))
            what = f"{count_of(fields, 'field')}, where the rows before have {filled}"
            last = " (the last line: was the recording cut off?)" if body[i] is body[-1] else ""
            remedy = f"{filled} numbers; delete the line or put # in front of it"
            raise sheet.refusal(body[i].number, what + last, remedy)
    if repeated:
        head, tail = body[repeated[0]].number, body[repeated[-1]].number
        span = f"{len(repeated)} lines that repeat the header are left out (lines {head} to {tail})"
        remarks.insert(0, span if tail > head else f"line {head} repeats the header and is left out")
        for i in reversed(repeated):
            del body[i], split[i]
    width = max(len(trim_end(fields)) for fields in split[start:])
    if width > MOST_COLUMNS:
        remedy = f"at most {MOST_COLUMNS}: leave out those not needed"
        raise RecordingError(Problem(str(sheet.path), f"has {width} columns", "", remedy))
    return sheet, width, remarks, bool(reordered)


def _remove_text_below(sheet: Sheet) -> list[str]:
    """Remove lines of text below the last row of numbers, such as "End of test" or "Max;12.5", and return a remark."""
    body, split, decimal = sheet.body, sheet.split, sheet.dialect.decimal
    end = len(split)
    if numbers_in(split[sheet.start][:1], decimal):
        while end > sheet.start:
            # A word or a line of signs, and no mark of a missing number.
            first = next((field for field in split[end - 1] if field), "")
            word = first[:1].isalpha() or not any(character.isalnum() for character in first)
            if not word or numbers_in([first], decimal):
                break
            end -= 1
    below = body[end:]
    del body[end:], split[end:]
    if not below:
        return []
    place = f'line {below[0].number}: "{below[0].text.strip()[:SHOWN]}"'
    single = f"the text below the table is left out ({place})"
    several = f"{len(below)} lines of text below the table are left out (the first is {place})"
    return [single if len(below) == 1 else several]


def _repeated_lines(sheet: Sheet, among: Sequence[int], width: int) -> list[int]:
    """Return which lines below the first row repeat those above it: whole groups of them, names included.

    Lines with a field for each column, names and units, are repeated if they are the same. The others, such as
    "Cycle 2", may differ in their numbers.
    """
    body, split = sheet.body, sheet.split
    texts = [line.text.strip() for line in body[: sheet.start]]
    head = {text for text, fields in zip(texts, split, strict=False) if len(trim_end(fields)) == width}
    labels = {_NUMBERS.sub("#", text) for text in texts if text not in head}
    repeated: list[int] = []
    for group in (list(run) for _, run in groupby(enumerate(among), lambda pair: pair[1] - pair[0])):
        lines = [i for _, i in group]
        repeats = [body[i].text.strip() for i in lines]
        full_rows = [text for text, i in zip(repeats, lines, strict=True) if len(trim_end(split[i])) == width]
        are_repeated = all(text in head or _NUMBERS.sub("#", text) in labels for text in repeats)
        if full_rows and are_repeated and all(text in head for text in full_rows):
            repeated += lines
    return repeated


def _remove_thousands(split: Sequence[list[str]], decimal: str) -> list[str]:
    """Remove thousands separators from the columns that certainly have them, and return remarks about it."""
    remarks = []
    for column in range(max(map(len, split), default=0)):
        fields = [row[column] if column < len(row) else "" for row in split]
        numbers = without_thousands(fields, decimal)
        for row, plain in numbers.items():
            split[row][column] = plain
        if numbers:
            row, plain = next(iter(numbers.items()))
            removed = f"thousands separators are removed from {len(numbers)} numbers"
            remarks.append(f"column {column + 1}: {removed}: {fields[row]} is read as {plain}")
    return remarks


def _is_row(fields: list[str], decimal: str, fewest: int = 2) -> bool:
    """Whether a line looks like data: two numbers at least, and not more texts (a clock); or one number."""
    count = numbers_in(fields, decimal)
    several = count >= 2 and 2 * count >= len(fields) - fields.count("")
    return count == len(trim_end(fields)) == 1 if fewest == 1 else several


def _of_one_column(body: Sequence[Line], given: _Given) -> Dialect | None:
    """Return delimiter and decimal sign of a file with a single column of numbers; None for any other file."""
    for sign in (given.decimal,) if given.decimal else (".", ","):
        split = [split_line(row.text, given.delimiter or (";" if ";" in row.text else "\t")) for row in body]
        are_rows = [_is_row(fields, sign, 1) for fields in split]
        first = are_rows.index(True) if any(are_rows) else len(are_rows)
        # Most lines, so that a line that does not fit is named.
        most = sum(are_rows) >= 2 and 2 * sum(are_rows) >= len(are_rows) - first
        has_name = first > 0 and "," not in body[first - 1].text
        without_comma = not any("," in line.text for line in body[first:])
        sure = has_name or given.delimiter or given.decimal or without_comma
        if most and sure:
            return Dialect(given.delimiter or (";" if any(";" in line.text for line in body) else "\t"), sign)
    return None


def _dialect(path: Path, body: Sequence[Line], given: _Given) -> Dialect:
    """Return the delimiter and decimal sign that make the most lines rows of numbers."""
    best, score = None, 0.0
    body = body[:: len(body) // _SAMPLE + 1]
    for sep in (given.delimiter,) if given.delimiter else (";", "\t", ",", "|", " "):
        split = [split_line(line.text, sep) for line in body]
        for sign in (given.decimal,) if given.decimal else (".", ","):
            rows = [fields for fields in split if _is_row(fields, sign)]
            common = Counter(map(len, rows)).most_common(1)
            # Rows without any text weigh more: "0,5 1,5" can also be split into three fields, two of them numbers.
            whole = sum(numbers_in(fields, sign) == len(trim_end(fields)) for fields in rows)
            points = (common[0][1] if common else 0) + 2.0 * whole
            if points > score:
                best, score = Dialect(sep, sign), points
    if best is None:
        what = "has no column of numbers" if given.single else "has no table with two columns of numbers"
        remedy = "e.g. displacement_mm, or time_s,displacement_mm" if given.single else _EXAMPLE
        # A line with an equals sign, as in a case file, is a statement.
        last = "" if not body or "=" in body[-1].text else body[-1].text
        if named_columns(re.split(r"[;\t,|]", last)) >= 2:
            what, remedy = "ends with the names of columns: no row of numbers follows", "export it again"
        elif given.delimiter or given.decimal:
            what += " for this delimiter and decimal sign"
        raise RecordingError(Problem(str(path), what, "", remedy))
    return best
