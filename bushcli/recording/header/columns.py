"""Find the columns of time, displacement and force, and their factors to internal units."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.header.above import refuse_factor
from bushcli.recording.header.column_units import unit_of
from bushcli.recording.header.match import (
    EITHER_TRUE,
    NamedColumn,
    WantedColumn,
    are_identical,
    candidates,
    columns_as,
    columns_by_unit,
)
from bushcli.recording.header.meaning import (
    meaning_of,
    ranges_of,
    refuse_compression,
    refuse_date,
    refuse_other_strain,
)
from bushcli.recording.header.name import heading, match_quality, named_columns
from bushcli.recording.header.units import tabulated_unit
from bushcli.recording.header.vocabulary import EXTREME_WORDS
from bushcli.recording.quantities import SPECIAL, STATIC
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.clock_times import Instant
from bushcli.recording.text.fields import with_hyphens
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]
#: A column, from 0, or None, and remarks about it.
_Index = tuple[int | None, tuple[str, ...]]

_COUPONS = "uniaxial, equibiaxial, planar or volumetric"
#: Other specimens, the quantity by which they are known, and their modes.
_OTHER_MODES = (
    ("translation", "length", "axial or radial"), ("rotation", "angle", "torsional or conical"),
    ("coupon", "stretch", _COUPONS), ("coupon", "strain", _COUPONS),
)  # fmt: skip
#: Parts of names that may be those of a time, in whatever other words.
_TIMES = re.compile(r"(?i)time|zeit|elapsed|seconds|врем|temps|tempo|tiempo|时间|時間|^\W*t(?![^\W_])")
# A table with such a column is one of dynamic stiffness.
_FREQUENCY = re.compile(r"(?i)freq|frek|频率|頻率|частот")


@dataclass(frozen=True)
class Column:
    """A column as read from the file.

    Attributes
    ----------
    index, values : int, (n,) array
        From 0; in internal units, stretch - 1 of the deformation of a coupon.
    unit, assumed : str, bool
        Unit in the file; whether it is the default one, because neither the file nor the case file gives one.
    remarks : tuple of str
        What a user should know about how the column was chosen.
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


def column(table: Table, source: Source, quantity: Quantity) -> Column | None:
    """Return the column of a quantity; None for a time that the file lacks."""
    wanted = WantedColumn.of(source, quantity)
    chosen = source.columns.get(quantity)
    timed = quantity == "time"
    index, remarks = (None, ()) if timed and source.is_untimed else _index_of(table, wanted, chosen)
    # Times of day need no unit; what "Time [hh:mm:ss]" has in brackets is their form.
    clock = table.clock(index, source.units.get("time", "")) if timed and index is not None else None
    if clock is not None and index is not None:
        return Column(index, clock.seconds, "s", remarks, begin=clock.begin)
    if index is None:
        return None
    header_column = NamedColumn(table, index, wanted)
    form, meant = meaning_of(header_column, source, chosen is not None)
    if form == "true" or chosen is not None:
        header_column = replace(header_column, wanted=replace(wanted, allowed=wanted.allowed | EITHER_TRUE))
    read = unit_of(header_column)
    if not wanted.given:
        refuse_factor(header_column, source)
    numbers = table.numbers(index, source.accept)
    remarks = (*remarks, *meant, *read.remarks, *ranges_of(header_column, numbers, read.assumed))
    values = numbers * read.unit.factor
    if wanted.mode.specimen == "coupon" and not timed:
        refuse_compression(header_column, source, values)
    if timed and read.assumed:
        refuse_date(header_column, values)
    if wanted.measured == "strain" and not wanted.given:
        refuse_other_strain(header_column, read.unit, values)
    if wanted.measured == "strain" and read.unit.name == "stretch":
        if (values <= 0).any():
            row = int(np.argmax(values <= 0))
            what = f"{header_column.label}: a stretch of {table.text(row, index)} is impossible"
            remedy = 'if it is a strain, give units = {displacement = "strain"} or "percent"'
            raise table.refusal(what, remedy, row)
        values = values - 1.0
    values = -values if quantity in (source.reverse or ()) else values
    return Column(index, values, read.unit.name, remarks, read.assumed, table.origin if timed else None, form)


def found_index(table: Table, source: Source, quantity: Quantity) -> int:
    """Return the column of a displacement or force, from 0; see `column`."""
    index, _ = _index_of(table, WantedColumn.of(source, quantity), source.columns.get(quantity))
    assert index is not None  # a quantity that is missing is refused
    return index


def _index_of(table: Table, wanted: WantedColumn, chosen: str | int | None) -> _Index:
    """Return the column of a quantity and remarks about it; None for a time that the file lacks."""
    best = candidates(table, wanted) if chosen is None else [chosen_index(table, chosen)]
    # The names are right, but their units belong to another quantity: a force in kg, a time in m.
    doubtful = [c for c in columns_as(table, wanted) if c.index not in best and wanted.quality(c.head) >= 3]
    remarks: tuple[str, ...] = ()
    if not best and wanted.given and len(doubtful) == 1:
        best = [doubtful[0].index]
    elif not best and not doubtful:
        best = columns_by_unit(table, wanted)
        remark = f"is read as the {wanted.quantity} because of its unit"
        remarks = tuple(f"{table.label(i)} {remark}" for i in best)
    if len(best) > 1 and are_identical(table, best, wanted):
        remarks = (f"{' and '.join(map(table.label, best))} are identical; one of them is used",)
    elif len(best) > 1:
        expected = f"name one, or give its number: columns = {{{wanted.quantity} = ...}} in the case file"
        if wanted.quantity == "time":
            expected = (
                f"if all rows were measured at one of them, {expected}; if each is that of another channel, put "
                "it in front of its channel, and the channels are read with their own times"
            )
        several = " and ".join(map(table.label, best[:8]))
        raise table.refusal(f"{several} could each be the {wanted.quantity}", expected)
    elif not best and wanted.quantity == "time":
        for column in doubtful[:1]:
            unit_of(column)
        clocks = [i for i in range(len(table.names)) if table.clock(i) is not None]
        best = clocks if len(clocks) == 1 else []
    elif not best:
        raise _missing_column_error(table, wanted, doubtful)
    return best[0] if best else None, remarks


