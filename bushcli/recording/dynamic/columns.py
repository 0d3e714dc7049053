"""Columns of a dynamic table: what each of them is, and which belong together where each condition has its own."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.lines import decimal_of, refuse_ambiguous
from bushcli.recording.dynamic.names import (
    ACROSS,
    DIGITS,
    ColumnName,
    Stated,
    condition_of,
    meaning,
    read_number,
)
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.header.columns import chosen_index
from bushcli.recording.header.units import Unit, read_unit
from bushcli.recording.header.vocabulary import is_foreign
from bushcli.recording.quantities import CONDITIONS, DYNAMIC
from bushcli.recording.text.fields import is_number
from bushcli.recording.text.table import Table, TextTable
from cases.mode import Mode

Array = NDArray[np.float64]

#: Columns of which two give K' and K''.
MEASURED = ("stiffness", "modulus", "storage", "loss", "loss_angle", "tan_delta", "damping")
ERRORS = ("storage_error", "loss_error")
#: Units that are proposed for a column without one, by its quantity or by the kind of its unit.
_PROPOSED = {
    "frequency": ('"Hz"', '"rad/s"'), "temperature": ('"°C"', '"K"'), "loss_angle": ('"deg"', '"rad"'),
    "damping": ('"N s/mm"', '"N s/m"'), "tan_delta": ('"1"', '"percent"'), "strain": ('"percent"', '"1"'),
    "angle": ('"deg"', '"rad"'), "length": ('"mm"', '"um"'), "stress": ('"MPa"', '"Pa"'),
    "force": ('"N"', '"kN"'), "rotational stiffness": ('"Nm/deg"', '"Nm/rad"'), "stiffness": ('"N/mm"', '"kN/mm"'),
    "moment": ('"Nm"', '"Nmm"'),
}  # fmt: skip
#: Words that make a column of a static recording another quantity, and none of these.
_OWN_WORDS = frozenset([
    "amplitude", "frequency", "temperature", "temp", "mean", "stiffness", "modulus", "delta", "phase", "preload",
    "vorlast", "offset", "peak", "range", "spring", "rate",
])  # fmt: skip
#: Larger values cannot be radians, of which a right angle has 1.571, or a loss factor that is no percentage: that of
#: rubber in its glass transition is 2 to 3.
_LARGEST_RADIANS, _LARGEST_FACTOR = 1.6, 5.0

_NUMBER = re.compile(rf"[-+]?{DIGITS}")

#: Column, from 0, by quantity.
Columns = Mapping[str, tuple[int, ColumnName]]
#: Numbers in internal units, and a remark.
_Values = tuple[Array, str]


@dataclass(frozen=True)
class ColumnGroup:
    """Columns that belong together.

    Attributes
    ----------
    columns : Columns
    conditions : mapping of str to Stated
        Conditions of all its rows.
    """

    columns: Columns
    conditions: Mapping[str, Stated]


def meanings(table: Table, decimal: str = "") -> list[ColumnName]:
    """Return the meaning of each column; a condition in the row of units, or in a row above, is one of its columns.

    Parameters
    ----------
    table : Table
    decimal : str
        Decimal sign of numbers in names, if it is known; without it numbers that have two readings are nan.
    """
    columns, width = [], len(table.names)
    titles: dict[int, str] = {}
    above: dict[int, tuple[Stated, ...]] = {}
    # A row of lengths above the names may have been taken for one of units. What a line has for a column, a quantity,
    # ``Kdyn [N/mm]`` above ``0 N``, ``500 N``, or a condition, holds until the next one of the line.
    for text in (*(text for _, text in table.preamble), ";".join(table.units)):
        lines = [fields for fields in _fields(text) if 1 < len(fields) <= width]
        for fields in lines:
            if any(meaning(field).quantity in MEASURED for field in fields if field):
                titles |= {i: title for i, title in enumerate(_carry_fields(fields, width)) if title}
        conditions_of_row = next(
            (row for fields in lines if len(row := _conditions_in(fields, decimal)) > 1), {}
        )
        last: Stated | None = None
        for i in range(width):
            last = conditions_of_row.get(i, last)
            if last is not None:
                above[i] = (*above.get(i, ()), last)
    # Above conditions a name in merged cells holds until the next one.
    for i, name in enumerate(_carry_fields(table.names, width) if above else table.names):
        condition = condition_of(name, decimal)
        unit = "" if condition_of(table.units[i]) else table.units[i]
        column = meaning(titles.get(i, name) if condition else name, unit, decimal)
        of_name = () if condition is None or i not in titles else (condition,)
        columns.append(replace(column, conditions=(*column.conditions, *of_name, *above.get(i, ()))))
    return columns


def _fields(text: str) -> list[list[str]]:
    """Return the fields of a line above a table, by each delimiter that it may have."""
    return [[field.strip() for field in text.split(delimiter)] for delimiter in ";\t,|"]


def _carry_fields(fields: Sequence[str], width: int) -> list[str]:
    """Return the fields of a row, each of which holds until the next one."""
    carried: list[str] = []
    for i in range(width):
        carried.append((fields[i] if i < len(fields) else "") or (carried[-1] if carried else ""))
    return carried


def _conditions_in(fields: Sequence[str], decimal: str) -> dict[int, Stated]:
    """Return the conditions in a row, by column: ``0 N;500 N``, or ``Preload [N];0;500``, whose label has the unit."""
    label = meaning(fields[0]) if fields and fields[0] else ColumnName("")
    quantity = label.quantity if label.quantity in CONDITIONS else ""
    conditions: dict[int, Stated] = {}
    for i, field in enumerate(fields):
        condition = condition_of(field, decimal) if field else None
        if condition is not None:
            across = quantity and condition.quantity == ACROSS
            conditions[i] = replace(condition, quantity=quantity) if across else condition
        elif i and field and quantity and label.unit is not None:
            if not _NUMBER.fullmatch(field):
                return {}
            conditions[i] = Stated(quantity, read_number(field, decimal), label.unit, label.peak, field)
    return conditions


def with_names_above(table: Table) -> Table:
    """Return a table whose names are units, as ``Hz;Ns/mm``, with the line above them as its names."""
    unnamed = table.preamble and all(read_unit(name) for name in table.names if name)
    for fields in _fields(table.preamble[-1][1]) if unnamed else ():
        quantities = {meaning(field).quantity for field in fields}
        if len(fields) == len(table.names) and "frequency" in quantities and quantities & set(MEASURED):
            table = replace(table, names=tuple(fields), units=table.names, preamble=table.preamble[:-1])
            break
    return table


def with_conditions_above(table: Table) -> Table:
    """Return a table whose first row has conditions, ``Preload [N];0;500``, with that row above the names.

    A unit then holds until the next one, as in cells that were merged.
    """
    if not isinstance(table, TextTable) or len(table) < 2:
        return table
    width = len(table.names)
    fields = [table.text(0, i).strip() for i in range(width)]
    if is_number(fields[0], table.decimal) or len(_conditions_in(fields, table.decimal)) < 2:
        return table
    units, preamble = _carry_fields(table.units, width), (*table.preamble, (table.line(0), ";".join(fields)))
    return replace(table.of_rows(np.arange(1, len(table))), units=tuple(units), preamble=preamble)


def groups(table: Table, source: DynamicSource) -> list[ColumnGroup]:
    """Return the groups of columns of a table: one, or one for each condition that the columns' names have."""
    names = meanings(table, decimal_of(table, source))
    for i, name in enumerate(names):
        for condition in name.conditions:
            refuse_ambiguous(table, condition, table.label(i))
    chosen = {key: chosen_index(table, column) for key, column in source.columns.items()}
    for key, index in chosen.items():
        names[index] = replace(names[index], quantity=key)
    for i, name in enumerate(names):
        if name.quantity in chosen and chosen[name.quantity] != i:
            names[i] = replace(name, quantity="")
    for i, name in enumerate(names):
        # As bushcli exports a small vibration: a condition that no row has. One that the case file names has values.
        empty = (
            name.quantity in CONDITIONS
            and i not in chosen.values()
            and not any(table.text(row, i) for row in range(len(table)))
        )
        names[i] = replace(name, quantity="") if empty else name
    for i, name in enumerate(names):
        if name.quantity and any(condition.quantity == ACROSS for condition in name.conditions):
            if source.across is None:
                what = "the columns' names have a length or a strain; it may be the amplitude or the preload"
                raise table.refusal(what, 'across = "amplitude" or "preload" in the recording\'s table')
            conditions_of_name = (
                replace(condition, quantity=source.across) if condition.quantity == ACROSS else condition
                for condition in name.conditions
            )
            names[i] = replace(name, conditions=tuple(conditions_of_name))
    conditioned: dict[tuple[tuple[str, float], ...], list[int]] = {}
    for i, name in enumerate(names):
        if name.quantity:
            values = sorted((condition.quantity, condition.value) for condition in name.conditions)
            conditioned.setdefault(tuple(values), []).append(i)
    shared = conditioned.pop((), [])
    if not any(names[i].quantity in MEASURED for columns in conditioned.values() for i in columns):
        shared, conditioned = [i for i, name in enumerate(names) if name.quantity], {(): []}
    column_groups = []
    for columns in conditioned.values():
        quantities = {names[i].quantity for i in columns}
        members = [*columns, *(i for i in shared if names[i].quantity not in quantities)]
        conditions = {c.quantity: c for i in columns or shared for c in names[i].conditions}
        column_groups.append(ColumnGroup(_unique(table, members, names, source.deformation), conditions))
    return column_groups


