"""Header of a text file: names and units of the columns, the lines above them, and headers that follow further down.

Rigs write a table for each cycle or block; those below the first are put into its order.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile

from bushcli.recording.header.name import heading, is_units_row, match_quality, named_columns
from bushcli.recording.header.name_parts import factor_in
from bushcli.recording.header.units import NO_UNIT, certain_unit, is_unit, plain_unit, tabulated_unit
from bushcli.recording.text.lines import Line, Sheet, numbers_in, split_line, trim_end
from bushcli.recording.text.table import SHOWN

_APART = "each table in a file of its own: a # in front of this line would mix their columns"
#: The number of a channel or test in a comment.
_NUMBERED = re.compile(r"(?i)\b(?:ch|channel|kanal|run|test|specimen|sample|sensor|probe)\s?\d{1,3}\b")
#: Lines above the rows, each with its fields.
_Rows = Sequence[tuple[Line, list[str]]]
#: Rows of units by the number of their line.
_Units = Mapping[int, Sequence[str]]
#: Characters up to which a word that ends with s is no plural.
_SHORT = 4


@dataclass(frozen=True)
class Header:
    """The header of a table.

    Attributes
    ----------
    names, units : tuple of str
        By column, as written; empty texts where there is none.
    line : int
        Number of the line of the units, or of the names if there is no row of units; 0 without a header.
    preamble : tuple of (int, str)
        Lines above it, with their numbers.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    line: int
    preamble: tuple[tuple[int, str], ...]


def header(sheet: Sheet, width: int) -> Header:
    """Return the header of a table from the lines above its first row of numbers."""
    empty = ("",) * width
    units, place, passed = empty, 0, []
    above, (delimiter, decimal) = sheet.above, sheet.dialect
    full: list[tuple[Line, list[str]]] = []
    for line in reversed(above):
        fields = _fields(line.content, delimiter, width)
        if fields and re.match(r"%[^\W\d_]", fields[0]) and not match_quality(fields[0][1:], "strain"):
            fields[0] = fields[0][1:]  # MATLAB's comment without a blank: "%time_s"
        texts = fields is not None and any(re.search(r"[^\W\d_]|[%‰°\"'′″]", f) for f in fields)
        # A comment above a single column; above several columns the number of fields shows it.
        alone = line.comment and fields is not None and len(fields) == 1
        comment = alone and not (named_columns(fields or ()) or is_units_row(fields or ()))
        if fields is None or not texts or numbers_in(fields, decimal) or comment:
            passed += [] if line.comment else [line]
        else:
            full.append((line, fields))
    bare = ((line.number, _without_label(fields)) for line, fields in full)
    rows = {number: fields for number, fields in bare if is_units_row(fields)}
    for i, (line, fields) in enumerate(full):
        further = full[i + 1 :]
        is_known = line.number in rows
        # A row of unknown units names no quantity, but a line above it does.
        below = not named_columns(fields) and any(named_columns(other) >= 2 for _, other in further)
        # Origin writes a row of comments below the row of units.
        if (is_known and _below_units(sheet, place, units)) or (units == empty and (is_known or below)):
            units, place = tuple(_without_label(fields)), line.number
            continue
        if is_known and units != empty:
            units = _merge_units(sheet, rows, line.number, units)
            continue
        _refuse_lost_lines(sheet, [row for row in passed if row.number > line.number])
        # The sign may begin a comment or be the unit of the first column.
        first = fields[0]
        is_unit = units[0] or first.startswith("%") or heading(first).written
        if line.text.lstrip().startswith("%") and not is_unit and match_quality(first, "strain"):
            what = f'"% {first[:SHOWN]}": the % may begin a comment or be the unit of the strain'
            raise sheet.refusal(line.number, what, f'"# {first[:SHOWN]}" or "{first[:SHOWN]} [%]"')
        if units == empty:
            units, place = _units_above(fields, further) or (units, place)
        units = _merge_units(sheet, rows, place, units)
        _refuse_other_names(sheet, fields, units, further)
        preamble = tuple((row.number, row.content) for row in above if row.number < line.number)
        # A name in cells that are merged over two rows stands in the upper one.
        upper = further[0][1] if further and further[0][0].number == line.number - 1 else fields
        fields = [name or merged for name, merged in zip(fields, upper, strict=True)]
        return Header(tuple(fields), units, place or line.number, preamble)
    units = _merge_units(sheet, rows, place, units)
    bodies = (row for row in above if not row.comment)
    lost = [row for row in bodies if len(trim_end(split_line(row.text, delimiter))) == width]
    _refuse_lost_lines(sheet, [row for row in lost if numbers_in(split_line(row.text, delimiter), decimal)])
    return Header(empty, units, place, tuple((row.number, row.content) for row in above))


