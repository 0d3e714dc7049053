"""Which column is time, displacement and force, and what factor leads to internal units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.header import Heading, heading, match_quality, says_measured, word_quality
from bushcli.recording.source import UNITS, Quantity, Source, dimension
from bushcli.recording.text import TextTable
from bushcli.recording.units import NO_UNIT, Unit, find_unit, plain_unit, slip, usual_unit
from cases.mode import Mode

Array = NDArray[np.float64]

_DEFAULT_UNIT = {
    "time": "s", "length": "mm", "angle": "deg", "force": "N", "moment": "Nmm",
    "strain": "stretch", "stress": "MPa",
}  # fmt: skip
_EXPECTED = {
    "length": "displacement_mm", "angle": "rotation_deg", "force": "force_N", "moment": "moment_Nmm",
    "strain": "stretch", "stress": "nominal_stress_MPa", "time": "time_s",
}  # fmt: skip
#: An unknown word up to this length beside the name of a quantity may be a unit: "force_klb".
_LONGEST_UNIT = 4


@dataclass(frozen=True)
class Column:
    """A column as it was read.

    Attributes
    ----------
    index : int
        From 0.
    values : (n,) array
        In internal units; stretch - 1 of the deformation of a coupon.
    unit : str
        In which it was read.
    """

    index: int
    values: Array
    unit: str


def column(table: TextTable, source: Source, mode: Mode, quantity: Quantity) -> Column | None:
    """Return the column of a quantity; a time that is not in the file is None.

    Parameters
    ----------
    table : TextTable
        The file's rows and headings.
    source : Source
        The file, and what the user says of its columns.
    mode : Mode
        Mode of the recording.
    quantity : Quantity
        Time, displacement or force.

    Raises
    ------
    RecordingError
        When the column is missing, ambiguous, of another kind than the mode needs, in a unit that is not known, or
        not all numbers.
    """
    measured = dimension(quantity, mode.specimen, mode.rotational)
    chosen = source.columns.get(quantity)
    given = source.units.get(quantity)
    index = _found(table, mode, quantity, measured, given) if chosen is None else _chosen(table, chosen)
    if index is None:
        return None
    read = find_unit(given, measured) if given else _unit(table, mode, quantity, index)
    if read is None or read.measured != measured:
        what = f'{table.label(index)}: "{given}" is not a unit of {_KIND[measured]}'
        raise _refused(table, quantity, index, what)
    values = table.numbers(index, source.accept) * read.factor
    if measured == "strain" and read.name == "stretch":
        if (values <= 0).any():
            row = int(np.argmax(values <= 0))
            what = f"{table.label(index)}: a stretch of {table.rows[row][index]} is impossible"
            expected = 'a strain? say so: units = {displacement = "strain"} or "percent"'
            raise RecordingError(Problem(f"{table.path}:{table.lines[row]}", what, "", expected))
        values = values - 1.0
    return Column(index, -values if quantity in source.reverse else values, read.name)


def _found(table: TextTable, mode: Mode, quantity: Quantity, measured: str, given: str | None) -> int | None:
    heads = [heading(name) for name in table.names]
    rank = [_rank(table, i, head, measured) for i, head in enumerate(heads)]
    if not any(table.names):
        # A row of units alone tells as much as it is unambiguous.
        units = [usual_unit(unit) for unit in table.units]
        rank = [int(unit is not None and unit.measured == measured) for unit in units]
    best = [i for i, q in enumerate(rank) if q == max(rank) > 0]
    if len(best) == 1:
        return best[0]
    # The names are right, but in units of something else: a force in kg, a time in m.
    alike = [i for i, head in enumerate(heads) if not rank[i] and _quality(head, measured) >= 3]
    if given and not best and len(alike) == 1:
        return alike[0]
    if quantity == "time" and not best:
        if alike:
            _unit(table, mode, quantity, alike[0])
        return None
    key = f"columns = {{{quantity} = ...}} in the case file"
    if best:
        several = " and ".join(table.label(i) for i in best)
        what = f"{several} could both be the {quantity}"
        raise RecordingError(Problem(str(table.path), what, "", f"name one, or give its number: {key}"))
    other = _other_modes(table, mode)
    if alike and not other:
        _unit(table, mode, quantity, alike[0])
    listed = ", ".join(name for name in table.names if name)
    what = f"no column {_EXPECTED[measured]}, which mode {mode.name} needs"
    what += f", among {listed[:300]}" if listed else "; the table has no header"
    expected = f"or choose a column by name or number: {key}"
    raise RecordingError(Problem(str(table.path), what + (f"; {other}" if other else ""), "", expected))


def _quality(head: Heading, measured: str) -> int:
    kinds = ("stretch", "strain") if measured == "strain" else (measured,)
    return max(word_quality(head, kind) for kind in kinds)


def _rank(table: TextTable, index: int, head: Heading, measured: str) -> int:
    """Return how surely a column is the quantity; one that says that it was measured beats others."""
    quality = _quality(head, measured)
    if not quality:
        return 0
    for text in _written(table, index, head):
        unit = find_unit(text, measured)
        if unit is not None and unit.measured != measured:
            return 0
    return quality + (5 if says_measured(head) else 0)


def _written(table: TextTable, index: int, head: Heading) -> tuple[str, ...]:
    """Return the units that name and row of units give for a column, as written."""
    row = table.units[index]
    return (*head.written, *([row] if plain_unit(row) else []))


def _other_modes(table: TextTable, mode: Mode) -> str:
    """Return for which modes the file has columns."""
    for specimen, kind, modes in (
        ("translation", "length", "axial or radial"),
        ("rotation", "angle", "torsional or conical"),
        ("coupon", "stretch", "uniaxial, equibiaxial, planar or volumetric"),
        ("coupon", "strain", "uniaxial, equibiaxial, planar or volumetric"),
    ):
        here = "coupon" if mode.specimen == "coupon" else "rotation" if mode.rotational else "translation"
        if specimen != here and any(match_quality(name, kind) >= 3 for name in table.names if name):
            return f"is this a recording of mode {modes}?"
    return ""


def _chosen(table: TextTable, chosen: str | int) -> int:
    width = len(table.names)
    if isinstance(chosen, int):
        if chosen > width:
            what = f"has no column {chosen}"
            raise RecordingError(Problem(str(table.path), what, "", f"the table has {width} columns"))
        return chosen - 1
    folded = [name.strip().casefold() for name in table.names]
    plain, wanted = [heading(name).name for name in table.names], heading(chosen).name
    for names, one in ((folded, chosen.strip().casefold()), (plain, wanted)):
        hits = [i for i, name in enumerate(names) if name and name == one]
        if len(hits) == 1:
            return hits[0]
        if len(hits) > 1:
            what = f'has {len(hits)} columns named "{chosen}"'
            numbers = ", ".join(str(i + 1) for i in hits)
            raise RecordingError(Problem(str(table.path), what, "", f"give a number: {numbers}"))
    named = [name for name in table.names if name]
    near = dict(zip(plain, table.names, strict=True)).get(nearest(wanted, plain), "")
    what = f'has no column "{chosen}"'
    listed = ", ".join(named)[:300] or f"no header; give a number from 1 to {width}"
    raise RecordingError(Problem(str(table.path), what, near, listed))


def _unit(table: TextTable, mode: Mode, quantity: Quantity, index: int) -> Unit:
    """Return the unit that the file gives for a column, or the default one where it gives none.

    Raises
    ------
    RecordingError
        A unit is written that is not known, is one of another quantity, or contradicts another one.
    """
    measured = dimension(quantity, mode.specimen, mode.rotational)
    head = heading(table.names[index])
    units = [
        _read(table, mode, quantity, index, text)
        for text in _written(table, index, head)
        if not (measured == "strain" and plain_unit(text) in NO_UNIT)
    ]
    if not units:
        units = [
            unit for word in head.doubtful if (unit := _doubtful(table, quantity, index, measured, word))
        ]
    if not units:
        is_strain = not word_quality(head, "stretch") and word_quality(head, "strain")
        name = "strain" if measured == "strain" and is_strain else _DEFAULT_UNIT[measured]
        return Unit(measured, name, UNITS[measured][name])
    if any(abs(unit.factor - units[0].factor) > 1e-9 * units[0].factor for unit in units):
        what = f"{table.label(index)} is in {' and in '.join(dict.fromkeys(unit.name for unit in units))}"
        raise _refused(table, quantity, index, what)
    return units[0]


def _read(table: TextTable, mode: Mode, quantity: Quantity, index: int, text: str) -> Unit:
    """Return the unit that a text names, or refuse it."""
    measured = dimension(quantity, mode.specimen, mode.rotational)
    unit = find_unit(text, measured)
    if unit is None:
        shown = "says that it has no unit" if plain_unit(text) in NO_UNIT else f'"{text}" is not a known unit'
        raise _refused(table, quantity, index, f"{table.label(index)}: {shown}", slip(text, measured))
    if unit.measured != measured:
        what = f"{table.label(index)} is in {unit.name}, but mode {mode.name} needs a {_KIND[measured]}"
        raise _refused(table, quantity, index, what)
    return unit


def _doubtful(table: TextTable, quantity: Quantity, index: int, measured: str, word: str) -> Unit | None:
    """Return the unit that an unknown word of a name is; refuse a short word that may be one."""
    minutes = word.lower() == "min"  # over a time: the unit, or the smallest value
    unit = None if minutes else find_unit(word, measured)
    if unit is not None and unit.measured == measured:
        return unit
    if minutes or len(word) <= _LONGEST_UNIT:
        raise _refused(table, quantity, index, f'{table.label(index)}: "{word}" may be a unit or not')
    return None


def _refused(table: TextTable, quantity: Quantity, index: int, what: str, near: str = "") -> RecordingError:
    where = f"{table.path}:{table.header_line}" if table.header_line else str(table.path)
    expected = f'give the unit in the table of the case file: units = {{{quantity} = "..."}}'
    return RecordingError(Problem(where, what, near, expected))


_KIND = {
    "time": "time", "length": "length", "angle": "rotation", "force": "force", "moment": "moment",
    "strain": "stretch or strain", "stress": "stress",
}  # fmt: skip
