"""Cache of the tables of binary files: channels of one file are read one after the other.

The process that reads a file (`isolated`) takes a second to load the library. Text files are read quickly, and anew
each time. The modules that read files are loaded by the first of them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bushcli.recording.isolated import FileContents

# Numbers in all tables that are cached, 40 MB.
MOST_NUMBERS = 5_000_000


class TableCache:
    """Tables of the binary files that were read last; a file that was changed is read again."""

    def __init__(self) -> None:
        self._found: OrderedDict[tuple[str | int, ...], FileContents] = OrderedDict()

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

        key = (*_state(path), format_name, *wanted)
        if key in self._found:
            self._found.move_to_end(key)
            return self._found[key]
        found = self._found[key] = read_tables(path, format_name, wanted)
        while sum(one.numbers for one in self._found.values()) > MOST_NUMBERS:
            self._found.popitem(last=False)
        return found


def _state(path: Path) -> tuple[str, int, int, int]:
    """Return properties of a file that change when its contents change."""
    try:
        of = path.stat()
    except OSError:
        return str(path), 0, 0, 0
    return str(path.absolute()), of.st_ino, of.st_mtime_ns, of.st_size
