"""Find the columns of time, displacement and force, and their factors to internal units."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.doubts import refuse_compression, refuse_date, refuse_other_strain
from bushcli.recording.factors import FACTOR
from bushcli.recording.header import Heading, heading, without, word_quality
from bushcli.recording.hints import KIND, headless, hint
from bushcli.recording.match import (
    WantedColumn,
    by_unit,
    candidates,
    identical,
    quality_of,
    written_units,
)
from bushcli.recording.source import UNITS, Quantity, Source
from bushcli.recording.stated import stated_system, stated_units, stated_unknown
from bushcli.recording.table import Table
from bushcli.recording.units import NO_UNIT, Unit, find_unit, plain_unit, slip, tabulated_unit
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
#: Longest unknown word beside the name of a quantity that may be a unit: "force_klb".
_LONGEST_UNIT = 4


@dataclass(frozen=True)
class Column:
    """A column as read from the file.

    Attributes
    ----------
    index : int
        From 0.
    values : (n,) array
        In internal units; stretch - 1 of the deformation of a coupon.
    unit : str
        Unit in the file.
    remarks : tuple of str
        What a user should know about how the column was found.
    assumed : bool
        Whether the unit is the default one, because neither the file nor the case file gives one.
    """

    index: int
    values: Array
    unit: str
    remarks: tuple[str, ...] = ()
    assumed: bool = False


def column(table: Table, source: Source, mode: Mode, quantity: Quantity) -> Column | None:
    """Return the column of a quantity; None for a time that the file lacks.

    Parameters
    ----------
    table : Table
        The file's rows and headings.
    source : Source
        The file, and what the user says about its columns.
    mode : Mode
        Mode of the recording.
    quantity : Quantity
        Time, displacement or force.

    Raises
    ------
    RecordingError
        When the column is missing, ambiguous, of another kind than the mode needs, in an unknown unit, or contains
        fields that are not numbers.
    """
    wanted = WantedColumn.of(source, mode, quantity)
    chosen = source.columns.get(quantity)
    index, remarks = _found(table, wanted) if chosen is None else (_chosen(table, chosen), ())
    if index is None:
        return None
    # Times of day need no unit; what "Time [hh:mm:ss]" has in brackets is their form.
    clock = table.clock(index, source.units.get("time", "")) if quantity == "time" else None
    if clock is not None:
        return Column(index, clock, "s", remarks)
    known = _given(table, wanted, index, wanted.given) if wanted.given else _unit(table, wanted, index)
    read, remarks = known.unit, (*remarks, *known.remarks)
    values = table.numbers(index, source.accept) * read.factor
    if mode.specimen == "coupon" and quantity != "time":
        refuse_compression(table, source, quantity, index, values)
    if quantity == "time" and known.assumed:
        refuse_date(table, index, values)
    if wanted.measured == "strain" and not wanted.given:
        refuse_other_strain(table, index, read, values)
    if wanted.measured == "strain" and read.name == "stretch":
        if (values <= 0).any():
            row = int(np.argmax(values <= 0))
            what = f"{table.label(index)}: a stretch of {table.text(row, index)} is impossible"
            expected = 'if it is a strain, give units = {displacement = "strain"} or "percent"'
            raise RecordingError(Problem(table.place(row), what, "", expected))
        values = values - 1.0
    values = -values if quantity in source.reverse else values
    return Column(index, values, read.name, remarks, known.assumed)


def _found(table: Table, wanted: WantedColumn) -> tuple[int | None, tuple[str, ...]]:
    """Return the column of a quantity and remarks about it; None for a time that the file lacks."""
    best = candidates(table, wanted)
    quantity, measured = wanted.quantity, wanted.measured
    # The names are right, but their units belong to another quantity: a force in kg, a time in m.
    heads = [heading(name) for name in table.names]
    alike = [i for i, head in enumerate(heads) if i not in best and quality_of(head, wanted) >= 3]
    if wanted.given and not best and len(alike) == 1:
        return alike[0], ()
    unnamed = [] if best or alike else by_unit(table, wanted)
    best = best or unnamed
    if len(best) == 1:
        taken = f"{table.label(best[0])} is read as the {quantity} because of its unit"
        return best[0], (taken,) if unnamed else ()
    if best and identical(table, best, wanted):
        labels = " and ".join(table.label(i) for i in best)
        return best[0], (f"{labels} are identical; one of them is used",)
    if quantity == "time" and not best:
        if alike:
            _unit(table, wanted, alike[0])
        clocks = [i for i in range(len(table.names)) if table.clock(i) is not None]
        return (clocks[0], ()) if len(clocks) == 1 else (None, ())
    key = f"columns = {{{quantity} = ...}} in the case file"
    if best:
        several = " and ".join(table.label(i) for i in best[:8])
        what = f"{several} could each be the {quantity}"
        raise RecordingError(Problem(table.where, what, "", f"name one, or give its number: {key}"))
    other = hint(table, wanted)
    if alike and not other:
        _unit(table, wanted, alike[0])
    listed = ", ".join(name for name in table.names if name)
    what = f"no column {_EXPECTED[measured]}, which mode {wanted.mode.name} needs"
    what += f"; there are {listed[:300]}" if listed else f"; {headless(table)}"
    expected = f"or choose a column by name or number: {key}"
    raise RecordingError(Problem(table.where, what + (f"; {other}" if other else ""), "", expected))


def untaken_time(table: Table, taken: Collection[int]) -> list[str]:
    """Return a remark about each column that may be the time of a file of which none was taken as such.

    Parameters
    ----------
    table : Table
    taken : collection of int
        Indices, from 0, of the columns that were read.
    """
    found = []
    for i, name in enumerate(table.names):
        units = [tabulated_unit(text) for text in written_units(table, i, heading(name))]
        named = re.search(r"time|zeit|elapsed|seconds", name.lower()) is not None
        if i not in taken and (named or any(unit is not None and unit.measured == "time" for unit in units)):
            found.append(
                f"{table.label(i)} was not taken as the time; if it is, columns = {{time = {i + 1}}} "
                "in the case file"
            )
    return found


def _chosen(table: Table, chosen: str | int) -> int:
    width = len(table.names)
    if isinstance(chosen, int):
        if chosen > width:
            what = f"has no column {chosen}"
            raise RecordingError(Problem(table.where, what, "", f"the table has {width} columns"))
        return chosen - 1
    folded = [name.strip().casefold() for name in table.names]
    plain, wanted = [heading(name).name for name in table.names], heading(chosen).name
    for names, one in ((folded, chosen.strip().casefold()), (plain, wanted)):
        hits = [i for i, name in enumerate(names) if name and name == one]
        if len(hits) == 1:
            return hits[0]
        if len(hits) > 1:
            if all(np.array_equal(table.numbers(hits[0]), table.numbers(i)) for i in hits[1:]):
                return hits[0]
            what = f'has {len(hits)} columns named "{chosen}"'
            numbers = ", ".join(str(i + 1) for i in hits)
            raise RecordingError(Problem(table.where, what, "", f"give a number: {numbers}"))
    named = [name for name in table.names if name]
    near = dict(zip(plain, table.names, strict=True)).get(nearest(wanted, plain), "")
    what = f'has no column "{chosen}"'
    listed = ", ".join(named)[:300] or f"no header; give a number from 1 to {width}"
    raise RecordingError(Problem(table.where, what, near, listed))


@dataclass(frozen=True)
class _Known:
    """The unit of a column, remarks about where it is given, and whether it is only assumed."""

    unit: Unit
    remarks: tuple[str, ...] = ()
    assumed: bool = False


def _given(table: Table, wanted: WantedColumn, index: int, text: str) -> _Known:
    """Return the unit that the case gives for a column."""
    unit = find_unit(text, wanted.measured)
    if unit is None or unit.measured != wanted.measured:
        what = f'{table.label(index)}: "{text}" is not a unit of {KIND[wanted.measured]}'
        raise _refused(table, wanted.quantity, index, what)
    return _Known(unit)


def _unit(table: Table, wanted: WantedColumn, index: int) -> _Known:
    """Return the unit that the file gives for a column, or the default one where it gives none.

    Raises
    ------
    RecordingError
        The unit is not known, belongs to another quantity, or contradicts another unit of the column.
    """
    measured, quantity = wanted.measured, wanted.quantity
    head = heading(table.names[index])
    units = [
        _read(table, wanted, index, text)
        for text in written_units(table, index, head)
        if not (measured == "strain" and (plain_unit(text) in NO_UNIT or _says_stretch(head, wanted, text)))
    ]
    if not units:
        units = [
            unit
            for word in head.doubtful
            if (unit := _doubtful(table, wanted, index, word, word == head.at_end))
        ]
    if not units and (above := _unit_above(table, wanted, index)):
        return above
    if not units:
        plain = without(head, wanted.allowed)
        is_strain = not word_quality(plain, "stretch") and word_quality(plain, "strain")
        name = "strain" if measured == "strain" and is_strain else _DEFAULT_UNIT[measured]
        # The name says whether it is a strain or a stretch.
        return _Known(Unit(measured, name, UNITS[measured][name]), assumed=measured != "strain")
    if any(abs(unit.factor - units[0].factor) > 1e-9 * units[0].factor for unit in units):
        what = f"{table.label(index)} is in {' and in '.join(dict.fromkeys(unit.name for unit in units))}"
        raise _refused(table, quantity, index, what)
    return _Known(units[0])


def _unit_above(table: Table, wanted: WantedColumn, index: int) -> _Known | None:
    """Return the unit that the lines above the table state for a column without one; None if they state none.

    Raises
    ------
    RecordingError
        They state several units, a system of units only, or something that is not understood.
    """
    stated = stated_units(table, wanted)
    several = " and ".join(dict.fromkeys(f"{unit.name} (line {line})" for line, unit in stated))
    if len({unit.factor for _, unit in stated}) > 1:
        what = f"{table.label(index)} has no unit, and the lines above the table state {several}"
        raise _refused(table, wanted.quantity, index, what)
    if stated:
        line, unit = stated[0]
        return _Known(unit, (f"{table.label(index)} is read in {unit.name}, which line {line} states",))
    system = stated_system(table) if wanted.measured not in ("time", "angle", "strain") else None
    if system:
        said = f"line {system[0]} states the system of units: {system[1]}"
        raise _refused(table, wanted.quantity, index, f"{table.label(index)} has no unit, and {said}")
    unknown = stated_unknown(table, wanted)
    if unknown:
        said = f'what line {unknown[0]} states is not a unit of {KIND[wanted.measured]}: "{unknown[1]}"'
        raise _refused(table, wanted.quantity, index, f"{table.label(index)} has no unit, and {said}")
    return None


def _says_stretch(head: Heading, wanted: WantedColumn, text: str) -> bool:
    """Whether a unit is a ratio of lengths and the name says that the column is a stretch: ``Stretch [mm/mm]``."""
    unit = tabulated_unit(text)
    plain = without(head, wanted.allowed)
    is_ratio = unit is not None and unit.name == "strain"
    return is_ratio and word_quality(plain, "stretch") > word_quality(plain, "strain")


def _read(table: Table, wanted: WantedColumn, index: int, text: str) -> Unit:
    """Return the unit that a text names, or refuse the text."""
    measured, quantity = wanted.measured, wanted.quantity
    unit = find_unit(text, measured)
    if unit is None:
        shown = f': "{text}" is not a known unit'
        number = re.match(r"\d+(?:[.,]\d+)?k?\s*(?=\D)", text)
        if plain_unit(text) in NO_UNIT:
            shown = " says that it has no unit"
        elif text.startswith(FACTOR):
            shown = f': the factor "{text.removeprefix(FACTOR).strip()}" is not applied'
        elif number and find_unit(text[number.end() :], measured) is not None:
            shown = f': "{text}" may be the range of the sensor, or a factor and the unit'
        raise _refused(table, quantity, index, f"{table.label(index)}{shown}", slip(text, measured))
    if unit.measured != measured:
        # As written: "Force [KG]" is in KG.
        bare = plain_unit(text)
        name = bare if bare.lower() == unit.name.lower() else unit.name
        what = f"{table.label(index)} is in {name}, but mode {wanted.mode.name} needs a {KIND[measured]}"
        raise _refused(table, quantity, index, what)
    return unit


def _doubtful(table: Table, wanted: WantedColumn, index: int, word: str, at_end: bool) -> Unit | None:
    """Return the unit that an unknown word of a name means, or refuse a word that may be a unit.

    That is a short word, one that is a unit of another quantity, or one that stands where units stand.
    """
    measured, quantity = wanted.measured, wanted.quantity
    if word == "in" and measured != "length":
        return None
    # The unit, or the smallest value; the unit, or the preposition.
    either = word.lower() == "min" or word == "in"
    unit = None if either else find_unit(word, measured)
    if unit is not None and unit.measured == measured:
        return unit
    if either or at_end or unit is not None or len(word) <= _LONGEST_UNIT or word[:1].isdigit():
        raise _refused(
            table, quantity, index, f'{table.label(index)}: it is not clear whether "{word}" is a unit'
        )
    return None


def _refused(table: Table, quantity: Quantity, index: int, what: str, near: str = "") -> RecordingError:
    where = f"{table.path}:{table.header_line}" if table.header_line else table.where
    expected = f'give the unit in the table of the case file: units = {{{quantity} = "..."}}'
    return RecordingError(Problem(where, what, near, expected))