def _unique(table: Table, columns: Sequence[int], names: Sequence[ColumnName], mode: Mode) -> Columns:
    """Return one column for each quantity: not a set value beside the measured one, not a unit of another specimen."""
    unique: dict[str, tuple[int, ColumnName]] = {}
    for quantity, count in Counter(names[i].quantity for i in columns).items():
        among = [i for i in columns if names[i].quantity == quantity]
        if count > 1:
            kinds = DYNAMIC[quantity].kinds_in(mode)
            suited = [i for i in among if (unit := names[i].unit) is None or unit.measured in kinds]
            words = {i: set(re.split(r"[\W_]+", table.names[i].lower())) - _OWN_WORDS for i in among}
            measured = [i for i in suited or among if not any(map(is_foreign, words[i]))]
            among = measured or suited or among
        rows = range(len(table))
        if len({tuple(table.text(row, i) for row in rows) for i in among}) > 1:
            several = " and ".join(table.label(i) for i in among[:8])
            what = f"{several} could each be the {quantity.replace('_', ' ')}"
            expected = f"name one, or give its number: columns = {{{quantity} = ...}} in the case file"
            raise table.refusal(what, expected)
        unique[quantity] = (among[0], names[among[0]])
    return unique


def key_of_unit(quantity: str) -> str:
    """Return the key of ``units`` in the case file for a measured quantity."""
    return "stiffness" if quantity == "modulus" else quantity


