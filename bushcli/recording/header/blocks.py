"""Tables that follow each other in one file, as rigs write them for each cycle or block, in the order of the first."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.name import is_units_row, named_columns
from bushcli.recording.header.units import certain_unit
from bushcli.recording.text.lines import Line, numbers_in, split_line, trimmed

_APART = "each table in a file of its own: a # in front of this line would mix their columns"


def in_one_order(
    path: Path,
    lines: Sequence[Line],
    body: list[Line],
    split: list[list[str]],
    start: int,
    delimiter: str,
    decimal: str,
) -> list[str]:
    """Put the columns of all tables of a file into the order of the first, and return remarks about it.

    The headers of the further tables become equal to the first one. A comment can be such a header too: a user may
    have put the # in front of it.
    """
    first = body[start].number
    names, units, text = _above(takewhile(lambda line: line.number < first, lines), delimiter)
    if not names:
        return []
    # What has a number is a row: the words of a header are looked at in the few other lines only.
    last = next((i for i in range(len(body) - 1, start, -1) if numbers_in(split[i], decimal) >= 2), start)
    index = {body[i].number: i for i in range(start, last) if not numbers_in(split[i], decimal)}
    between = (line for line in lines if first < line.number < body[last].number)
    order: list[int] = []
    said: list[str] = []
    changed: list[tuple[int, list[int]]] = []
    headers: set[int] = set()
    named = False
    for line in (line for line in between if line.comment or line.number in index):
        i = index.get(line.number)
        cells = trimmed(split_line(line.uncommented.strip(), delimiter) if i is None else split[i])
        # A comment with a number, or with another number of fields, is a row or a remark.
        fits = i is not None or (len(cells) == len(names) and not numbers_in(cells, decimal))
        has_names = fits and named_columns(cells) >= 2
        is_header = has_names or (fits and _is_units(cells, named))
        named = has_names
        if not is_header:
            continue
        if has_names:
            order = _order(path, line, cells, names)
            changed.append((line.number, order))
            if order != sorted(order):
                said.append(
                    f"the columns from line {line.number} on are put into the order of the first header"
                )
        elif len(cells) != len(order or names) or _ordered(cells, order) != units:
            what = f'"{" ".join(cells)}" below the first rows: other units than above them'
            raise RecordingError(Problem(f"{path}:{line.number}", what, "", _APART))
        if i is not None:
            split[i] = list(names if has_names else units)
            body[i] = replace(line, text=text[has_names])
            headers.add(i)
    for (begin, order), (end, _) in pairwise([*changed, (body[-1].number + 1, [])]):
        for i in range(start, len(body)) if order != sorted(order) else ():
            if begin < body[i].number < end and i not in headers:
                split[i] = _ordered(split[i], order)
    return said


def _above(lines: Iterable[Line], delimiter: str) -> tuple[list[str], list[str], dict[bool, str]]:
    """Return the names and the units in the lines above the first row, and the texts of both lines."""
    names: list[str] = []
    units: list[str] = []
    text: dict[bool, str] = {}
    named = False
    for line in lines:
        cells = trimmed(split_line(line.uncommented.strip(), delimiter))
        has_names = named_columns(cells) >= 2
        if has_names or _is_units(cells, named):
            names, units = (cells, units) if has_names else (names, cells)
            text[has_names] = line.text
        named = has_names
    return names, units, text


def _is_units(cells: list[str], named: bool) -> bool:
    """Whether a line holds units; below names, where columns may have units of any quantity, one known is enough."""
    return bool(cells) and (is_units_row(cells) or (named and any(map(certain_unit, cells))))


def _order(path: Path, line: Line, cells: list[str], names: list[str]) -> list[int]:
    """Return the index that each of the first names has in a further header."""
    if cells == names:
        return list(range(len(names)))
    if sorted(cells) != sorted(names) or len(set(names)) < len(names):
        what = f"a further header below the first rows has other names: {', '.join(cells)[:200]}"
        raise RecordingError(Problem(f"{path}:{line.number}", what, "", _APART))
    return [cells.index(name) for name in names]


def _ordered(fields: list[str], order: list[int]) -> list[str]:
    """Return the fields in an order, those behind its columns unchanged; as they are if there are too few."""
    return [fields[k] for k in order] + fields[len(order) :] if len(fields) >= len(order) else fields
