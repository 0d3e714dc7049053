"""Tables that follow each other in one file, as rigs write them for each cycle or block, in the order of the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header import is_units_row, named_columns
from bushcli.recording.lines import Line, numbers_in, split_line, trimmed

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

    Parameters
    ----------
    path : Path
        For messages.
    lines : sequence of Line
        All lines of the file.
    body, split : list
        Lines that are no comments, and their fields; changed in place.
    start : int
        Index in `body` of the first row.
    delimiter, decimal : str

    Raises
    ------
    RecordingError
        A header between the rows has other names or units than the first.
    """
    index = {line.number: i for i, line in enumerate(body)}
    rows = [i for i in range(start, len(body)) if numbers_in(split[i], decimal) >= 2]
    last = body[rows[-1]].number if rows else 0
    names: list[str] = []
    units: list[str] = []
    order: list[int] = []
    text: dict[bool, str] = {}
    said: list[str] = []
    for line in lines:
        i = index.get(line.number)
        fields = split_line(line.uncommented.strip(), delimiter) if i is None else split[i]
        cells = trimmed(fields)
        has_names, has_units = named_columns(cells) >= 2, bool(cells) and is_units_row(cells)
        if line.number < body[start].number:
            if has_names or has_units:
                names, units = (cells, units) if has_names else (names, cells)
                text[has_names] = line.text
        elif line.number < last and names and not numbers_in(cells, decimal) and (has_names or has_units):
            if line.comment and len(cells) != len(names):
                continue  # a remark
            if has_names:
                order = _order(path, line, cells, names)
                said += [
                    f"the columns from line {line.number} on are put into the order of the first header"
                ] * (order != sorted(order))
            elif len(cells) != len(order or names) or _ordered(cells, order) != units:
                what = f'"{" ".join(cells)}" below the first rows: other units than above them'
                raise RecordingError(Problem(f"{path}:{line.number}", what, "", _APART))
            if i is not None:
                split[i] = list(names if has_names else units)
                body[i] = replace(line, text=text[has_names])
        elif i is not None and order:
            split[i] = _ordered(fields, order)
    return said


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
