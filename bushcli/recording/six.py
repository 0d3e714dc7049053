"""Six motions and reactions in one file: their columns, and the recorded path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.columns import Column, chosen_index, column
from bushcli.recording.six_table import named_in, six_table
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from cases.mode import modes
from cases.six import MOTIONS, PAIR_MODES, REACTIONS

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
    table = six_table(source, chosen(motions, forces), tables)
    found: dict[str, str | int] = {key: index + 1 for key, index in named_in(table).items()}
    own = {k: v for k, v in found.items() if k in MOTIONS} if motions is None else dict(motions)
    theirs = {k: v for k, v in found.items() if k in REACTIONS} if forces is None else dict(forces)
    if not own:
        listed = ", ".join(name for name in table.names if name)[:300]
        what = f"has no column of a motion; its columns are {listed}" if listed else "has no header"
        raise RecordingError(
            Problem(str(source.file), what, "", "ux_mm ... rz_deg; or choose columns: motions = {ux = ...}")
        )
    for name in theirs.values():
        # Reactions whose motion stays zero are not read later.
        chosen_index(table, name)
    return own, theirs


def chosen(motions: Columns | None, forces: Columns | None) -> dict[str, str]:
    """Return the columns that a case file chooses by name, by "ux" to "mz".

    Parameters
    ----------
    motions, forces : mapping of str to str or int, or None
        Columns by "ux" to "rz" and "fx" to "mz".
    """
    given = {**(motions or {}), **(forces or {})}
    return {key: name for key, name in given.items() if isinstance(name, str)}


def motion_columns(table: Table, source: Source) -> dict[int, Column]:
    """Return the columns of the motions of a recorded path, by their numbers from 0."""
    assert source.six is not None
    columns = {}
    for k, name in enumerate(MOTIONS):
        if name not in source.six.motions:
            continue
        one = replace(source, columns={"displacement": source.six.motions[name]}, units={})
        found = column(table, one, modes()[PAIR_MODES[k]], "displacement")
        assert found is not None
        columns[k] = found
    return columns


def read_motions(source: Source, tables: TableCache) -> tuple[Array | None, Array]:
    """Read the path of a recording or program: time (n,) in s or None, poses (n, 6) in mm and rad.

    Motions without a column are zero.

    Parameters
    ----------
    source : Source
    tables : TableCache

    Raises
    ------
    RecordingError
        A column is missing or cannot be read, or the time does not increase.
    """
    assert source.six is not None
    table = six_table(source, source.six.chosen, tables)
    poses: Array = np.zeros((0, 6))
    for k, found in motion_columns(table, source).items():
        if not len(poses):
            poses = np.zeros((len(found.values), 6))
        poses[:, k] = found.values
    stamps = column(table, source, modes()["axial"], "time")
    time = None if stamps is None else stamps.values
    if time is not None:
        kept = np.concatenate([[True], (np.diff(time) != 0.0) | (np.diff(poses, axis=0) != 0.0).any(axis=1)])
        time, poses = time[kept], poses[kept]
        if np.any(np.diff(time) <= 0.0):
            row = int(np.argmax(np.diff(time) <= 0.0)) + 1
            what = f"the time does not increase, {time[row]:g} s follows {time[row - 1]:g} s"
            raise RecordingError(Problem(str(source.file), what, "", "put the rows in the order of time"))
    if len(poses) < 2:
        raise RecordingError(Problem(str(source.file), f"has only {len(poses)} points", "", "at least 2"))
    return time, poses
