"""Channels with clocks of their own -> one table at the time stamps of the force.

A logger may write the force every millisecond and the travel every ten milliseconds: two groups of a file, or two
columns of time in one table, each in front of its channel. Here, for all formats, their clocks are compared:

- Equal stamps are one clock, whether they are written as stamps or follow from an interval.
- Where different stamps count from the same instant (a date, the start that a waveform states, the beginning of an MDF
  file, or because they are in one table), the travel is interpolated at the stamps of the force, and a remark says so.
- Otherwise the file is refused: rows that were not measured at the same time are never put side by side.

The force is never interpolated, because its noise is estimated from the differences of its samples.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import RecordingError, count_of
from bushcli.recording.header.columns import Column, chosen_index, column
from bushcli.recording.header.match import WantedColumn, candidates, columns_as, columns_by_unit, has_columns
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.clock_times import ClockTimes
from bushcli.recording.text.table import ArrayTable, Table
from bushcli.recording.time.samples import even_stamps

Array = NDArray[np.float64]

#: A pause of the travel's stamps is a gap, whose travel is unknown, if it is longer than this many median intervals and
#: the travel changes by more than this share of its range. A logger that writes changes only pauses at rest.
_PAUSE, _MOVED = 10.0, 0.01
#: Stamps are equal if they differ by at most this share of their median interval. It admits rounding (a stamp of 1000 s
#: in single precision is known to 0.06 ms); at 20 samples per cycle it shifts the phase by 0.003 rad.
_EQUAL = 0.01
#: Stamps beyond this many seconds (1979) count from 1970 where nothing else is said: no recording lasts nine years.
_EPOCH = 3e8
#: SplitRows by which a column of dates is recognised.
_HEAD = 20
#: Largest number of groups whose stamps are compared.
_MOST_COMPARED = 200
#: What is interpolated, and at the stamps of what.
Words = tuple[str, str]
WORDS: Words = ("the displacement", "the force")
_RASTER = "export the channels with one common raster"


@dataclass(frozen=True)
class RasterColumns:
    """Columns of a table that can be a quantity, with their clock.

    Attributes
    ----------
    table : Table
    columns : tuple of int
        From 0.
    stamps : Column
        Their times, s; its index is -1 where the table has none.
    """

    table: Table
    columns: tuple[int, ...]
    stamps: Column

    @property
    def time(self) -> Array:
        """Stamps (n,), s."""
        return self.stamps.values

    @property
    def name(self) -> str:
        """Where the columns are, for messages: a group, or a column of one table."""
        if self.table.part:
            return f'group "{self.table.part}"'
        return ", ".join(self.table.label(index) for index in self.columns[:3])

    @property
    def raster(self) -> str:
        """`name` with the interval of the stamps."""
        return f"{self.name} every {float(np.median(np.diff(self.time))):.3g} s"

    @property
    def span(self) -> str:
        """`name` with the first and the last stamp."""
        return f"{self.name} ({self.time[0]:.6g} to {self.time[-1]:.6g} s)"


Rasters = Sequence[RasterColumns]


@dataclass(frozen=True, kw_only=True)
class JoinedTable(Table):
    """Columns of several tables whose rows were measured at the same times.

    Attributes
    ----------
    places : tuple of (Table, int)
        Table and index, from 0, of each column.
    """

    places: tuple[tuple[Table, int], ...]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.places[0][0])

    def line(self, row: int) -> int:
        """Return the number of a row (from 0) in the first of the tables."""
        return self.places[0][0].line(row)

    def text(self, row: int, column: int) -> str:
        """Return a field as written; see `Table.text`."""
        table, index = self.places[column]
        return table.text(row, index)

    def numbers(self, column: int, accepted: Collection[float] = ()) -> Array:
        """Return a column as numbers; see `Table.numbers`."""
        table, index = self.places[column]
        return table.numbers(index, accepted)

    def of_rows(self, rows: NDArray[np.int_]) -> JoinedTable:
        """Return the table of some rows; see `Table.of_rows`."""
        return replace(self, places=tuple((table.of_rows(rows), index) for table, index in self.places))

    def clock(self, column: int, form: str = "") -> ClockTimes | None:
        """Return a column of dates or times of day; see `Table.clock`."""
        table, index = self.places[column]
        return table.clock(index, form)


def join_by_clock(tables: Sequence[Table], source: Source) -> list[Table]:
    """Return tables, those with equal time stamps as one: some loggers write a group for each channel."""
    groups: list[list[RasterColumns]] = []
    separate = list(tables[_MOST_COMPARED:])
    for table in tables[:_MOST_COMPARED]:
        try:
            raster = columns_with_stamps(table, (), source)
        except RecordingError:
            raster = None  # it is said where the table is needed
        if raster is None:
            separate.append(table)
            continue
        same = next((group for group in groups if _same_clock(group[0], raster, False)), None)
        if same is None:
            groups.append([raster])
        else:
            same.append(raster)
    tables_by_clock: list[Table] = []
    for group in groups:
        first = group[0].table
        if len(group) == 1:
            tables_by_clock.append(first)
            continue
        places = [
            (raster.table, index)
            for i, raster in enumerate(group)
            for index in range(len(raster.table.names))
            if i == 0 or index != raster.stamps.index
        ]
        together = JoinedTable(
            path=first.path,
            names=tuple(table.names[index] for table, index in places),
            units=tuple(table.units[index] for table, index in places),
            part=" + ".join(raster.table.part for raster in group)[:200],
            preamble=first.preamble,
            origin=first.origin,
            remarks=tuple(dict.fromkeys(text for raster in group for text in raster.table.remarks)),
            places=tuple(places),
        )
        tables_by_clock.append(together)
    return tables_by_clock + separate


def columns_with_stamps(table: Table, columns: Sequence[int], source: Source) -> RasterColumns | None:
    """Return columns with the time stamps of their table; None if it has none."""
    chosen = source.columns.get("time")
    if isinstance(chosen, int) or (chosen is not None and not has_columns(table, source, ["time"])):
        source = replace(source, columns={key: name for key, name in source.columns.items() if key != "time"})
    stamps = column(table, source, "time")
    return None if stamps is None else RasterColumns(table, tuple(columns), stamps)


def _shift(raster: RasterColumns, other: RasterColumns, together: bool) -> float | None:
    """Return the offset, s, that brings another clock's stamps to the same origin; None if it is not known."""
    a, b = raster.stamps.begin, other.stamps.begin
    if a is not None and b is not None:
        return (b.nanoseconds - a.nanoseconds) / 1e9 if a.reference == b.reference else None
    if a is None and b is None and (together or min(raster.time[0], other.time[0]) > _EPOCH):
        return 0.0
    return None


