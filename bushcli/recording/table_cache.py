"""Cache of the tables of files: channels of one file are read one after the other, its contents once.

The modules that read files are loaded by the first of them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from bushcli.recording.source import Source

if TYPE_CHECKING:
    from bushcli.recording.isolated import FileContents
    from bushcli.recording.text.table import TextTable

Contents = TypeVar("Contents", "FileContents", "TextTable")

#: Numbers in all tables that are cached, 40 MB.
MOST_NUMBERS = 5_000_000


class TableCache:
    """Tables of the files that were read last; a file that was changed is read again."""

    def __init__(self) -> None:
        self._found: OrderedDict[tuple[object, ...], FileContents | TextTable] = OrderedDict()

    def text(self, source: Source, single: bool = False) -> TextTable:
        """Return the table of a text file.

        Parameters
        ----------
        source : Source
        single : bool
            Whether a single column is enough.

        Raises
        ------
        RecordingError
            As `bushcli.recording.text_file.read_table` does.
        """
        from bushcli.recording.text_file import read_table

        how = (source.delimiter, source.decimal, single, source.between)
        return self._contents(source.file, how, lambda: read_table(source.file, *how))

    def tables(self, path: Path, format_name: str, wanted: Collection[str | int]) -> FileContents:
        """Return the tables of a binary file.

        Parameters
        ----------
        path : Path
        format_name : str
            Name of the reader, see `bushcli.recording.reader.readers`.
        wanted : collection of str or int
            Names or numbers, from 1, of the columns that the case file chooses.

        Raises
        ------
        RecordingError
            When the library is not installed, or the file is damaged or too large.
        """
        from bushcli.recording.isolated import read_tables

        return self._contents(path, (format_name, *wanted), lambda: read_tables(path, format_name, wanted))

    def clear(self) -> None:
        """Forget all tables: nothing is read any more."""
        self._found.clear()

    def _contents(self, path: Path, how: tuple[object, ...], read: Callable[[], Contents]) -> Contents:
        """Return what is kept of the present contents of a file, or else what is read."""
        # What changes when the contents of the file change.
        key: tuple[object, ...] = (str(path), *how)
        if path.exists():
            of = path.stat()
            key = (str(path.absolute()), of.st_ino, of.st_mtime_ns, of.st_size, *how)
        contents = self._found.get(key)
        if contents is None:
            contents = self._found[key] = read()
        self._found.move_to_end(key)
        while sum(contents.size for contents in self._found.values()) > MOST_NUMBERS:
            self._found.popitem(last=False)
        return cast("Contents", contents)