def unit_of(column: ColumnName, quantity: str, source: DynamicSource) -> Unit | None:
    """Return the unit of a column: that of the case file, or else of the file; None if neither has one."""
    given = source.units.get(key_of_unit(quantity))
    return column.unit if given is None else read_unit(given)


def numbers(table: Table, index: int, column: ColumnName, quantity: str, source: DynamicSource) -> _Values:
    """Return a column in internal units, and a remark where its unit was understood from its values."""
    values = table.numbers(index)
    remark, key = "", key_of_unit(quantity)
    given, unit = source.units.get(key), unit_of(column, quantity, source)
    kinds = DYNAMIC[quantity].kinds_in(source.deformation)
    proposed = next(_PROPOSED[kind] for kind in (quantity, *sorted(kinds, reverse=True)) if kind in _PROPOSED)
    remedy = f"units = {{{key} = {proposed[0]}}} or {proposed[1]} in the recording's table of the case file"
    if given is not None and unit is None:
        what = f"{table.label(index)}: {given!r} is not a unit of the {quantity.replace('_', ' ')}"
        raise table.refusal(what, remedy)
    if unit is None and quantity == "loss_angle" and np.abs(values).max() > _LARGEST_RADIANS:
        unit = read_unit("deg")
        remark = f"{table.label(index)} has no unit; it is in degrees, because a loss angle has at most 1.571 radians"
    if unit is None and quantity == "tan_delta" and np.abs(values).max() < _LARGEST_FACTOR:
        unit = read_unit("1")
    if unit is None:
        what = f"{table.label(index)} is the {quantity.replace('_', ' ')}, and neither it nor the case file has a unit"
        raise table.refusal(what, remedy)
    if unit.measured not in kinds:
        article = "an" if unit.measured[0] in "aeiou" else "a"
        where = f"{table.label(index)}: {column.written or given} is a unit of {article} {unit.measured}"
        what = f"{where}, and the {quantity.replace('_', ' ')} in mode {source.mode} is not one"
        expected = f"columns = {{{key} = ...}}, if another column is meant"
        if unit.measured == "stress":
            expected = 'a modulus is that of a coupon: [[coupons]] with mode = "uniaxial", for example'
        raise table.refusal(what, expected)
    return unit.factor * values + unit.zero, remark


def with_values(table: Table, group: ColumnGroup) -> Table:
    """Return the rows of a table in which a group of columns has values."""
    columns = [i for i, column in group.columns.values() if column.quantity in MEASURED or column.conditions]
    rows = [row for row in range(len(table)) if any(table.text(row, i) for i in columns)]
    return table if len(rows) == len(table) else table.of_rows(np.array(rows, dtype=np.int_))