def _same_clock(raster: RasterColumns, other: RasterColumns, together: bool) -> bool:
    """Whether the stamps are equal; see `_shift`. Where no instants can be compared, they count from the first."""
    if len(raster.time) != len(other.time):
        return False
    shift = _shift(raster, other, together)
    if shift is None and raster.stamps.begin is not None and other.stamps.begin is not None:
        return False
    interval = float(np.median(np.abs(np.diff(raster.time)))) if len(raster.time) > 1 else 0.0
    return bool(np.abs(raster.time - (other.time + (shift or 0.0))).max(initial=0.0) <= _EQUAL * interval)


def on_one_raster(tables: Iterable[Table], source: Source) -> Table | None:
    """Return the columns of the force with the travel interpolated at their time stamps; None if that is impossible."""
    tables = list(tables)
    forced = _group_with(tables, source, "force")
    moved = _group_with(tables, source, "displacement")
    return None if forced is None or moved is None else interpolate_at_stamps(forced, [moved], source)


def _group_with(tables: Sequence[Table], source: Source, quantity: Quantity) -> RasterColumns | None:
    """Return the only group that has a quantity; None if no group has it."""
    if isinstance(source.columns.get(quantity), int):
        return None  # a column's number is ambiguous if the columns are in several groups
    wanted = WantedColumn.of(source, quantity)
    having = [table for table in tables if has_columns(table, source, [quantity])]
    # A group whose channel names the quantity precedes those that have the unit only.
    having = [table for table in having if candidates(table, wanted)] or having
    if not having:
        return None
    if len(having) > 1:
        listed = ", ".join(f'"{table.part}"' for table in having[:8])
        what = f"the channels have different time stamps, and the {quantity} could be in {listed}"
        key = f'columns = {{{quantity} = "..."}} in the case file'
        raise source.refusal(what, f"name the channel that is meant: {key}")
    table, chosen = having[0], source.columns.get(quantity)
    indices = [i for i, name in enumerate(table.names) if name == chosen]
    indices = indices or candidates(table, wanted) or columns_by_unit(table, wanted)
    raster = columns_with_stamps(table, indices, source)
    if raster is None:
        what = f'the {quantity} is in group "{table.part}", which has no time, apart from the other channels'
        raise source.refusal(what, f"{_RASTER}, or with a time in each group")
    return raster


