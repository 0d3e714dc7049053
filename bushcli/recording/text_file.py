"""Text file of a test rig -> table of fields: encoding, header, delimiter and decimal sign are recognised.

Nothing is skipped silently: below the first row of numbers every line is a row, a comment (#, %, //) or
empty, or else the file is refused with the number of the line. Headers that are repeated and text below the last row
are left out, and a remark says so.
"""

from __future__ import annotations

import re
from bisect import bisect
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.blocks import in_one_order
from bushcli.recording.header.header_lines import header
from bushcli.recording.header.name import named_columns
from bushcli.recording.text.decode import decoded
from bushcli.recording.text.fields import (
    ambiguous_thousands,
    begins_with_missing,
    ungrouped,
)
from bushcli.recording.text.lines import COMMENTS, Line, lines_of, numbers_in, split_line, trimmed
from bushcli.recording.text.rows import AlikeRows, Form, SplitRows, end_of_head, sifted
from bushcli.recording.text.table import CALCULATE, SHOWN, TextTable

#: Most columns of a table.
MOST_COLUMNS = 1_000
#: Number of lines, spread over the file, by which delimiter and decimal sign are recognised.
_SAMPLE = 1_000
_EXAMPLE = "e.g. time_s,displacement_mm,force_N"
#: Numbers, dates and times of day in a line above the names.
_NUMBERS = re.compile(r"\d[\d.,:/]*")


