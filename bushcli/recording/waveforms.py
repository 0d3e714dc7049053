"""Channels of a group -> parts of a file with one clock each, for formats whose channels state their own sampling.

TDMS, and HDF5 files converted from it, describe the samples of a channel by its start, offset and interval: properties
``wf_start_time``, ``wf_start_offset`` and ``wf_increment``. Channels that differ in one of them are not side by side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.header.name import match_quality
from bushcli.recording.header.units import tabulated_unit
from bushcli.recording.reader import FilePart, unique_names, unit_of
from bushcli.recording.text.clock_times import UTC, Instant, clock_times, times_of

#: LabVIEW's instant zero, which a waveform has whose start was never set.
_NEVER = np.datetime64("1904-01-01", "ns").astype(np.int64)


@dataclass(frozen=True)
class Sampling:
    """The clock of a waveform: its start, where it is stated, the first sample after it, and the interval, s.

    The interval is 0 where the file states none.
    """

    start: Instant | None
    first: float
    step: float


@dataclass(frozen=True)
class WaveChannel:
    """A channel of a group: name, unit, number of samples, whether they are times, how to load them, its sampling."""

    name: str
    unit: str
    samples: int
    is_time: bool
    load: Callable[[], NDArray[Any]]
    sampling: Sampling | None = None


def sampling_of(properties: Mapping[str, Any]) -> Sampling | None:
    """Return the sampling that the properties of a channel state; None where they state no clock."""
    numbers = []
    for key in ("wf_increment", "wf_start_offset"):
        try:
            numbers.append(float(properties.get(key, math.nan)))
        except (TypeError, ValueError):
            numbers.append(math.nan)
    unit = tabulated_unit(unit_of(properties.get("wf_xunit_string")) or "s")
    if unit is None or unit.measured != "time":
        return None
    step, first = (0.0 if math.isnan(number) else unit.factor * number for number in numbers)
    start = properties.get("wf_start_time")
    times = None
    if not isinstance(start, np.datetime64):
        times = clock_times([unit_of(start)])
    elif not np.isnat(start):
        times = times_of(np.array([start]))
    begin = None if times is None else times.begin
    known = begin is not None and begin.nanoseconds != _NEVER
    # Files count it in UTC.
    sampling = Sampling(Instant(UTC, begin.nanoseconds) if begin and known else None, first, max(step, 0.0))
    return None if sampling == Sampling(None, 0.0, 0.0) else sampling


def parts_by_clock(group: str, channels: Sequence[WaveChannel]) -> Iterator[FilePart]:
    """Yield the channels of a group, in parts of one clock each.

    A channel without an interval is beside those of its length with one: if these have the same clock, and the channel
    no other start, a remark says that it is taken to have it too. If they have several, it is a part of its own.
    """
    parts: list[tuple[Sampling | None, list[WaveChannel]]] = []
    lengths = dict.fromkeys(channel.samples for channel in channels if channel.samples)
    for samples in lengths:
        same_length = [channel for channel in channels if channel.samples == samples]
        stepped = {c.sampling for c in same_length if c.sampling and c.sampling.step}
        # One without an interval may only repeat the start of the only clock with one.
        start = replace(*stepped, step=0.0) if len(stepped) == 1 else None
        samplings = [None if channel.sampling == start else channel.sampling for channel in same_length]
        clocks = list(dict.fromkeys(filter(None, samplings)))
        if len(clocks) < 2:
            parts.append((next(iter(clocks), None), same_length))
            continue
        pairs = list(zip(same_length, samplings, strict=True))
        stated = [(clock, [c for c, s in pairs if s == clock]) for clock in (*clocks, None)]
        parts += [(clock, members) for clock, members in stated if members]
    names = [group]
    if len(parts) > 1:
        # Several parts of a length are distinguished by their channels.
        sizes = [members[0].samples for _, members in parts]
        names = [
            f"{group}, {samples} samples"
            if sizes.count(samples) == 1
            else f"{group}, {_channel_names(members)}"
            for samples, (_, members) in zip(sizes, parts, strict=True)
        ]
    for name, (sampling, members) in zip(unique_names(names), parts, strict=True):
        yield _part(name, sampling, members)


def _channel_names(channels: Sequence[WaveChannel]) -> str:
    return ", ".join(channel.name for channel in channels[:5])[:80]


def _part(name: str, sampling: Sampling | None, members: Sequence[WaveChannel]) -> FilePart:
    names, units = [channel.name for channel in members], [channel.unit for channel in members]
    samples = members[0].samples
    # A channel of times is more exact than an interval.
    has_time = any(channel.is_time or match_quality(channel.name, "time") for channel in members)
    if sampling is None or not sampling.step or has_time:
        return FilePart(name, names, units, samples, lambda i: members[i].load())
    time = sampling.first + sampling.step * np.arange(samples)
    without = [channel for channel in members if channel.sampling is None or not channel.sampling.step]
    remarks = []
    if without:
        remarks.append(
            f"no sampling interval is stated of {_channel_names(without)}; as many samples as the other channels of "
            f"the group are read at their times, every {sampling.step:.6g} s"
        )
    return FilePart(
        name,
        ["time", *names],
        ["s", *units],
        samples,
        lambda i: members[i - 1].load() if i else time,
        origin=sampling.start,
        remarks=remarks,
    )