def own_clocks(
    table: Table, forced: Sequence[int], moved: Sequence[int], source: Source, words: Words = WORDS
) -> Table:
    """Return a table with one clock: where several columns of time stand each in front of its channels.

    Columns of time that stand beside each other describe the same rows; `bushcli.recording.header.columns` chooses one.
    """
    clocks = clock_columns(table, source)
    if len(clocks) < 2 or not (forced or moved):
        return table
    rasters = []
    # The time of a channel is the last in front of it, or the next where the time stands behind.
    behind = clocks[0] > 0 and clocks[-1] == len(table.names) - 1
    for index in (*forced, *moved):
        beside = [clock for clock in clocks if (clock > index if behind else clock < index)]
        if index in clocks or not beside:
            return table
        rasters.append(_with_clock(table, index, beside[0 if behind else -1], source))
    reference, travels = rasters[0], rasters[len(forced) :]
    chosen = None if source.is_untimed else source.columns.get("time")
    if chosen is not None:
        rasters.append(_with_clock(table, reference.columns[0], chosen_index(table, chosen), source))
    if all(_same_clock(reference, raster, True) for raster in rasters):
        others = {i for i in clocks if i != reference.stamps.index} if chosen is None else set()
        names = tuple("" if i in others else name for i, name in enumerate(table.names))
        return replace(_first_rows(table, len(reference.time)), names=names)
    if any((raster.stamps.begin is None) != (reference.stamps.begin is None) for raster in rasters):
        return table  # one is a date and the other is not: a logger's two ways to write the time of a row
    if chosen is not None:
        labels = " and ".join(dict.fromkeys(table.label(raster.stamps.index) for raster in rasters))
        what = f"{labels} are different times, and each channel has the one that stands beside it"
        expected = (
            "leave `time` out of `columns`, and each channel is read with its own time; or delete the "
            "column that is not a time of these channels"
        )
        raise table.refusal(what, expected)
    if not all(_same_clock(reference, raster, True) for raster in rasters[: len(forced)]):
        what = f"{words[1]} have different columns of time"
        raise table.refusal(what, "forces are not interpolated: " + _RASTER)
    reference = replace(reference, columns=tuple(forced))
    return interpolate_at_stamps(reference, travels, source, words, together=True)


def clock_columns(table: Table, source: Source) -> list[int]:
    """Return the columns of time that stand apart from each other, from 0; none if two are neighbours.

    Parameters
    ----------
    table : Table
    source : Source
    """
    wanted, head = WantedColumn.of(source, "time"), _first_rows(table, min(len(table), _HEAD))
    named = [column.index for column in columns_as(table, wanted) if column.rank]
    columns = named or columns_by_unit(table, wanted)
    clocks = sorted({*columns, *(i for i in range(len(table.names)) if head.clock(i) is not None)})
    return clocks if all(b - a > 1 for a, b in pairwise(clocks)) else []


def _with_clock(table: Table, index: int, clock: int, source: Source) -> RasterColumns:
    """Return a column with its column of time, to the last row that has one: a slower channel has fewer rows."""
    count = len(table)
    if isinstance(table, ArrayTable):
        values = table.columns[clock]
        if values is not None and values.dtype.kind in "fmM":
            filled = ~np.isnat(values) if values.dtype.kind in "mM" else ~np.isnan(values)
            count = int(np.flatnonzero(filled).max(initial=-1)) + 1
    else:
        count = max((row + 1 for row in range(len(table)) if table.text(row, clock)), default=0)
    cut = _first_rows(table, count)
    stamps = column(cut, replace(source, columns={"time": clock + 1}), "time")
    assert stamps is not None
    return RasterColumns(cut, (index,), stamps)


def _first_rows(table: Table, count: int) -> Table:
    return table if count == len(table) else table.of_rows(np.arange(count))


