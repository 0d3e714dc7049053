"""Channels of one file with different time stamps -> one table at the stamps of the force.

A logger may write the force every millisecond and the travel every ten milliseconds: two groups, each with its own
time. Where the stamps of all groups count from the same instant, as in MDF, the travel is interpolated at the stamps of
the force. The force is never interpolated, because its noise is estimated from the differences of its samples.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.match import WantedColumn, by_unit, candidates, has_columns
from bushcli.recording.source import Quantity, Source
from bushcli.recording.table import ArrayTable, Table
from cases.mode import Mode

Array = NDArray[np.float64]

#: Name that readers give to the stamps of a group.
TIME = "time"
#: A pause of the travel's stamps is a gap, whose travel is unknown, if it is longer than this many median intervals and
#: the travel changes by more than this share of its range. A logger that writes changes only pauses at rest.
_PAUSE, _MOVED = 10.0, 0.01


@dataclass(frozen=True)
class RasterColumns:
    """Columns of a group that can be a quantity, with the group's stamps, s."""

    table: ArrayTable
    columns: tuple[int, ...]
    time: Array


def on_one_raster(tables: Iterable[Table], source: Source, mode: Mode) -> ArrayTable | None:
    """Return the columns of the force with the travel interpolated at their time stamps; None if that is impossible.

    Parameters
    ----------
    tables : iterable of Table
        Groups of a file, whose stamps count from the same instant.
    source : Source
    mode : Mode
        It determines the meaning of the columns.

    Raises
    ------
    RecordingError
        When several groups have the force or the travel, stamps run backwards, or the groups do not overlap in time.
    """
    stamped = [table for table in tables if isinstance(table, ArrayTable) and TIME in table.names]
    forced = _only(stamped, source, mode, "force")
    moved = _only(stamped, source, mode, "displacement")
    if forced is None or moved is None:
        return None
    known, gaps = known_at(moved, forced.time, source)
    if np.count_nonzero(known) < 2:
        what = f"{span_of(forced)} and {span_of(moved)} do not overlap in time"
        raise RecordingError(Problem(str(source.file), what, "", "were they recorded in the same run?"))
    columns = [None if column is None else column[known] for column in forced.table.columns]
    names, units = list(forced.table.names), list(forced.table.units)
    for index in moved.columns:
        values = moved.table.numbers(index, source.accept)
        columns.append(np.interp(forced.time[known], moved.time, values))
        names.append(moved.table.names[index])
        units.append(moved.table.units[index])
    return ArrayTable(
        path=source.file,
        names=tuple(names),
        units=tuple(units),
        part=f"{forced.table.part} + {moved.table.part}",
        columns=tuple(columns),
        remarks=(_said(forced, moved, int(np.count_nonzero(~known)), gaps),),
    )


def _only(tables: list[ArrayTable], source: Source, mode: Mode, quantity: Quantity) -> RasterColumns | None:
    """Return the only group that has a quantity; None if no group has it."""
    if isinstance(source.columns.get(quantity), int):
        return None  # a column's number is ambiguous if the columns are in several groups
    wanted = WantedColumn.of(source, mode, quantity)
    having = [table for table in tables if has_columns(table, source, mode, [quantity])]
    # A group whose channel names the quantity precedes those that have the unit only.
    having = [table for table in having if candidates(table, wanted)] or having
    if not having:
        return None
    if len(having) > 1:
        listed = ", ".join(f'"{table.part}"' for table in having[:8])
        what = f"the channels have different time stamps, and the {quantity} could be in {listed}"
        key = f'columns = {{{quantity} = "..."}} in the case file'
        raise RecordingError(Problem(str(source.file), what, "", f"name the channel that is meant: {key}"))
    table, chosen = having[0], source.columns.get(quantity)
    named = [i for i, name in enumerate(table.names) if name == chosen]
    columns = named or candidates(table, wanted) or by_unit(table, wanted)
    return RasterColumns(table, tuple(columns), stamps_of(table))


def stamps_of(table: ArrayTable) -> Array:
    """Return the time stamps (n,) of a group, s.

    Raises
    ------
    RecordingError
        The stamps run backwards.
    """
    time = table.numbers(table.names.index(TIME))
    if (np.diff(time) < 0.0).any():
        row = int(np.argmax(np.diff(time) < 0.0)) + 1
        what = f"the time runs backwards, {time[row]:g} s follows {time[row - 1]:g} s"
        raise RecordingError(
            Problem(table.place(row), what, "", "export the channels with one common raster")
        )
    return time


def known_at(moved: RasterColumns, time: Array, source: Source) -> tuple[NDArray[np.bool_], int]:
    """Return whether the travel is known at each stamp (n,), and the number of its gaps.

    Parameters
    ----------
    moved : RasterColumns
        The travel.
    time : (n,) array
        Stamps, s.
    source : Source
        Its `accept` lists values that are not codes.
    """
    intervals = np.diff(moved.time)
    known = (time >= moved.time[0]) & (time <= moved.time[-1])
    if not len(intervals):
        return np.zeros(len(time), dtype=bool), 0
    values = moved.table.numbers(moved.columns[0], source.accept)
    paused = intervals > _PAUSE * np.median(intervals)
    paused &= np.abs(np.diff(values)) > _MOVED * np.ptp(values)
    gaps = np.flatnonzero(paused)
    for gap in gaps:
        known &= (time <= moved.time[gap]) | (time >= moved.time[gap + 1])
    return known, len(gaps)


def _said(forced: RasterColumns, moved: RasterColumns, lost: int, gaps: int) -> str:
    text = (
        f"the displacement, in {raster_name(moved)}, is interpolated at the {len(forced.time)} time stamps "
        f"of the force, in {raster_name(forced)}"
    )
    if lost:
        where = "before its beginning or after its end"
        where += f", or in its {gaps} gap{'s' if gaps > 1 else ''}" if gaps else ""
        text += f"; {lost} of them, {where}, are left out"
    return text


def raster_name(columns: RasterColumns) -> str:
    """Return the name of a group with the interval of its stamps."""
    return f'group "{columns.table.part}" every {float(np.median(np.diff(columns.time))):.3g} s'


def span_of(columns: RasterColumns) -> str:
    """Return the name of a group with its first and last stamp."""
    return f'group "{columns.table.part}" ({columns.time[0]:.6g} to {columns.time[-1]:.6g} s)'
