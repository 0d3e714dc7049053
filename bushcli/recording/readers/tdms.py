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
def opened(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the groups of channels, by clock."""
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        parts: list[FilePart] = []
        for group in file.groups():
            channels = []
            for one in group.channels():
                dated = one.dtype.kind in "mM"  # in UTC
                unit = next((text for key in _UNITS if (text := unit_of(one.properties.get(key)))), "")
                sampling = None if dated else sampling_of(one.properties)
                unit, load = UTC if dated else unit, partial(one.__getitem__, slice(None))
                channels.append(WaveChannel(one.name, unit, len(one), dated, load, sampling))
            parts += parts_by_clock(group.name, channels)
        yield parts


READER = Reader(
    name="a TDMS file",
    recognises=lambda head, suffix: head.startswith(b"TDSm"),
    opened=opened,
    library="nptdms",
)
