"""Header of a text file: names and units of the columns, and the lines above them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.name import factor_in, heading, is_units_row, match_quality, named_columns
from bushcli.recording.header.units import NO_UNIT, certain_unit, is_unit, plain_unit, tabulated_unit
from bushcli.recording.text.lines import Line, numbers_in, split_line, trimmed
from bushcli.recording.text.table import SHOWN

#: The number of a channel or test in a comment.
_NUMBERED = re.compile(
    r"\b(?:ch|channel|kanal|run|test|specimen|sample|sensor|probe)\s?\d{1,3}\b", re.IGNORECASE
)
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


def header(path: Path, lines: Sequence[Line], first: int, width: int, delimiter: str, decimal: str) -> Header:
    """Return the header of a table from the lines above its first row of numbers."""
    empty = ("",) * width
    units, place, passed = empty, 0, []
    above = [line for line in lines if line.number < first]
    full: list[tuple[Line, list[str]]] = []
    for line in reversed(above):
        fields = _fields(line.uncommented, delimiter, width)
        if fields and re.match(r"%[^\W\d_]", fields[0]) and not match_quality(fields[0][1:], "strain"):
            fields[0] = fields[0][1:]  # MATLAB's comment without a blank: "%time_s"
        texts = fields is not None and any(re.search(r"[^\W\d_]|[%‰°\"'′″]", f) for f in fields)
        if fields is None or not texts or numbers_in(fields, decimal) or _is_comment(line, fields):
            passed += [] if line.comment else [line]
        else:
            full.append((line, fields))
    rows = _units_rows(full)
    for i, (line, fields) in enumerate(full):
        further = full[i + 1 :]
        is_known = is_units_row(_without_label(fields))
        # Origin writes a row of comments below the row of units.
        if (is_known and _below_units(path, place, units)) or (
            units == empty and (is_known or _are_unknown_units(fields, further))
        ):
            units, place = tuple(_without_label(fields)), line.number
            continue
        if is_known and units != empty:
            units = _merged(path, rows, line.number, units)
            continue
        _no_data(path, [one for one in passed if one.number > line.number])
        _refuse_percent(path, line, fields[0], units[0])
        if units == empty:
            units, place = _units_above(fields, further) or (units, place)
        units = _merged(path, rows, place, units)
        _refuse_other_names(path, fields, units, further)
        preamble = tuple((one.number, one.uncommented) for one in above if one.number < line.number)
        # A name in cells that are merged over two rows stands in the upper one.
        upper = further[0][1] if further and further[0][0].number == line.number - 1 else fields
        fields = [name or merged for name, merged in zip(fields, upper, strict=True)]
        return Header(tuple(fields), units, place or line.number, preamble)
    units = _merged(path, rows, place, units)
    lost = [
        line for line in above if not line.comment and len(trimmed(split_line(line.text, delimiter))) == width
    ]
    _no_data(path, [line for line in lost if numbers_in(split_line(line.text, delimiter), decimal)])
    return Header(empty, units, place, tuple((one.number, one.uncommented) for one in above))


def _is_comment(line: Line, fields: Sequence[str]) -> bool:
    """Whether a line above a single column is a comment; above several columns the number of fields shows it."""
    return line.comment and len(fields) == 1 and not (named_columns(fields) or is_units_row(fields))


def _units_rows(full: Sequence[tuple[Line, list[str]]]) -> dict[int, list[str]]:
    """Return the rows of known units of a header, by the number of the line."""
    return {
        line.number: _without_label(fields) for line, fields in full if is_units_row(_without_label(fields))
    }


def _merged(
    path: Path, rows: Mapping[int, Sequence[str]], number: int, units: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the units of a header, those of its other rows of known units included."""
    if number not in rows or len(rows) < 2:
        return units
    merged = list(units)
    for column in range(len(units)):
        said: dict[tuple[str, float | str], tuple[str, int]] = {}
        for line, fields in sorted(rows.items()):
            bare = plain_unit(fields[column])
            if bare not in NO_UNIT:
                unit = tabulated_unit(bare)
                key = ("", bare) if unit is None else (unit.measured, unit.factor)
                said.setdefault(key, (bare, line))
        if len(said) > 1:
            (one, first), (other, second) = list(said.values())[:2]
            what = f"column {column + 1} is in {one} by line {first} and in {other} by line {second}"
            raise RecordingError(
                Problem(f"{path}:{second}", what, "", "one row of units: delete the other one")
            )
        if said and plain_unit(units[column]) in NO_UNIT:
            merged[column] = next(iter(said.values()))[0]
    return tuple(merged)