def read_table(
    path: Path, delimiter: str | None = None, decimal: str | None = None, single: bool = False
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

    Raises
    ------
    RecordingError
        When the file cannot be read, has no table of numbers, or has a line that does not fit.
    """
    text = decoded(path)
    begin = end_of_head(text)
    if begin:
        try:
            body = [line for line in lines_of(path, text[:begin]) if not line.comment]
            form = Form.of_head(body, *_dialect(path, body, delimiter, decimal, single))
        except RecordingError:
            form = None
        lines, runs = ([], []) if form is None else sifted(path, text, begin, form)
        found = _table(path, lines, runs, delimiter, decimal, single) if runs else None
        if found is not None:
            return found
    found = _table(path, lines_of(path, text), [], delimiter, decimal, single)
    assert found is not None
    return found


def _table(
    path: Path,
    lines: list[Line],
    runs: list[AlikeRows],
    delimiter: str | None,
    decimal: str | None,
    single: bool,
) -> TextTable | None:
    """Return the table of a text from its lines but for those of runs; None where only all lines together tell more."""
    body = [line for line in lines if not line.comment]
    given = decimal
    alone = _of_one_column(body, delimiter, decimal) if single else None
    delimiter, decimal = alone or _dialect(path, body, delimiter, decimal, single)
    split = [split_line(line.text, delimiter) for line in body]
    left_out = _without_thousands(split, decimal)
    start, width, repeats, reordered = _rows(path, lines, body, split, delimiter, decimal, 1 if alone else 2)
    if runs and (reordered or (delimiter, decimal) != (runs[0].form.delimiter, runs[0].form.decimal)):
        return None
    left_out += repeats
    width = _named_width(lines, body[start].number, delimiter, width, len(split[start]))
    top = header(path, lines, body[start].number, width, delimiter, decimal)
    left_out += _commented(lines, body[start].number, width, delimiter, decimal)
    numbers = [line.number for line in body[start:]]
    if given is None and (decimal == "," or delimiter in ";\t"):
        if runs and ambiguous_thousands(split[start:], decimal) is not None:
            return None
        _refuse_thousands(path, split[start:], numbers, decimal)
    parts: list[SplitRows | AlikeRows] = []
    fields = split[start:]
    at = 0
    for run in runs:
        upto = bisect(numbers, run.at)
        parts += [SplitRows(fields[at:upto], numbers[at:upto]), run]
        at = upto
    return TextTable(
        path=path,
        names=top.names,
        units=top.units,
        header_line=top.line,
        preamble=top.preamble,
        parts=(*parts, SplitRows(fields[at:], numbers[at:])),
        decimal=decimal,
        remarks=tuple(left_out),
        between=_between(lines, numbers),
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
    found = [(fewest, sign) for fewest in (2, 1) for sign in ".," if _has_rows(split, sign, fewest)]
    fewest, decimal = max(
        found,
        key=lambda one: (one[0], sum(_is_row(fields, one[1], one[0]) for fields in split)),
        default=(0, "."),
    )
    if not fewest:
        what, expected = "has no table with two columns of numbers", ""
        if any(field.startswith("=") for fields in split for field in fields):
            what, expected = f"{what}: its formulas have no values", CALCULATE
        raise RecordingError(Problem(f"{path} ({part})" if part else str(path), what, "", expected))
    start, width, repeats, _ = _rows(path, lines, body, split, "\t", decimal, fewest)
    width = _named_width(lines, body[start].number, "\t", width, MOST_COLUMNS)
    top = header(path, lines, body[start].number, width, "\t", decimal)
    return TextTable(
        path=path,
        names=top.names,
        units=top.units,
        part=part,
        header_line=top.line,
        preamble=top.preamble,
        parts=(SplitRows(split[start:], [line.number for line in body[start:]]),),
        decimal=decimal,
        remarks=tuple(repeats),
        between=_between(lines, [line.number for line in body[start:]]),
    )


def _between(lines: Sequence[Line], rows: Sequence[int]) -> tuple[tuple[int, str], ...]:
    """Return the lines, with their numbers, that are between the rows (by their numbers) and none of them."""
    known = set(rows)
    inside = (line for line in lines if rows and rows[0] < line.number < rows[-1])
    return tuple((line.number, line.uncommented) for line in inside if line.number not in known)


def _named_width(lines: Sequence[Line], first: int, delimiter: str, width: int, most: int) -> int:
    """Return the number of columns, with last ones that have a name, but no value in any row."""
    above = (trimmed(split_line(line.uncommented, delimiter)) for line in lines if line.number < first)
    return max((len(f) for f in above if width < len(f) <= most and named_columns(f) >= 2), default=width)


def _rows(
    path: Path,
    lines: Sequence[Line],
    body: list[Line],
    split: list[list[str]],
    delimiter: str,
    decimal: str,
    fewest: int,
) -> tuple[int, int, list[str], bool]:
    """Return the index of the first row, the number of columns, remarks, and whether columns were reordered.

    A line below that does not fit is refused.

    Headers that are repeated between the rows, as some rigs write them for each cycle, are removed from both lists.
    """
    start, raw, filled = _start(path, split, decimal, fewest)
    reordered = in_one_order(path, lines, body, split, start, delimiter, decimal)
    said = [*reordered, *_without_text_below(body, split, start, decimal)]
    rows = list(enumerate(split[start:], start=start))
    wrong = [i for i, fields in rows if len(fields) != raw and len(trimmed(fields)) != filled]
    # A header has as many fields as the rows have.
    full = [i for i, fields in rows if len(fields) == raw and fields[-1][:1].isalpha()]
    texts = [i for i in full if not numbers_in(split[i], decimal)]
    repeated = _repeated(body, split, start, sorted({*wrong, *texts}), filled)
    for i in wrong:
        if i not in repeated:
            fields = len(trimmed(split[i]))
            what = f"{fields} field{'s' if fields != 1 else ''}, where the rows before have {filled}"
            last = " (the last line: was the recording cut off?)" if body[i] is body[-1] else ""
            expected = f"{filled} numbers; delete the line or put # in front of it"
            raise RecordingError(Problem(f"{path}:{body[i].number}", what + last, "", expected))
    if repeated:
        head, tail = body[repeated[0]].number, body[repeated[-1]].number
        span = f"{len(repeated)} lines that repeat the header are left out (lines {head} to {tail})"
        said.insert(0, span if tail > head else f"line {head} repeats the header and is left out")
        for i in reversed(repeated):
            del body[i], split[i]
    width = max(len(trimmed(fields)) for fields in split[start:])
    if width > MOST_COLUMNS:
        what = f"has {width} columns"
        raise RecordingError(
            Problem(str(path), what, "", f"at most {MOST_COLUMNS}: leave out those not needed")
        )
    return start, width, said, bool(reordered)


def _without_text_below(body: list[Line], split: list[list[str]], start: int, decimal: str) -> list[str]:
    """Remove lines of text below the last row of numbers, such as "End of test" or "Max;12.5", and return a remark."""
    if start >= len(split) or not numbers_in(split[start][:1], decimal):
        return []
    end = len(split)
    while end > start and _begins_with_text(split[end - 1], decimal):
        end -= 1
    below = body[end:]
    if not below:
        return []
    del body[end:], split[end:]
    first = f'{below[0].number}: "{below[0].text.strip()[:SHOWN]}"'
    if len(below) == 1:
        return [f"the text below the table is left out (line {first})"]
    return [f"{len(below)} lines of text below the table are left out (the first is line {first})"]


def _commented(lines: Sequence[Line], first: int, width: int, delimiter: str, decimal: str) -> list[str]:
    """Return a remark about rows of numbers that a sign in front of them makes comments."""
    rows = []
    for line in lines:
        if line.comment and line.number > first:
            fields = split_line(line.uncommented.strip(), delimiter)
            if len(fields) == width and numbers_in(fields, decimal) == width:
                rows.append(line.number)
    if not rows:
        return []
    count = (
        f"{len(rows)} rows of numbers behind # or % are"
        if len(rows) > 1
        else "a row of numbers behind # or % is"
    )
    return [f"{count} left out as comments (line {rows[0]}{' and others' if len(rows) > 1 else ''})"]


def _begins_with_text(fields: Sequence[str], decimal: str) -> bool:
    """Whether the first field that is not empty is a word or a line of signs, and no mark of a missing number."""
    first = next((field for field in fields if field), "")
    word = first[:1].isalpha() or not any(character.isalnum() for character in first)
    return word and not numbers_in([first], decimal)


def _repeated(
    body: Sequence[Line], split: Sequence[list[str]], start: int, among: Sequence[int], width: int
) -> list[int]:
    """Return which lines below the first row repeat those above it: whole groups of them, names included.

    Lines with a field for each column, names and units, are repeated if they are the same. The others, such as
    "Cycle 2", may differ in their numbers.
    """
    texts = [line.text.strip() for line in body[:start]]
    head = {text for text, fields in zip(texts, split, strict=False) if len(trimmed(fields)) == width}
    labels = {_NUMBERS.sub("#", text) for text in texts if text not in head}
    found: list[int] = []
    for group in (list(run) for _, run in groupby(enumerate(among), lambda pair: pair[1] - pair[0])):
        lines = [i for _, i in group]
        again = [body[i].text.strip() for i in lines]
        full = [text for text, i in zip(again, lines, strict=True) if len(trimmed(split[i])) == width]
        known = all(text in head or _NUMBERS.sub("#", text) in labels for text in again)
        if full and known and all(text in head for text in full):
            found += lines
    return found


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


def _is_row(fields: list[str], decimal: str, fewest: int = 2) -> bool:
    """Whether a line looks like data: two numbers at least, and not more texts (a clock); or one number."""
    count = numbers_in(fields, decimal)
    if fewest == 1:
        return count == len(trimmed(fields)) == 1
    return count >= 2 and 2 * count >= len(fields) - fields.count("")


def _has_rows(split: Sequence[list[str]], decimal: str, fewest: int) -> bool:
    """Whether a sheet has a row of numbers; where single numbers count, all lines below the first must be such."""
    like = [_is_row(fields, decimal, fewest) for fields in split]
    return any(like) and (fewest > 1 or (sum(like) > 1 and all(like[like.index(True) :])))


def _of_one_column(
    body: Sequence[Line], delimiter: str | None, decimal: str | None
) -> tuple[str, str] | None:
    """Return delimiter and decimal sign of a file with one column of numbers; None for other files."""
    for sign in (decimal,) if decimal else (".", ","):
        split = [split_line(line.text, delimiter or (";" if ";" in line.text else "\t")) for line in body]
        like = [_is_row(fields, sign, 1) for fields in split]
        first = like.index(True) if any(like) else len(like)
        # Most lines, so that a line that does not fit is named.
        if sum(like) < 2 or 2 * sum(like) < len(like) - first:
            continue
        named = first > 0 and "," not in body[first - 1].text
        if named or delimiter or decimal or not any("," in line.text for line in body[first:]):
            return delimiter or (";" if any(";" in line.text for line in body) else "\t"), sign
    return None


def _dialect(
    path: Path, body: Sequence[Line], delimiter: str | None, decimal: str | None, single: bool
) -> tuple[str, str]:
    """Return the delimiter and decimal sign that make the most lines rows of numbers."""
    best, score = None, 0.0
    body = body[:: len(body) // _SAMPLE + 1]
    for sep in (delimiter,) if delimiter else (";", "\t", ",", "|", " "):
        split = [split_line(line.text, sep) for line in body]
        for sign in (decimal,) if decimal else (".", ","):
            rows = [fields for fields in split if _is_row(fields, sign)]
            common = Counter(len(fields) for fields in rows).most_common(1)
            # SplitRows without any text weigh more: "0,5 1,5" can also be split into three fields, two of them numbers.
            whole = sum(numbers_in(fields, sign) == len(trimmed(fields)) for fields in rows)
            points = (common[0][1] if common else 0) + 2.0 * whole
            if points > score:
                best, score = (sep, sign), points
    if best is None:
        what = "has no column of numbers" if single else "has no table with two columns of numbers"
        if delimiter or decimal:
            what += " for this delimiter and decimal sign"
        expected = "e.g. displacement_mm, or time_s,displacement_mm" if single else _EXAMPLE
        raise RecordingError(Problem(str(path), what, "", expected))
    return best


def _start(path: Path, split: Sequence[list[str]], decimal: str, fewest: int) -> tuple[int, int, int]:
    """Return the index of the first row, and the most frequent number of fields, with and without empty last ones."""
    like = [_is_row(fields, decimal, fewest) for fields in split]
    raw = Counter(len(f) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    filled = Counter(len(trimmed(f)) for f, row in zip(split, like, strict=True) if row).most_common(1)[0][0]
    fits = [row and raw == len(f) for f, row in zip(split, like, strict=True)]
    for i, fit in enumerate(fits):
        if fit and (i + 1 == len(fits) or fits[i + 1]):
            return i, raw, filled
    raise RecordingError(Problem(str(path), "has no two consecutive rows of numbers"))