def interpolate_at_stamps(
    forced: RasterColumns, moved: Rasters, source: Source, words: Words = WORDS, together: bool = False
) -> ArrayTable:
    """Return a table of the force, and of the travel at its stamps."""
    forced, moved, rows, gaps = _common_stamps(forced, moved, source, together)
    table, times = forced.table, forced.time[rows]
    # The stamps are in the unit of the file, or durations for dates.
    values: dict[int, NDArray[np.generic]] = {
        forced.stamps.index: table.numbers(forced.stamps.index)[rows]
        if table.clock(forced.stamps.index) is None
        else np.asarray(np.rint(1e9 * times).astype("m8[ns]"))
    }
    for index in forced.columns:
        values[index] = table.numbers(index, source.accept)[rows]
    columns = [values.get(i) for i in range(len(table.names))]
    # Of the other columns the rows are not those of the force.
    names = ["" if values is None else name for name, values in zip(table.names, columns, strict=True)]
    units = list(table.units)
    for motion in moved:
        for index in motion.columns:
            travel = np.interp(times, motion.time, motion.table.numbers(index, source.accept))
            if together:
                columns[index], names[index] = travel, motion.table.names[index]
                continue
            columns.append(travel)
            names.append(motion.table.names[index])
            units.append(motion.table.units[index])
    parts = dict.fromkeys(raster.table.part for raster in (forced, *moved))
    remarks = [text for raster in (forced, *moved) for text in raster.table.remarks]
    text = f"{words[0]}, in {' and '.join(dict.fromkeys(motion.raster for motion in moved))}, is interpolated at the "
    text += f"{len(forced.time)} time stamps of {words[1]}, in {forced.raster}"
    if not rows.all():
        where = "before its beginning or after its end"
        where += f", or in its {count_of(gaps, 'gap')}" if gaps else ""
        text += f"; {np.count_nonzero(~rows)} of them, {where}, are left out"
    remarks.append(text)
    return ArrayTable(
        path=source.file,
        names=tuple(names),
        units=tuple(units),
        part=" + ".join(parts)[:200],
        columns=tuple(columns),
        preamble=table.preamble,
        header_line=table.header_line,
        origin=table.origin,
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _common_stamps(
    forced: RasterColumns, moved: Rasters, source: Source, together: bool
) -> tuple[RasterColumns, Rasters, NDArray[np.bool_], int]:
    """Return the force, and the travels with stamps that count from the same instant; where all travels are known, (n,)
    by stamp of the force; and the number of gaps of the travels.
    """
    rasters, motions, gaps = list[RasterColumns](), list[RasterColumns](), 0
    for raster in (forced, *moved):
        if (np.diff(raster.time) < 0.0).any():
            row = int(np.argmax(np.diff(raster.time) < 0.0)) + 1
            what = f"the time runs backwards, {raster.time[row]:g} s follows {raster.time[row - 1]:g} s"
            raise raster.table.refusal(what, _RASTER, row)
        # Stamps with too few digits get equal intervals.
        even = even_stamps(raster.time)
        stamps = raster.stamps if even is None else replace(raster.stamps, values=even)
        rasters.append(replace(raster, stamps=stamps))
    forced, *moved = rasters
    rows = np.ones(len(forced.time), dtype=bool)
    for raster in moved:
        shift = _shift(forced, raster, together)
        if shift is None:
            what = f"{forced.name} and {raster.name} have different time stamps"
            what += ", and the file does not say that they count from the same instant"
            raise source.refusal(what, f"{_RASTER}, or with dates")
        raster = replace(raster, stamps=replace(raster.stamps, values=raster.time + shift))
        rows &= (forced.time >= raster.time[0]) & (forced.time <= raster.time[-1]) & (len(raster.time) > 1)
        values = raster.table.numbers(raster.columns[0], source.accept)
        intervals = np.diff(raster.time)
        paused = np.abs(np.diff(values)) > _MOVED * np.ptp(values)
        paused &= intervals > _PAUSE * np.median(intervals) if len(intervals) else False
        for gap in np.flatnonzero(paused):
            rows &= (forced.time <= raster.time[gap]) | (forced.time >= raster.time[gap + 1])
        gaps += np.count_nonzero(paused)
        motions.append(raster)
    if np.count_nonzero(rows) < 2:
        spans = " and ".join(dict.fromkeys(raster.span for raster in (forced, *motions)))
        what = f"{spans} do not overlap in time"
        raise source.refusal(what, "were they recorded in the same run?")
    return forced, motions, rows, gaps