def _units_above(
    names: Sequence[str], above: Sequence[tuple[Line, list[str]]]
) -> tuple[tuple[str, ...], int] | None:
    """Return the row of units above the names, and its line; None if there is none."""
    own = [[tabulated_unit(text) for text in heading(name).written] for name in names]
    for line, row in above:
        bare = _without_label(row)
        # Where the names have units too, a row with other words is one of units if it repeats a unit or adds one.
        fits = not any(own) or any(
            certain_unit(field) and (not said or tabulated_unit(field) in said)
            for field, said in zip(bare, own, strict=True)
        )
        if is_units_row(row) or (fits and _are_units_above(row)):
            return tuple(bare), line.number
    return None


def _refuse_other_names(
    path: Path, names: Sequence[str], units: Sequence[str], above: Sequence[tuple[Line, list[str]]]
) -> None:
    """Refuse a second row of names, such as one in another language, whose units contradict those of the header."""
    for line, fields in above:
        if named_columns(fields) < len([field for field in fields if field]):
            continue
        for column, field in enumerate(fields):
            said = [
                [unit for text in texts if (unit := tabulated_unit(text)) is not None]
                for texts in (heading(field).written, (*heading(names[column]).written, units[column]))
            ]
            if all(said) and said[0][0].factor != said[1][0].factor:
                what = f"column {column + 1} is in {said[0][0].name} here and in {said[1][0].name} by the lines below"
                raise RecordingError(
                    Problem(f"{path}:{line.number}", what, "", "one row of names with units")
                )


def _are_units_above(fields: list[str]) -> bool:
    """Whether a line above the names is a row of units: it names no quantity, and one of its fields is a unit."""
    fields = [field for field in _without_label(fields) if field]
    # "Forces in kN", "Length unit: in", "Unit set: mm" and "Values in kN" are statements, not rows of units.
    if any(field.endswith((":", "=")) for field in fields) or any(
        re.fullmatch(r"(units?|einheit|unité|values?|werte|data|daten)\W*", field.lower()) for field in fields
    ):
        return False
    certain = sum(map(certain_unit, fields))
    # Beside two units, "t" is no time, but tonnes.
    words = [field for field in fields if certain < 2 or field not in ("t", "T")]
    singular = [field.removesuffix("s") if len(field) > _SHORT else field for field in words]
    return is_units_row(fields) or (
        not named_columns(words)
        and not named_columns(singular)
        and (certain > 0 or (len(fields) == 1 and is_unit(fields[0])))
        and all(len(field.split()) < 2 or certain_unit(field) or is_unit(field) for field in fields)
    )


def _without_label(fields: list[str]) -> list[str]:
    """Return a row of units with an empty text in place of a label such as "Units:" at its beginning."""
    if not re.fullmatch(r"(units?|einheit(en)?|unités?)\W*", fields[0].strip().lower()):
        return fields
    return ["", *(field.strip(" ,;") for field in fields[1:])]


def _refuse_percent(path: Path, line: Line, name: str, unit: str) -> None:
    """Refuse a header that begins with "% strain": the sign may begin a comment or be the unit of the first column."""
    if not line.text.lstrip().startswith("%") or unit or name.startswith("%") or heading(name).written:
        return
    if match_quality(name, "strain"):
        what = f'"% {name[:SHOWN]}": the % may begin a comment or be the unit of the strain'
        expected = f'"# {name[:SHOWN]}" or "{name[:SHOWN]} [%]"'
        raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))


def _are_unknown_units(fields: list[str], above: Sequence[tuple[Line, list[str]]]) -> bool:
    """Whether a line is a row of unknown units: it names no quantity, but a line above it does."""
    return not named_columns(fields) and any(named_columns(other) >= 2 for _, other in above)


def _below_units(path: Path, number: int, fields: Sequence[str]) -> bool:
    """Whether a line below a row of units is one of comments; False if it is itself a row of known units, or none."""
    words = [_NUMBERED.sub("", field) for field in fields if field]
    if not words or is_units_row(fields):
        return False
    if any(
        tabulated_unit(word) is not None or factor_in(word) or re.search(r"[\[\](){}%]|(?<![^\W_])\d", word)
        for word in words
    ):
        shown = " ".join(fields)[:SHOWN]
        what = f'"{shown}" stands below the row of units, and it is not clear whether it has factors or other units'
        raise RecordingError(Problem(f"{path}:{number}", what, "", "put # in front of a remark"))
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
        if len(fields) == width or len(fields := trimmed(fields)) == width:
            return fields
    return None


def _no_data(path: Path, lines: Sequence[Line]) -> None:
    """Refuse lines between the header and the first row: they would be dropped silently."""
    for line in lines:
        if re.search(r"\w|[%‰°\"'′″]", line.text):
            what = f'"{line.text.strip()[:SHOWN]}" is neither a header nor a row of numbers'
            expected = "names, units or numbers in all columns; put # in front of a remark"
            raise RecordingError(Problem(f"{path}:{line.number}", what, "", expected))
