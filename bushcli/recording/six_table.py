"""The table of a recording of six motions: one sheet or group that has all columns, or several put together.

The columns are named by the case file, or have names of motions and reactions ("ux_mm", "Fx [N]"). Where a logger
writes motions and reactions with different time stamps that count from the same instant, the motions are interpolated
at the stamps of the reactions, as `bushcli.recording.rasters` does for a single motion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header import heading
from bushcli.recording.opened import listed, opened
from bushcli.recording.rasters import TIME, RasterColumns, known_at, raster_name, span_of, stamps_of
from bushcli.recording.source import Source
from bushcli.recording.table import ArrayTable, Table
from bushcli.recording.table_cache import TableCache
from cases.six import MOTIONS, REACTIONS

# Names of motions and reactions in a header: "ux_mm", "Fx [N]", "rotz_deg", "rz".
_ALIASES = {
    **{name: (name,) for name in (*MOTIONS, *REACTIONS)},
    **{f"r{axis}": (f"r{axis}", f"rot{axis}", f"rotation{axis}") for axis in "xyz"},
}
# Least number of samples: a path from one pose to another.
_FEWEST = 2


def named_in(table: Table) -> dict[str, int]:
    """Return the columns, from 0, that have names of motions or reactions, by "ux" to "mz"."""
    found: dict[str, int] = {}
    for index, name in enumerate(table.names):
        first = re.split(r"[\s_\[\(/]", name.strip().casefold(), maxsplit=1)[0]
        for known, aliases in _ALIASES.items():
            if first in aliases and known not in found:
                found[known] = index
    return found


def six_table(source: Source, chosen: Mapping[str, str], tables: TableCache) -> Table:
    """Return the table of a recording of six motions.

    Parameters
    ----------
    source : Source
    chosen : mapping of str to str
        Columns that the case file names, by "ux" to "mz".
    tables : TableCache

    Raises
    ------
    RecordingError
        The file cannot be read, or it is not clear which of its columns are the motions and reactions.
    """
    found = opened(source, list(chosen.values()), tables)
    if isinstance(found, Table):
        return found
    if len(found.tables) == 1 and not found.failed:
        return found.tables[0][0]
    having = [(table, joins, _columns(table, chosen)) for table, joins in found.tables]
    every = {name for _, joins, columns in having if not joins for name in columns}
    for joined in (False, True):
        fitting = [table for table, joins, columns in having if joins == joined and every == columns.keys()]
        if len(fitting) == 1 and every:
            return fitting[0]
        if fitting and every:
            what = f"{len(fitting)} sheets or groups have motions and reactions: "
            what += listed([table.part for table in fitting])
            raise RecordingError(
                Problem(str(source.file), what, "", 'choose in the case file: group = "..."')
            )
    parts = [
        _Part(table, columns, table.names.index(TIME))
        for table, joins, columns in having
        if isinstance(table, ArrayTable) and not joins and columns and TIME in table.names
    ]
    if len(parts) > 1 and found.one_clock:
        return _on_one_raster(source, parts)
    # A sheet with a bad row may be the sheet that is meant.
    for error in found.failed.values():
        raise error
    what = "no sheet or group has all motions and reactions; there are "
    what += listed([table.part for table, joins, _ in having if not joins])
    expected = "one table with columns such as time_s, ux_mm, fx_N; or their names: motions = {ux = ...}"
    raise RecordingError(Problem(str(source.file), what, "", expected))


@dataclass(frozen=True)
class _Part:
    """A group with motions or reactions: its table, their columns, and the column of the time stamps, from 0."""

    table: ArrayTable
    columns: Mapping[str, int]
    time: int


def _columns(table: Table, chosen: Mapping[str, str]) -> dict[str, int]:
    """Return the columns, from 0, of a table that the case file names or that have the name of a motion or reaction."""
    names = [heading(name).name for name in table.names]
    known = {key: heading(text).name for key, text in chosen.items()}
    own = {key: names.index(name) for key, name in known.items() if name in names}
    return {key: index for key, index in named_in(table).items() if key not in known} | own


def _on_one_raster(source: Source, parts: Sequence[_Part]) -> ArrayTable:
    """Return the reactions, and the motions interpolated at the stamps of the reactions."""
    forced = [part for part in parts if any(key in REACTIONS for key in part.columns)]
    if len(forced) != 1:
        what = f"reactions are in {len(forced)} groups with different time stamps: "
        what += listed([part.table.part for part in forced])
        expected = "export them with one common raster; forces are not interpolated"
        raise RecordingError(Problem(str(source.file), what, "", expected))
    (own,) = forced
    moved = [
        (key, RasterColumns(part.table, (index,), stamps_of(part.table)))
        for part in parts
        if part is not own
        for key, index in part.columns.items()
    ]
    keys = [*own.columns, *(key for key, _ in moved)]
    for key in keys:
        if keys.count(key) > 1:
            what = f"{key} is in several groups with different time stamps"
            expected = f'name the channel that is meant: motions = {{{key} = "..."}} in the case file'
            raise RecordingError(Problem(str(source.file), what, "", expected))
    whole = RasterColumns(own.table, (own.time, *own.columns.values()), stamps_of(own.table))
    known = np.all([known_at(one, whole.time, source)[0] for _, one in moved], axis=0)
    if np.count_nonzero(known) < _FEWEST:
        spans = dict.fromkeys(span_of(one) for one in (whole, *(one for _, one in moved)))
        what = f"{' and '.join(spans)} do not overlap in time"
        raise RecordingError(Problem(str(source.file), what, "", "were they recorded in the same run?"))
    return _joined(source, whole, [one for _, one in moved], known)


def _joined(
    source: Source, whole: RasterColumns, moved: Sequence[RasterColumns], known: NDArray[np.bool_]
) -> ArrayTable:
    """Return the columns of a group, and others interpolated at those of its stamps where all are known."""
    at = whole.time[known]
    values = [whole.table.numbers(index, source.accept)[known] for index in whole.columns]
    values += [np.interp(at, one.time, one.table.numbers(one.columns[0], source.accept)) for one in moved]
    places = [(whole.table, index) for index in whole.columns]
    places += [(one.table, one.columns[0]) for one in moved]
    groups = ", ".join(dict.fromkeys(raster_name(one) for one in moved))
    remark = f"motions, in {groups}, are interpolated at the {len(known)} time stamps of the reactions, in "
    remark += raster_name(whole)
    lost = int(np.count_nonzero(~known))
    remark += f"; {lost} of them, where a motion is not known, are left out" if lost else ""
    return ArrayTable(
        path=source.file,
        names=tuple(table.names[index] for table, index in places),
        units=tuple(table.units[index] for table, index in places),
        part=" + ".join(dict.fromkeys(table.part for table, _ in places))[:200],
        columns=tuple(values),
        remarks=(remark,),
    )
