"""TDMS (LabVIEW), by npTDMS: groups of channels; a waveform has a sampling interval instead of a time channel."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.header import match_quality
from bushcli.recording.reader import FilePart, Reader, seconds, unit_of

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit", "units")


@contextmanager
def _opened(path: Path) -> Iterator[Sequence[FilePart]]:
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        yield [part for group in file.groups() for part in _parts(group)]


def _parts(group: Any) -> Iterator[FilePart]:
    """Yield the channels of a group by their length: channels of different lengths have different rasters."""
    lengths: dict[int, list[Any]] = {}
    for channel in group.channels():
        lengths.setdefault(len(channel), []).append(channel)
    lengths.pop(0, None)
    for samples, channels in lengths.items():
        name = group.name if len(lengths) == 1 else f"{group.name}, {samples} samples"
        names = [channel.name for channel in channels]
        dated = [channel.dtype.kind in "mM" for channel in channels]
        units = ["s" if date else _unit(channel) for channel, date in zip(channels, dated, strict=True)]
        load = partial(_load, channels)
        if not any(dated) and not any(match_quality(one, "time") for one in names):
            start, step = _raster(channels)
            if step is not None:
                names, units = ["time", *names], ["s", *units]
                load = partial(_load_timed, channels, start + step * np.arange(samples))
        yield FilePart(name, names, units, samples, load)


def _unit(channel: Any) -> str:
    return next((unit for key in _UNITS if (unit := unit_of(channel.properties.get(key)))), "")


def _raster(channels: Sequence[Any]) -> tuple[float, float | None]:
    """Return the common start and interval, s, of the waveforms in a group."""
    found = {
        (float(c.properties.get("wf_start_offset", 0.0)), float(c.properties["wf_increment"]))
        for c in channels
        if float(c.properties.get("wf_increment", 0.0)) > 0.0
    }
    return found.pop() if len(found) == 1 else (0.0, None)


def _load(channels: Sequence[Any], index: int) -> NDArray[Any]:
    return seconds(np.asarray(channels[index][:]))


def _load_timed(channels: Sequence[Any], time: NDArray[np.float64], index: int) -> NDArray[Any]:
    return time if index == 0 else _load(channels, index - 1)


READER = Reader(
    name="a TDMS file",
    recognises=lambda head, suffix: head.startswith(b"TDSm"),
    opened=_opened,
    library="nptdms",
)
