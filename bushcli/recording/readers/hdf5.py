"""HDF5, by h5py: vectors side by side in a group, a matrix, or a table of records.

No other file is read: datasets that store their values outside the file are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader, unit_of
from bushcli.recording.waveforms import WaveChannel, parts_by_clock, sampling_of

_UNIT = ("unit", "units", "Unit", "Units", "unit_string", "UNITS")
_UNITS = ("units", "unit", "Units", "UNITS")
_NAMES = ("columns", "column_names", "names", "channels", "channel_names", "fields")
#: Largest number of datasets, and of columns of a matrix, that are read.
_MOST, _WIDEST = 10_000, 1_000


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the tables of a file, and the vectors of each group side by side."""
    import h5py

    with h5py.File(path, "r") as file:
        items: list[Any] = []

        def collect(name: str, item: Any) -> bool | None:
            items.append(item)
            # True ends the visit.
            return True if len(items) >= _MOST else None

        file.visititems(collect)
        parts, vectors = list[FilePart](), dict[str, list[WaveChannel]]()
        for data in (item for item in items if isinstance(item, h5py.Dataset)):
            if data.shape is None or data.is_virtual or data.external:
                continue
            shape = tuple(size for size in data.shape if size != 1)
            if data.dtype.names and len(shape) == 1:
                parts.append(_records(data, shape[0]))
            elif data.dtype.kind in "iuf" and len(shape) == 1:
                vectors.setdefault(data.parent.name, []).append(_vector(data, shape[0]))
            elif data.dtype.kind in "iuf" and len(shape) == 2 and min(shape) <= _WIDEST:
                parts.append(_matrix(data, shape))
        for parent, members in vectors.items():
            parts += parts_by_clock(parent, members)
        yield parts


def _texts(attributes: Mapping[str, Any], keys: Sequence[str], count: int) -> list[str]:
    """Return an attribute that holds one text per column; empty texts where there is no such attribute."""
    for key in keys:
        value = attributes.get(key)
        if isinstance(value, (np.ndarray, list, tuple)) and len(value) == count:
            return [unit_of(text) for text in value]
    return [""] * count


def _records(data: Any, samples: int) -> FilePart:
    names = list(data.dtype.names)
    units = _texts(data.attrs, _UNITS, len(names))
    return FilePart(data.name, names, units, samples, lambda i: np.asarray(data[names[i]]).reshape(-1))


def _matrix(data: Any, shape: tuple[int, ...]) -> FilePart:
    """Return a matrix as columns; time runs along the longer side."""
    samples, width = max(shape), min(shape)
    along = shape[0] >= shape[1]
    names, units = _texts(data.attrs, _NAMES, width), _texts(data.attrs, _UNITS, width)

    def side(index: int) -> NDArray[Any]:
        # `shape` lacks sides of length 1, which are the first or last.
        whole = data if tuple(data.shape) == shape else np.asarray(data[...]).reshape(shape)
        return np.asarray(whole[:, index] if along else whole[index, :])

    return FilePart(data.name, names, units, samples, side)


def _vector(data: Any, samples: int) -> WaveChannel:
    name, attributes = data.name.rsplit("/", 1)[-1], data.attrs
    return WaveChannel(
        name,
        next((unit for key in _UNIT if (unit := unit_of(attributes.get(key)))), ""),
        samples,
        False,
        lambda: np.asarray(data[...]).reshape(-1),
        sampling_of(attributes),
    )


READER = Reader(
    name="an HDF5 file",
    # A MATLAB file of version 7.3 has its own 512 bytes before those of HDF5.
    recognises=lambda head, suffix: any(
        head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048, 4096)
    ),
    open_parts=open_parts,
    library="h5py",
)
