"""TDMS (LabVIEW), by npTDMS: groups of channels; a waveform has a sampling interval instead of a time channel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from bushcli.recording.reader import FilePart, Reader, unit_of
from bushcli.recording.text.clock_times import UTC
from bushcli.recording.waveforms import WaveChannel, parts_by_clock, sampling_of

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units")


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the groups of channels, by clock."""
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        parts: list[FilePart] = []
        for group in file.groups():
            channels = []
            for channel in group.channels():
                dated = channel.dtype.kind in "mM"  # in UTC
                unit = next((text for key in _UNITS if (text := unit_of(channel.properties.get(key)))), "")
                sampling = None if dated else sampling_of(channel.properties)
                unit, load = UTC if dated else unit, partial(channel.__getitem__, slice(None))
                channels.append(WaveChannel(channel.name, unit, len(channel), dated, load, sampling))
            parts += parts_by_clock(group.name, channels)
        yield parts


READER = Reader(
    name="a TDMS file",
    recognises=lambda head, suffix: head.startswith(b"TDSm"),
    open_parts=open_parts,
    library="nptdms",
)