def _missing_column_error(table: Table, wanted: WantedColumn, doubtful: list[NamedColumn]) -> RecordingError:
    """Return the error about a column that the table lacks; raise that about the unit of one with its name."""
    mode, measured = wanted.mode, wanted.measured
    heads = [heading(name) for name in table.names if name]
    extreme = [head for head in heads if set(head.words) & EXTREME_WORDS]
    here = "rotation" if mode.rotational else "translation"
    remedies = []
    if any(head.without(EXTREME_WORDS).quality(measured) for head in extreme):
        remedies = ["are its rows the extremes of cycles? The samples of whole cycles are needed"]
    elif mode.specimen == "coupon":
        true, raw = STATIC["stress" if measured == "stress" else "strain"].true, STATIC[measured].raw
        if any(head.without(true).quality(measured) and set(head.words) & true for head in heads):
            remedies = [f'if it is a true {measured}, give {measured} = "true"']
        elif raw and any(head.quality(raw) for head in heads):
            remedies = [f"the file has a {STATIC[raw].title}: give {STATIC[raw].size}"]
    else:
        remedies = [
            f"is this a recording of mode {modes}?"
            for specimen, kind, modes in _OTHER_MODES
            if specimen != here and any(match_quality(name, kind) >= 3 for name in table.names if name)
        ]
    if any(_FREQUENCY.search(name) for name in table.names):
        remedies.insert(0, 'of a table of dynamic stiffness give kind = "dynamic" in the case file')
    other = remedies[0] if remedies else ""
    if not other:
        for column in doubtful[:1]:
            unit_of(column)
    expected = f"or choose a column by name or number: columns = {{{wanted.quantity} = ...}} in the case file"
    listed = ", ".join(filter(None, table.names))
    usual_names = ((SPECIAL.get(kind) or STATIC[kind]).example for kind in wanted.kinds)
    what = f"no column {next(filter(None, usual_names))}, which mode {wanted.mode.name} needs"
    if listed:
        what += f"; there are {listed[:300]}"
    else:
        # A line above the table may have names, but not as many as the rows have fields.
        delimiters = ("\t", ";", ",")
        lines = ((n, sign, text.split(sign)) for n, text in reversed(table.preamble) for sign in delimiters)
        short = (line for line in lines if len(line[2]) > 1 and named_columns(line[2]) > 1)
        number, delimiter, fields = next(short, (0, "", []))
        header = f"line {number} has {len(fields)} names, and the rows have {len(table.names)} fields"
        what += f"; {header if fields else 'the table has no header'}"
        if delimiter == "," and len(fields) < len(table.names) <= 2 * len(fields):
            what += ": is the comma between them the decimal sign, too?"
            expected = "if it is, export the file with decimal points, or with semicolons between the fields"
    return table.refusal(what + (f"; {other}" if other else ""), expected)


def untaken_time(table: Table, taken: Collection[int]) -> list[str]:
    """Return a remark about each column that may be the time of a file of which none was taken as such."""
    remarks = []
    for i, name in enumerate(table.names):
        # A name may be nothing but a unit: "ms".
        head = heading(name)
        units = [tabulated_unit(text) for text in (name, *head.written, table.units[i])]
        is_time = _TIMES.search(name) is not None
        if i not in taken and (is_time or any(u is not None and u.measured == "time" for u in units)):
            key = f"columns = {{time = {i + 1}}} in the case file"
            remarks.append(f"{table.label(i)} was not taken as the time; if it is, {key}")
    return remarks


def chosen_index(table: Table, chosen: str | int) -> int:
    """Return the number, from 0, of a column that the case file chooses."""
    width = len(table.names)
    if isinstance(chosen, int):
        if chosen > width:
            raise table.refusal(f"has no column {chosen}", f"the table has {width} columns")
        return chosen - 1
    chosen = with_hyphens(chosen)
    plain, wanted = [heading(name).name for name in table.names], heading(chosen).name
    folded = [name.strip().casefold() for name in table.names]
    same = [i for i, name in enumerate(folded) if name and name == chosen.strip().casefold()]
    hits = same or [i for i, name in enumerate(plain) if name and name == wanted]
    if not hits:
        near = dict(zip(plain, table.names, strict=True)).get(nearest(wanted, plain), "")
        listed = ", ".join(filter(None, table.names))[:300] or f"no header; give a number from 1 to {width}"
        raise RecordingError(Problem(table.where, f'has no column "{chosen}"', near, listed))
    if any(not np.array_equal(table.numbers(hits[0]), table.numbers(i)) for i in hits[1:]):
        numbers = ", ".join(str(i + 1) for i in hits)
        raise table.refusal(f'has {len(hits)} columns named "{chosen}"', f"give a number: {numbers}")
    return hits[0]
