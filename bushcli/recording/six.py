"""Six motions and reactions in one file: their columns, and the recorded path."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recording import RecordedPath
from bushcli.errors import count_of
from bushcli.recording.find_table import NeededColumns, only_table, quoted_names, tables_of_file
from bushcli.recording.header.columns import Column, chosen_index, column
from bushcli.recording.header.name import heading
from bushcli.recording.isolated import FileContents
from bushcli.recording.source import SixColumns, Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from bushcli.recording.time.rasters import (
    RasterColumns,
    columns_with_stamps,
    interpolate_at_stamps,
    own_clocks,
)
from bushcli.recording.time.samples import Samples
from cases.six import MOTIONS, PAIR_MODES, REACTIONS

# Names of motions and reactions in a header: "ux_mm", "Fx [N]", "rotz_deg", "rz".
_ALIASES: dict[str, tuple[str, ...]] = {name: (name,) for name in (*MOTIONS, *REACTIONS)}
_ALIASES |= {f"r{axis}": (f"r{axis}", f"rot{axis}", f"rotation{axis}") for axis in "xyz"}
_WORDS = ("the motion", "the reactions")


def named_in(table: Table) -> dict[str, int]:
    """Return the columns, from 0, that have names of motions or reactions, by "ux" to "mz"."""
    columns: dict[str, int] = {}
    for index, name in enumerate(table.names):
        first = re.split(r"[\s_\[\(/]", name.strip().casefold(), maxsplit=1)[0]
        for key, aliases in _ALIASES.items():
            if first in aliases and key not in columns:
                columns[key] = index
    return columns


def six_table(source: Source, chosen: Mapping[str, str], tables: TableCache) -> Table:
    """Return the table of a recording of six motions."""
    source = replace(source, mode="axial")
    table = tables_of_file(source, list(chosen.values()), tables)
    if isinstance(table, FileContents):
        names = {name for part in table.tables for name in _columns(part, chosen)}
        needed = NeededColumns(
            "all motions and reactions",
            "motions = {ux = ...}, by name; names such as time_s, ux_mm, fx_N are found",
            lambda part: bool(names) and names == _columns(part, chosen).keys(),
            lambda together: _on_one_raster(source, together, chosen),
        )
        table = only_table(source, table, needed)
    # Motions and reactions of a table may have clocks of their own.
    columns = _columns(table, chosen)
    forced = [index for key, index in columns.items() if key in REACTIONS]
    moved = [index for key, index in columns.items() if key in MOTIONS]
    return own_clocks(table, forced, moved, source, _WORDS)


def _columns(table: Table, chosen: Mapping[str, str]) -> dict[str, int]:
    """Return the columns, from 0, of a table that the case file names or that have the name of a motion or reaction."""
    names = [heading(name).name for name in table.names]
    headings = {key: heading(text).name for key, text in chosen.items()}
    indices = {key: names.index(name) for key, name in headings.items() if name in names}
    return {key: index for key, index in named_in(table).items() if key not in headings} | indices


def _on_one_raster(source: Source, tables: Sequence[Table], chosen: Mapping[str, str]) -> Table | None:
    """Return the reactions, and the motions interpolated at their stamps; None where one table has all."""
    parts = []
    for table in tables:
        columns = tuple(_columns(table, chosen).values())
        stamps = columns_with_stamps(table, columns, source) if columns else None
        parts += [] if stamps is None else [stamps]
    if len(parts) < 2:
        return None
    forced = [part for part in parts if any(key in REACTIONS for key in _columns(part.table, chosen))]
    if len(forced) != 1:
        what = f"reactions are in {len(forced)} groups with different time stamps: "
        what += quoted_names([part.table.part for part in forced])
        expected = "export them with one common raster; forces are not interpolated"
        raise source.refusal(what, expected)
    (raster,) = forced
    keys = [key for part in parts for key in _columns(part.table, chosen)]
    for key in keys:
        if keys.count(key) > 1:
            what = f"{key} is in several groups with different time stamps"
            expected = f'name the channel that is meant: motions = {{{key} = "..."}} in the case file'
            raise source.refusal(what, expected)
    others = (part for part in parts if part is not raster)
    moved = [RasterColumns(part.table, (i,), part.stamps) for part in others for i in part.columns]
    return interpolate_at_stamps(raster, moved, source, _WORDS)


Array = NDArray[np.float64]
Columns = Mapping[str, str | int]


def columns_of(
    source: Source, motions: Columns | None, forces: Columns | None, tables: TableCache
) -> tuple[dict[str, str | int], dict[str, str | int]]:
    """Return the columns of the motions and of the reactions, as given or else as named in the header.

    Parameters
    ----------
    source : Source
        The recording.
    motions, forces : mapping of str to str or int, or None
        Columns by "ux" to "rz" and "fx" to "mz".
    tables : TableCache

    Raises
    ------
    RecordingError
        The file cannot be read, names no motion, or lacks a column that is given.
    """
    table = six_table(source, columns_given_by_name(motions, forces), tables)
    columns: dict[str, str | int] = {key: index + 1 for key, index in named_in(table).items()}
    of_motions = {k: v for k, v in columns.items() if k in MOTIONS} if motions is None else dict(motions)
    of_forces = {k: v for k, v in columns.items() if k in REACTIONS} if forces is None else dict(forces)
    if not of_motions:
        listed = ", ".join(name for name in table.names if name)[:300]
        what = f"has no column of a motion; its columns are {listed}" if listed else "has no header"
        raise source.refusal(what, "ux_mm ... rz_deg; or choose columns: motions = {ux = ...}")
    for name in of_forces.values():
        # Reactions whose motion stays zero are not read later.
        chosen_index(table, name)
    return of_motions, of_forces


def columns_given_by_name(motions: Columns | None, forces: Columns | None) -> dict[str, str]:
    """Return the columns that a case file chooses by name, by "ux" to "mz".

    Parameters
    ----------
    motions, forces : mapping of str to str or int, or None
        Columns by "ux" to "rz" and "fx" to "mz".
    """
    given = {**(motions or {}), **(forces or {})}
    return {key: name for key, name in given.items() if isinstance(name, str)}


def motion_columns(table: Table, source: Source, six: SixColumns) -> dict[int, Column]:
    """Return the columns of the motions of a recorded path, by their numbers from 0."""
    columns = {}
    for k, name in enumerate(MOTIONS):
        if name not in six.motions:
            continue
        single = replace(source, mode=PAIR_MODES[k], columns={"displacement": six.motions[name]}, units={})
        motion = column(table, single, "displacement")
        assert motion is not None
        columns[k] = motion
    return columns


def read_motions(source: Source, six: SixColumns, tables: TableCache) -> tuple[Array | None, Array]:
    """Read the path of a recording or program: time (n,) in s or None, poses (n, 6) in mm and rad.

    Motions without a column are zero.

    Parameters
    ----------
    source : Source
    six : SixColumns
        Its columns.
    tables : TableCache

    Raises
    ------
    RecordingError
        A column is missing or cannot be read, or the time does not increase.
    """
    table = six_table(source, six.chosen, tables)
    poses: Array = np.zeros((0, 6))
    for k, motion in motion_columns(table, source, six).items():
        if not len(poses):
            poses = np.zeros((len(motion.values), 6))
        poses[:, k] = motion.values
    stamps = column(table, replace(source, mode="axial"), "time")
    time = None if stamps is None else stamps.values
    if time is not None:
        mask = np.concatenate([[True], (np.diff(time) != 0.0) | (np.diff(poses, axis=0) != 0.0).any(axis=1)])
        time, poses = time[mask], poses[mask]
        if np.any(np.diff(time) <= 0.0):
            row = int(np.argmax(np.diff(time) <= 0.0)) + 1
            what = f"the time does not increase, {time[row]:g} s follows {time[row - 1]:g} s"
            raise source.refusal(what, "put the rows in the order of time")
    if len(poses) < 2:
        raise source.refusal(f"has only {count_of(len(poses), 'point')}", "at least 2")
    return time, poses


def recorded_path(source: Source, six: SixColumns, samples: Samples, tables: TableCache) -> RecordedPath:
    """Return the path of a recording of six motions, at its samples."""
    stamps, motion = read_motions(source, six, tables)
    if samples.time is None or stamps is None:
        motion = motion[samples.rows]
    else:
        motion = np.column_stack([np.interp(samples.time, stamps, column) for column in motion.T])
    number = REACTIONS.index(source.label.rpartition(".")[2])
    return RecordedPath(samples.time, motion, six.free, number, six.name)