def _merge_units(sheet: Sheet, rows: _Units, number: int, units: tuple[str, ...]) -> tuple[str, ...]:
    """Return the units of a header, those of its other rows of known units included."""
    merged = list(units)
    for column in range(len(units) if number in rows and len(rows) > 1 else 0):
        texts: dict[tuple[str, float | str], tuple[str, int]] = {}
        for line, fields in sorted(rows.items()):
            bare = plain_unit(fields[column])
            if bare not in NO_UNIT:
                unit = tabulated_unit(bare)
                key = ("", bare) if unit is None else (unit.measured, unit.factor)
                texts.setdefault(key, (bare, line))
        if len(texts) > 1:
            (upper, first), (lower, second) = list(texts.values())[:2]
            what = f"column {column + 1} is in {upper} by line {first} and in {lower} by line {second}"
            raise sheet.refusal(second, what, "one row of units: delete the other one")
        if texts and plain_unit(units[column]) in NO_UNIT:
            merged[column] = next(iter(texts.values()))[0]
    return tuple(merged)


def _units_above(names: Sequence[str], above: _Rows) -> tuple[tuple[str, ...], int] | None:
    """Return the row of units above the names, and its line; None if there is none."""
    units = [[tabulated_unit(text) for text in heading(name).written] for name in names]
    rows = []
    for line, row in above:
        bare = _without_label(row)
        # Where the names have units too, a row with other words is one of units if it repeats a unit or adds one.
        fits = not any(units) or any(
            certain_unit(field) and (not written or tabulated_unit(field) in written)
            for field, written in zip(bare, units, strict=True)
        )
        rows += [(tuple(bare), line.number)] if is_units_row(row) or (fits and _are_units_above(row)) else []
    return rows[0] if rows else None


def _refuse_other_names(sheet: Sheet, names: Sequence[str], units: Sequence[str], above: _Rows) -> None:
    """Refuse a second row of names, such as one in another language, whose units contradict those of the header."""
    for line, fields in above:
        if named_columns(fields) < len([field for field in fields if field]):
            continue
        for column, field in enumerate(fields):
            pair = [
                [unit for text in texts if (unit := tabulated_unit(text)) is not None]
                for texts in (heading(field).written, (*heading(names[column]).written, units[column]))
            ]
            if all(pair) and pair[0][0].factor != pair[1][0].factor:
                what = f"column {column + 1} is in {pair[0][0].name} here and in {pair[1][0].name} by the lines below"
                raise sheet.refusal(line.number, what, "one row of names with units")


def _are_units_above(fields: list[str]) -> bool:
    """Whether a line above the names is a row of units: it names no quantity, and one of its fields is a unit."""
    fields = [field for field in _without_label(fields) if field]
    # "Forces in kN", "Length unit: in", "Unit set: mm" and "Values in kN" are statements, not rows of units.
    labels = re.compile(r".*[:=]|(units?|einheit|unité|values?|werte|data|daten)\W*", re.DOTALL)
    certain = sum(map(certain_unit, fields))
    # Beside two units, "t" is no time, but tonnes.
    words = [field for field in fields if certain < 2 or field not in ("t", "T")]
    singular = [field.removesuffix("s") if len(field) > _SHORT else field for field in words]
    units = is_units_row(fields) or (
        not named_columns(words)
        and not named_columns(singular)
        and (certain > 0 or (len(fields) == 1 and is_unit(fields[0])))
        and all(len(field.split()) < 2 or certain_unit(field) or is_unit(field) for field in fields)
    )
    return units and not any(labels.fullmatch(field.lower()) for field in fields)


def _without_label(fields: list[str]) -> list[str]:
    """Return a row of units with an empty text in place of a label such as "Units:" at its beginning."""
    labelled = re.fullmatch(r"(units?|einheit(en)?|unités?)\W*", fields[0].strip().lower())
    return ["", *(field.strip(" ,;") for field in fields[1:])] if labelled else fields


def _below_units(sheet: Sheet, number: int, fields: Sequence[str]) -> bool:
    """Whether a line below a row of units is one of comments; False if it is itself a row of known units, or none."""
    words = [_NUMBERED.sub("", field) for field in fields if field]
    if not words or is_units_row(fields):
        return False
    marks = re.compile(r"[\[\](){}%]|(?<![^\W_])\d")
    if any(tabulated_unit(word) or factor_in(word) or marks.search(word) for word in words):
        shown = " ".join(fields)[:SHOWN]
        what = f'"{shown}" stands below the row of units, and it is not clear whether it has factors or other units'
        raise sheet.refusal(number, what, "put # in front of a remark")
    return True


