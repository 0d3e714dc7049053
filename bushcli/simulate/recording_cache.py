"""The recordings of cases with the faults of their samples, read once unless their files change.

A study compares many designs with the same recordings. To read a rig's file and search it for faults takes longer than
to simulate the bushing. Readers and the search for faults are loaded by the first recording.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property

from bushcli.case import Case
from bushcli.effects.active import require_values
from bushcli.faults import DataFault
from bushcli.recording import Recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache

# Largest number of recordings kept: those of a case, and of some more cases.
CACHED_RECORDINGS = 64


@dataclass(frozen=True, eq=False)
class _CachedRecording:
    """A recording that was read; its faults are searched for when they are first requested."""

    recording: Recording

    @cached_property
    def faults(self) -> tuple[DataFault, ...]:
        from bushcli.faults import sample_faults

        return tuple(sample_faults(self.recording))


class RecordingCache:
    """Reads the recordings of cases, and keeps what it has read.

    Parameters
    ----------
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    """

    def __init__(self, tables: TableCache | None = None) -> None:
        self.tables = TableCache() if tables is None else tables
        self._recordings: OrderedDict[Hashable, _CachedRecording] = OrderedDict()

    def __call__(self, case: Case) -> tuple[list[Recording], tuple[DataFault, ...]]:
        """Return the samples of each recording that are compared, and faults of the data.

        Raises
        ------
        InputError
            A recording cannot be read, or an effect of the case has no values.
        """
        require_values(case.effects, case.path.name)
        if not case.recordings:
            return [], ()
        from bushcli.faults import find_faults

        used = [self.recording(source) for source in case.recordings]
        return used, find_faults(case, used, self.faults)

    def recording(self, source: Source) -> Recording:
        """Read a recording, as `bushcli.recording.read_recording` does, unless the file has been read before.

        Parameters
        ----------
        source : Source
        """
        from bushcli.recording import read_recording

        try:
            state = source.file.stat()
        except OSError:
            return read_recording(source, self.tables)  # which says what is wrong
        key = (repr(source), state.st_mtime_ns, state.st_size, state.st_ino)
        if key not in self._recordings:
            self._recordings[key] = _CachedRecording(read_recording(source, self.tables))
            if len(self._recordings) > CACHED_RECORDINGS:
                self._recordings.popitem(last=False)
        self._recordings.move_to_end(key)
        return self._recordings[key].recording

    def faults(self, recording: Recording) -> tuple[DataFault, ...]:
        """Return the faults of single samples of a recording; they are searched for once."""
        from bushcli.faults import sample_faults

        reading = next(
            (reading for reading in self._recordings.values() if reading.recording is recording), None
        )
        return tuple(sample_faults(recording)) if reading is None else reading.faults
