"""Open the table in a file of a case: format by content, group or sheet as given or by its columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.header.columns import found_index
from bushcli.recording.header.match import has_columns
from bushcli.recording.isolated import FileContents
from bushcli.recording.reader import HEAD, readers
from bushcli.recording.several import own_rows
from bushcli.recording.source import Quantity, Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.decode import refused_if_unreadable
from bushcli.recording.text.table import Table
from bushcli.recording.time.rasters import clock_columns, join_by_clock, on_one_raster, own_clocks
from bushcli.runtime.bounded import read_beginning

#: Bytes; only the needed channels of a binary file are read.
LARGEST_BINARY = 512_000_000
#: Formats that users have and bushcli does not read: first bytes, name, remedy.
_FOREIGN = (
    (b"\xd0\xcf\x11\xe0", "an old Excel file (.xls)", "save it as .xlsx or as CSV"),
    (b"MATLAB 5.0", "a MATLAB file before version 7.3", "save it with -v7.3, or write a CSV file"),
    (b"%PDF", "a PDF document", "ask for the file of the test machine"),
    (b"\x93NUMPY", "a NumPy array (.npy)", "write a CSV file with names and units of the columns"),
    (b"PK\x03\x04", "a zip archive", "unpack it first"),
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"7z\xbc\xaf", "a 7-Zip archive", "unpack it first"),
)
_LISTED = 12
_CHANNELS: tuple[Quantity, ...] = ("force", "displacement")


def open_table(source: Source, quantities: Sequence[Quantity], tables: TableCache) -> Table:
    """Return the table of a file that holds the columns of a recording."""
    table = tables_of_file(source, list(source.columns.values()), tables, single=len(quantities) == 1)
    if isinstance(table, FileContents):
        needed = NeededColumns(
            f"columns for {' and '.join(quantities)}",
            "columns = {...}, by name",
            lambda table: has_columns(table, source, quantities),
            lambda together: on_one_raster(together, source) if len(quantities) > 1 else None,
        )
        table = only_table(source, table, needed)
    if source.rows:
        table = own_rows(table, source)
    if len(clock_columns(table, source)) < 2:
        return table
    indices = {quantity: found_index(table, source, quantity) for quantity in quantities}
    forced, moved = ([indices[key]] if key in indices else [] for key in _CHANNELS)
    return own_clocks(table, forced, moved, source)


def tables_of_file(
    source: Source, wanted: Sequence[str | int], tables: TableCache, single: bool = False
) -> Table | FileContents:
    """Return the table of a text file, or the table that the case file names, or else all tables of the file.

    Parameters
    ----------
    source : Source
        File and group.
    wanted : sequence of str or int
        Columns that the case file names, which a binary file has to hold.
    tables : TableCache
        Cache of the files that the caller reads.
    single : bool
        Whether a single column is enough.
    """
    name = format_of(source.file)
    if not name:
        if source.group is not None:
            what = f"group = {source.group!r} has no meaning: a text file is one table"
            raise source.refusal(what)
        return tables.text(source, single)
    inside = tables.tables(source.file, name, wanted)
    if source.group is None:
        return inside
    names = [table.part for table in inside.tables]
    # Channels of the group have clocks of their own, or other lengths: `bushcli.recording.waveforms` names the pieces.
    pieces: tuple[Table, ...] = ()
    if isinstance(source.group, int):
        hits = list(inside.tables[source.group - 1 : source.group])
        listed = f"it has {len(names)}: {quoted_names(names)}"
        problem = Problem(str(source.file), f"has no group {source.group}", "", listed)
    else:
        key = source.group.strip("/ ").casefold()
        named_tables = [(table.part.strip("/ ").casefold(), table) for table in inside.tables]
        hits = [table for part, table in named_tables if part == key]
        pieces = tuple(table for part, table in named_tables if part.startswith(f"{key}, "))
        what = f'has no sheet or group "{source.group}"'
        problem = Problem(str(source.file), what, nearest(source.group, names), quoted_names(names))
    if not hits and not pieces:
        raise inside.failed.get(str(source.group), RecordingError(problem))
    return hits[0] if hits else FileContents(pieces, {})


def format_of(path: Path) -> str:
    """Return the name of the reader that recognises a file by its content, or an empty text for a text file.

    Raises
    ------
    RecordingError
        When the file cannot be opened, is too large, or has a format that is not supported.
    """
    too_large = "export only the columns that are needed, or every tenth row"
    with refused_if_unreadable(path, "a file of a test rig", too_large):
        head = read_beginning(path, HEAD, LARGEST_BINARY)
    suffix = path.suffix.lower()
    for name, reader in readers().items():
        if reader.recognises(head, suffix):
            return name
    for mark, what, remedy in _FOREIGN:
        if head.startswith(mark):
            raise RecordingError(Problem(str(path), f"is {what}", "", remedy))
    return ""


class NeededColumns(NamedTuple):
    """What is sought among the tables of a file.

    Attributes
    ----------
    words, key : str
        What it is, and how the case file names it.
    fits : callable
        Whether a table has it.
    across : callable
        Tables -> what the channels of several give together, None where that is nothing.
    """

    words: str
    key: str
    fits: Callable[[Table], bool]
    across: Callable[[list[Table]], Table | None]


def only_table(source: Source, inside: FileContents, needed: NeededColumns) -> Table:
    """Return the only table of a file, or the only one that fits, or else what channels of several groups give."""
    tables = inside.tables
    is_single = len(tables) == 1 and not inside.failed
    fitting = [table for table in tables if is_single or needed.fits(table)]
    if not fitting:
        together = join_by_clock(tables, source)
        fitting = [table for table in together if needed.fits(table)]
        common = None if fitting else needed.across(together)
        fitting += [] if common is None else [common]
    if len(fitting) == 1:
        return fitting[0]
    what, key = f"{len(fitting)} sheets or groups have {needed.words}: ", 'group = "..." (or sheet)'
    what += quoted_names([table.part for table in fitting])
    if not fitting:
        # A sheet with a bad row may be the sheet that is meant; a sheet without numbers is not.
        for error in inside.failed.values():
            if not tables or "has no table" not in str(error):
                raise error
        if not tables:
            raise source.refusal("holds no table of numbers")
        widest = max(tables, key=lambda table: len(table.names))
        names = ", ".join(filter(None, widest.names))[:200] or "columns without names"
        what = f"no sheet or group has {needed.words}; there are {quoted_names([table.part for table in tables])}"
        what, key = f'{what}; "{widest.part}" has {names}', needed.key
    raise source.refusal(what, f"choose in the case file: {key}")


def quoted_names(names: Sequence[str]) -> str:
    """Return names of sheets or groups in quotes, the first dozen."""
    shown = ", ".join(f'"{name}"' for name in names[:_LISTED])
    return shown + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