def _fields(text: str, delimiter: str, width: int) -> list[str] | None:
    """Return the fields of a header line if it has one field for each column."""
    attempts = [split_line(text, delimiter)]
    if delimiter in " \t":
        # A header may be aligned with blanks above columns separated by tabs; in "Weg [mm]  Kraft [N]" names may
        # contain single spaces, and a unit belongs to the name before it.
        attempts.append(re.split(r"\s{2,}|\t", text.strip()))
        attempts.append(text.split())
        attempts.append(re.sub(r"\s+([\[(][^\])]*[\])])", r"\1", text).split())
    for fields in attempts:
        if len(fields) == width or len(fields := trim_end(fields)) == width:
            return fields
    return None


def _refuse_lost_lines(sheet: Sheet, lines: Sequence[Line]) -> None:
    """Refuse lines between the header and the first row: they would be dropped silently."""
    for line in lines:
        if re.search(r"\w|[%‰°\"'′″]", line.text):
            what = f'"{line.text.strip()[:SHOWN]}" is neither a header nor a row of numbers'
            expected = "names, units or numbers in all columns; put # in front of a remark"
            raise sheet.refusal(line.number, what, expected)


def unify_column_order(sheet: Sheet) -> list[str]:
    """Put the columns of all tables of a file into the order of the first, and return remarks about it.

    The headers of the further tables become equal to the first one. A comment can be such a header too: a user may
    have put the # in front of it.
    """
    body, split, first, (delimiter, decimal) = sheet.body, sheet.split, sheet.first_row_line, sheet.dialect
    names, units, text = _first_header(takewhile(lambda line: line.number < first, sheet.lines), delimiter)
    if not names:
        return []
    start = sheet.start
    # What has a number is a row: the words of a header are looked at in the few other lines only.
    last = next((i for i in range(len(body) - 1, start, -1) if numbers_in(split[i], decimal) >= 2), start)
    index = {body[i].number: i for i in range(start, last) if not numbers_in(split[i], decimal)}
    between = (line for line in sheet.lines if first < line.number < body[last].number)
    order: list[int] = []
    remarks: list[str] = []
    changed: list[tuple[int, list[int]]] = []
    headers: set[int] = set()
    below_names = False
    for line in (line for line in between if line.comment or line.number in index):
        i = index.get(line.number)
        cells = trim_end(split_line(line.content.strip(), delimiter) if i is None else split[i])
        # A comment with a number, or with another number of fields, is a row or a remark.
        fits = i is not None or (len(cells) == len(names) and not numbers_in(cells, decimal))
        has_names = fits and named_columns(cells) >= 2
        is_header = has_names or (fits and _is_units(cells, below_names))
        below_names = has_names
        if not is_header:
            continue
        if has_names:
            if cells != names and (sorted(cells) != sorted(names) or len(set(names)) < len(names)):
                what = f"a further header below the first rows has other names: {', '.join(cells)[:200]}"
                raise sheet.refusal(line.number, what, _APART)
            same = cells == names
            order = list(range(len(names))) if same else [cells.index(name) for name in names]
            changed.append((line.number, order))
            if order != sorted(order):
                these = f"the columns from line {line.number} on"
                remarks.append(f"{these} are put into the order of the first header")
        elif len(cells) != len(order or names) or _put_in_order(cells, order) != units:
            what = f'"{" ".join(cells)}" below the first rows: other units than above them'
            raise sheet.refusal(line.number, what, _APART)
        if i is not None:
            split[i] = list(names if has_names else units)
            body[i] = replace(line, text=text[has_names])
            headers.add(i)
    for (begin, order), (end, _) in pairwise([*changed, (body[-1].number + 1, [])]):
        for i in range(start, len(body)) if order != sorted(order) else ():
            if begin < body[i].number < end and i not in headers:
                split[i] = _put_in_order(split[i], order)
    return remarks


def _first_header(lines: Iterable[Line], delimiter: str) -> tuple[list[str], list[str], dict[bool, str]]:
    """Return the names and the units in the lines above the first row, and the texts of both lines."""
    names: list[str] = []
    units: list[str] = []
    text: dict[bool, str] = {}
    below_names = False
    for line in lines:
        cells = trim_end(split_line(line.content.strip(), delimiter))
        has_names = named_columns(cells) >= 2
        if has_names or _is_units(cells, below_names):
            names, units = (cells, units) if has_names else (names, cells)
            text[has_names] = line.text
        below_names = has_names
    return names, units, text


def _is_units(cells: list[str], below_names: bool) -> bool:
    """Whether a line holds units; below names, where columns may have units of any quantity, one known is enough."""
    return bool(cells) and (is_units_row(cells) or (below_names and any(map(certain_unit, cells))))


def _put_in_order(fields: list[str], order: list[int]) -> list[str]:
    """Return the fields in an order, those behind its columns unchanged; as they are if there are too few."""
    return [fields[k] for k in order] + fields[len(order) :] if len(fields) >= len(order) else fields
