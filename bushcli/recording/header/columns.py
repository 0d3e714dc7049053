"""Find the columns of time, displacement and force, and their factors to internal units."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.header.column_units import given_unit, unit_of
from bushcli.recording.header.doubts import ranges_of, refuse_compression, refuse_date, refuse_other_strain
from bushcli.recording.header.header import heading
from bushcli.recording.header.hints import headless, hint
from bushcli.recording.header.match import (
    TRUE_STRAIN,
    TRUE_STRESS,
    WantedColumn,
    by_unit,
    candidates,
    identical,
    quality_of,
    written_units,
)
from bushcli.recording.header.meaning import meaning_of
from bushcli.recording.header.stated_factors import refuse_factor
from bushcli.recording.header.units import tabulated_unit
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.clock_times import Instant
from bushcli.recording.text.table import Table
from cases.mode import Mode

Array = NDArray[np.float64]

_EXPECTED = {
    "length": "displacement_mm", "angle": "rotation_deg", "force": "force_N", "moment": "moment_Nmm",
    "strain": "stretch", "stress": "nominal_stress_MPa", "time": "time_s",
}  # fmt: skip
_SHEARED = {"strain": "shear_strain", "stress": "shear_stress_MPa"}
#: Parts of names that may be those of a time, in whatever other words.
_TIMES = re.compile(
    r"time|zeit|elapsed|seconds|врем|temps|tempo|tiempo|时间|時間|^\W*t(?![^\W_])", re.IGNORECASE
)


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
    begin : Instant, optional
        Of times: the instant from which they count, if the file says it.
    form : str
        Of a coupon: "engineering", "true", "volume" or "pressure", see `bushcli.recording.source.Specimen`.
    """

    index: int
    values: Array
    unit: str
    remarks: tuple[str, ...] = ()
    assumed: bool = False
    begin: Instant | None = None
    form: str = "engineering"


def column(table: Table, source: Source, mode: Mode, quantity: Quantity) -> Column | None:
    """Return the column of a quantity; None for a time that the file lacks."""
    if quantity == "time" and source.is_untimed:
        return None
    wanted = WantedColumn.of(source, mode, quantity)
    chosen = source.columns.get(quantity)
    index, remarks = _found(table, wanted) if chosen is None else (chosen_index(table, chosen), ())
    if index is None:
        return None
    # Times of day need no unit; what "Time [hh:mm:ss]" has in brackets is their form.
    clock = table.clock(index, source.units.get("time", "")) if quantity == "time" else None
    if clock is not None:
        return Column(index, clock.seconds, "s", remarks, begin=clock.begin)
    meaning = meaning_of(table, wanted, index, source, chosen is not None)
    if meaning.form == "true" or chosen is not None:
        wanted = replace(wanted, allowed=wanted.allowed | TRUE_STRESS | TRUE_STRAIN)
    known = given_unit(table, wanted, index, wanted.given) if wanted.given else unit_of(table, wanted, index)
    if not wanted.given:
        refuse_factor(table, source, wanted, index)
    read, remarks = known.unit, (*remarks, *meaning.remarks, *known.remarks)
    numbers = table.numbers(index, source.accept)
    remarks += tuple(ranges_of(table, quantity, index, numbers, known.assumed))
    values = numbers * read.factor
    if mode.specimen == "coupon" and quantity != "time":
        refuse_compression(table, source, mode, quantity, index, values, meaning.form)
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
    values = -values if quantity in (source.reverse or ()) else values
    begin = table.origin if quantity == "time" else None
    return Column(index, values, read.name, remarks, known.assumed, begin, meaning.form)


def found_index(table: Table, source: Source, mode: Mode, quantity: Quantity) -> int | None:
    """Return the column of a quantity, from 0; None for a time that the file lacks; see `column`."""
    chosen = source.columns.get(quantity)
    if chosen is not None:
        return chosen_index(table, chosen)
    return _found(table, WantedColumn.of(source, mode, quantity))[0]


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
            unit_of(table, wanted, alike[0])
        clocks = [i for i in range(len(table.names)) if table.clock(i) is not None]
        return (clocks[0], ()) if len(clocks) == 1 else (None, ())
    key = f"columns = {{{quantity} = ...}} in the case file"
    if best:
        several = " and ".join(table.label(i) for i in best[:8])
        what = f"{several} could each be the {quantity}"
        expected = f"name one, or give its number: {key}"
        if quantity == "time":
            expected = (
                f"if all rows were measured at one of them, {expected}; if each is that of another channel, put "
                "it in front of its channel, and the channels are read with their own times"
            )
        raise RecordingError(Problem(table.where, what, "", expected))
    other = hint(table, wanted)
    if alike and not other:
        unit_of(table, wanted, alike[0])
    listed = ", ".join(name for name in table.names if name)
    expected_name = _EXPECTED[measured]
    if measured in _SHEARED and wanted.mode.sheared:
        expected_name = _SHEARED[measured]
    what = f"no column {expected_name}, which mode {wanted.mode.name} needs"
    what += f"; there are {listed[:300]}" if listed else f"; {headless(table)}"
    expected = f"or choose a column by name or number: {key}"
    raise RecordingError(Problem(table.where, what + (f"; {other}" if other else ""), "", expected))


def untaken_time(table: Table, taken: Collection[int]) -> list[str]:
    """Return a remark about each column that may be the time of a file of which none was taken as such."""
    found = []
    for i, name in enumerate(table.names):
        # A name may be nothing but a unit: "ms".
        units = [tabulated_unit(text) for text in (name, *written_units(table, i, heading(name)))]
        named = _TIMES.search(name) is not None
        if i not in taken and (named or any(unit is not None and unit.measured == "time" for unit in units)):
            found.append(
                f"{table.label(i)} was not taken as the time; if it is, columns = {{time = {i + 1}}} "
                "in the case file"
            )
    return found


def chosen_index(table: Table, chosen: str | int) -> int:
    """Return the number, from 0, of a column that the case file chooses."""
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
