"""MDF 3 and 4 (ASAM Measurement Data Format), by asammdf: groups of channels, each with its own raster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader, numbered

#: Largest number of groups whose time stamps are compared, to join groups with the same stamps.
_MOST_COMPARED = 200


@contextmanager
def _opened(path: Path) -> Iterator[Sequence[FilePart]]:
    from asammdf import MDF

    # Given a name, the library would judge the file by its suffix.
    with path.open("rb") as stream, MDF(stream) as file:
        found = [(i, group) for i, group in enumerate(file.groups) if group.channel_group.cycles_nr]
        names = numbered([_name(group, i) for i, group in found])
        parts = [_part(file, i, group, name) for (i, group), name in zip(found, names, strict=True)]
        yield [*parts, *_joined(file, [i for i, _ in found], parts)]


def _name(group: Any, index: int) -> str:
    block = group.channel_group
    source = getattr(block, "acq_source", None)
    name = getattr(block, "acq_name", "") or (source.name if source else "") or ""
    return name.strip() or f"group {index + 1}"


def _part(file: Any, index: int, group: Any, name: str) -> FilePart:
    master = file.masters_db.get(index)
    names = [channel.name for channel in group.channels]
    units = [file.get_channel_unit(group=index, index=i) or "" for i in range(len(names))]
    if master is not None and _is_time(group.channels[master]):
        # Loggers call this channel t, timestamps or by the name of the bus; the format itself marks it as the time.
        names[master], units[master] = "time", units[master] or "s"
    load = partial(_load, file, index)
    return FilePart(name, names, units, int(group.channel_group.cycles_nr), load)


def _is_time(channel: Any) -> bool:
    """Whether a master channel is a time; in MDF 3 each of them is."""
    return bool(getattr(channel, "sync_type", 1) == 1)


def _load(file: Any, group: int, index: int) -> NDArray[Any]:
    if file.masters_db.get(group) == index:
        return np.asarray(file.get_master(group))
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    values = np.asarray(signal.samples)
    invalid = getattr(signal, "invalidation_bits", None)
    if invalid is None or not np.any(invalid) or values.dtype.kind not in "iuf":
        return values
    return np.where(np.asarray(invalid, dtype=bool), np.nan, values)


def _joined(file: Any, groups: Sequence[int], parts: Sequence[FilePart]) -> Iterator[FilePart]:
    """Yield groups with the same time stamps as one group: some loggers write one group per channel."""
    alike: list[tuple[NDArray[Any], list[int]]] = []
    for place, group in list(enumerate(groups))[:_MOST_COMPARED]:
        if "time" not in parts[place].names:
            continue
        stamps = np.asarray(file.get_master(group))
        for other, members in alike:
            if np.array_equal(other, stamps):
                members.append(place)
                break
        else:
            alike.append((stamps, [place]))
    for _, members in alike:
        if len(members) < 2:
            continue
        columns = [
            (place, i)
            for order, place in enumerate(members)
            for i, name in enumerate(parts[place].names)
            if name != "time" or order == 0
        ]
        yield FilePart(
            " + ".join(parts[place].name for place in members)[:200],
            [parts[place].names[i] for place, i in columns],
            [parts[place].units[i] for place, i in columns],
            parts[members[0]].samples,
            partial(_load_joined, parts, columns),
            joined=True,
        )


def _load_joined(parts: Sequence[FilePart], columns: Sequence[tuple[int, int]], index: int) -> NDArray[Any]:
    place, column = columns[index]
    load = parts[place].load
    assert load is not None
    return load(column)


READER = Reader(
    name="an MDF file",
    recognises=lambda head, suffix: head.startswith((b"MDF     ", b"UnFinMF ")),
    opened=_opened,
    library="asammdf",
    one_clock=True,
)
