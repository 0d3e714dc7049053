"""MDF 3 and 4 (ASAM Measurement Data Format), by asammdf: groups of channels, each with its own raster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader, unique_names
from bushcli.recording.text.clock_times import Instant

#: The stamps of all groups count from the beginning of the measurement.
_BEGIN = Instant("beginning of the measurement", 0)


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the groups of channels."""
    from asammdf import MDF

    # Given a name, the library would judge the file by its suffix.
    with path.open("rb") as stream, MDF(stream) as file:
        groups = [(i, group) for i, group in enumerate(file.groups) if group.channel_group.cycles_nr]
        names = []
        for i, group in groups:
            source = getattr(group.channel_group, "acq_source", None)
            name = getattr(group.channel_group, "acq_name", "") or (source.name if source else "") or ""
            names.append(name.strip() or f"group {i + 1}")
        parts = []
        for (i, group), name in zip(groups, unique_names(names), strict=True):
            master = file.masters_db.get(i)
            titles = [channel.name for channel in group.channels]
            units = [file.get_channel_unit(group=i, index=k) or "" for k in range(len(titles))]
            # In MDF 3 each master is a time.
            if master is not None and getattr(group.channels[master], "sync_type", 1) == 1:
                # Loggers call it t, timestamps or by the name of the bus; the format itself marks it as the time.
                titles[master], units[master] = "time", units[master] or "s"
            count, load = int(group.channel_group.cycles_nr), partial(_load, file, i)
            parts.append(FilePart(name, titles, units, count, load, origin=_BEGIN))
        yield parts


def _load(file: Any, group: int, index: int) -> NDArray[Any]:
    if file.masters_db.get(group) == index:
        return np.asarray(file.get_master(group))
    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
    values = np.asarray(signal.samples)
    invalid = getattr(signal, "invalidation_bits", None)
    if invalid is None or not np.any(invalid) or values.dtype.kind not in "iuf":
        return values
    return np.where(np.asarray(invalid, dtype=bool), np.nan, values)


READER = Reader(
    name="an MDF file",
    recognises=lambda head, suffix: head.startswith((b"MDF     ", b"UnFinMF ")),
    open_parts=open_parts,
    library="asammdf",
)
