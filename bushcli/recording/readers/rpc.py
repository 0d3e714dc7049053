"""RPC III (MTS; .rsp, .rpc, .tim, .drv): keywords in blocks of 512 bytes, then the frames of each channel in turn.

The header has records of 128 bytes, a keyword of 32 and a value of 96; the first ones are FORMAT, NUM_HEADER_BLOCKS and
NUM_PARAMS. Data follow the header blocks in groups of PTS_PER_GROUP points; in a group all points of a channel stand
together. The last group is padded if it is not full; FRAMES x PTS_PER_FRAME points are valid. A short integer times
SCALE is in the channel's unit.

References
----------
MTS Systems Corporation, RPC III file format (keywords and layout as published with the format's readers, such as
pyRPC3, https://github.com/galuszkm/pyRPC3, and rpc-reader on PyPI).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader

_RECORD, _KEYWORD, _BLOCK = 128, 32, 512
#: Limits above those of the format (256 channels, 1024 parameters); a damaged header exceeds them.
_MOST_PARAMETERS, _MOST_CHANNELS, _MOST_BLOCKS = 20_000, 4_000, 10_000
#: No number of a header is as large: more points than a disk holds, longer than the age of the universe in minutes.
_LARGEST = 1e15
_ORDERS = {"BINARY_IEEE_LITTLE_END": "<", "BINARY_IEEE_BIG_END": ">", "BINARY": "<"}
_TYPES = {"SHORT_INTEGER": "i2", "FLOATING_POINT": "f4"}


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the channels, with a time by the sampling interval."""
    header = _header(path)
    order, kind = header.get("FORMAT", ""), header.get("DATA_TYPE", "SHORT_INTEGER") or "SHORT_INTEGER"
    if order not in _ORDERS or kind not in _TYPES:
        raise ValueError(f"FORMAT = {order[:40]} with DATA_TYPE = {kind[:40]} is not read")
    if order == "BINARY" and kind == "FLOATING_POINT":
        raise ValueError("numbers of a VAX (FORMAT = BINARY, DATA_TYPE = FLOATING_POINT) are not supported")
    channels, frame = int(_number(header, "CHANNELS")), int(_number(header, "PTS_PER_FRAME"))
    frames = int(_number(header, "FRAMES"))
    group = int(_number(header, "PTS_PER_GROUP", float(frame)))
    whole = min(frame, frames) >= 1 and group >= frame and group % frame == 0
    if not (whole and 1 <= channels <= _MOST_CHANNELS):
        what = f"{channels} channels, {frames} frames of {frame} points, groups of {group} points contradict each other"
        raise ValueError(what)
    dtype = np.dtype(_ORDERS[order] + _TYPES[kind])
    start, groups = int(_number(header, "NUM_HEADER_BLOCKS")) * _BLOCK, -(-frames * frame // group)
    needed = start + groups * group * channels * dtype.itemsize
    size = path.stat().st_size
    if size < needed:
        raise ValueError(f"is cut off: it has {size} bytes, its header announces {needed}")
    step = _number(header, "DELTA_T")
    if not step > 0.0:
        raise ValueError(f"DELTA_T = {step:g} s is not a sampling interval")
    numbers = range(1, channels + 1)
    names = [header.get(f"DESC.CHAN_{i}") or f"channel {i}" for i in numbers]
    units = [header.get(f"UNITS.CHAN_{i}", "") for i in numbers]
    scales = [_number(header, f"SCALE.CHAN_{i}", 1.0) for i in numbers]
    points = frames * frame

    def load(index: int) -> NDArray[np.generic]:
        if index == 0:
            return np.asarray(step * np.arange(points), dtype=np.float64)
        raw = np.empty((groups, group), dtype=dtype)
        with path.open("rb") as file:
            for i in range(groups):
                file.seek(start + (i * channels + index - 1) * group * dtype.itemsize)
                raw[i] = np.frombuffer(file.read(group * dtype.itemsize), dtype=dtype)
        values = raw.reshape(-1)[:points]
        return values if dtype.kind == "f" else values * scales[index - 1]

    yield [FilePart("", ["time", *names], ["s", *units], points, load)]


def _header(path: Path) -> Mapping[str, str]:
    """Return the keywords of the header with their values."""
    with path.open("rb") as file:
        first = dict(_records(file.read(3 * _RECORD)))
        count = int(_number(first, "NUM_PARAMS"))
        blocks = int(_number(first, "NUM_HEADER_BLOCKS"))
        if not 3 <= count <= _MOST_PARAMETERS or not 1 <= blocks <= _MOST_BLOCKS or count > 4 * blocks:
            header = f"a header of {count} keywords in {blocks} blocks"
            raise ValueError(f"{header} is not possible in this format")
        file.seek(0)
        return dict(_records(file.read(count * _RECORD)))


def _records(content: bytes) -> Iterator[tuple[str, str]]:
    for offset in range(0, len(content) - _RECORD + 1, _RECORD):
        record = content[offset : offset + _RECORD]
        keyword, value = record[:_KEYWORD], record[_KEYWORD:]
        texts = [part.split(b"\0")[0].decode("cp1252", "replace").strip() for part in (keyword, value)]
        if texts[0]:
            yield texts[0].upper(), texts[1]


def _number(header: Mapping[str, str], keyword: str, default: float | None = None) -> float:
    text = header.get(keyword, "")
    if not text and default is not None:
        return default
    if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3})?", text):
        what = f"= {text[:40]!r} in the header is not a number" if text else "is missing"
        raise ValueError(f"{keyword} {what}")
    number = float(text.replace("D", "e").replace("d", "e"))
    if not abs(number) < _LARGEST:
        raise ValueError(f"{keyword} = {text[:40]} in the header is out of range")
    return number


READER = Reader(
    name="an RPC III file",
    recognises=lambda head, suffix: (
        head.startswith(b"FORMAT\0") or (head.startswith(b"FORMAT ") and b"NUM_HEADER_BLOCKS" in head[:512])
    ),
    open_parts=open_parts,
)
