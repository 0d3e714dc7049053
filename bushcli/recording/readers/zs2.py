"""Zwick testXpert II and III (.zs2), by zs2decode: one table per specimen.

The file stores channels by number; the channel manager names them. It does not state the units of the numbers: the case
file has to, unless the name of the channel does.

References
----------
Petrich, zs2decode, https://zs2decode.readthedocs.io (structure of the file; path of the channels).
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bushcli.recording.header.name import heading
from bushcli.recording.reader import FilePart, Reader, unique_names

#: Largest size of the unpacked stream, bytes; a series of ten specimens has some ten million.
_MOST_BYTES = 400_000_000
_MARK = b"\xaf\xbe\xad\xde"
#: Parameter that holds the name of a specimen.
_SPECIMEN = 48154
#: Text in the table for a unit that the file does not state; no unit has this name.
UNKNOWN = "unknown"


@dataclass
class _Node:
    """A chunk with those inside it."""

    name: str
    value: Any = None
    inside: list[_Node] = field(default_factory=list)

    def get(self, path: str) -> _Node | None:
        """Return the first chunk at a path of names, or None."""
        node: _Node | None = self
        for name in path.split("/"):
            node = next((child for child in node.inside if child.name == name), None) if node else None
        return node

    def every(self, name: str) -> Iterator[_Node]:
        """Yield all chunks of a name, at any depth."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            if node.name == name:
                yield node
            waiting.extend(reversed(node.inside))


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the specimens."""
    from zs2decode import parser

    with gzip.open(path) as packed:
        stream = packed.read(_MOST_BYTES + 1)
    if len(stream) > _MOST_BYTES:
        raise ValueError(f"unpacks to more than {_MOST_BYTES / 1e6:g} MB")
    if not stream.startswith(_MARK):
        raise ValueError("the mark of a zs2 file is missing")
    chunks = parser.parse_chunks(parser.data_stream_to_chunks(bytearray(stream)))
    root = _Node("")
    above = [root]
    for _, name, kind, value in chunks:
        if kind == "end":
            above.pop()
            if not above:
                break
            continue
        node = _Node(name, value)
        above[-1].inside.append(node)
        if kind == "DD":
            above.append(node)
    names = {
        _value(channel, "ID"): _value(channel, "Name/Text")
        for manager in root.every("ChannelManager")
        for channel in manager.inside
        if channel.get("ID") and channel.get("Name/Text")
    }
    blocks = [node for node in root.every("SingleGroupDataBlock") if node.get("DataChannels")]
    count = len(blocks)
    specimens = []
    for context in root.every("ParameterListe"):
        for parameter in context.inside:
            texts = _value(parameter, "QS_TextPar") if _value(parameter, "ID") == _SPECIMEN else None
            if isinstance(texts, (list, tuple)) and texts and str(texts[0]).strip():
                specimens.append(str(texts[0]).strip())
    numbered = [f"specimen {i + 1}" for i in range(count)]
    labels = unique_names(specimens if len(specimens) == count else numbered)
    yield [part for block, name in zip(blocks, labels, strict=True) for part in _parts(block, name, names)]


def _value(node: _Node, path: str) -> Any:
    child = node.get(path)
    return None if child is None else child.value


def _parts(block: _Node, name: str, names: dict[Any, Any]) -> Iterator[FilePart]:
    channels = [channel for channel in block.get("DataChannels").inside if channel.get("DataArray")]  # type: ignore[union-attr]
    arrays = [np.asarray(_value(channel, "DataArray"), dtype=float).reshape(-1) for channel in channels]
    titles = [str(names.get(_value(channel, "TrsChannelId")) or "") for channel in channels]
    lengths = dict.fromkeys(len(values) for values in arrays if len(values))
    for samples in lengths:
        indices = [i for i, values in enumerate(arrays) if len(values) == samples]
        part = name if len(lengths) == 1 else f"{name}, {samples} samples"
        units = ["" if heading(titles[i]).written else UNKNOWN for i in indices]
        columns = [arrays[i] for i in indices]
        yield FilePart(part, [titles[i] for i in indices], units, samples, columns.__getitem__)


def recognises(head: bytes, suffix: str) -> bool:
    """Whether what a file packs begins like a zs2 file; a packed file that is damaged is one by its suffix."""
    packed = head.startswith(b"\x1f\x8b")
    try:
        magic = zlib.decompressobj(wbits=31).decompress(head, 4) if packed else b""
    except zlib.error:
        magic = _MARK if suffix == ".zs2" else b""
    return magic == _MARK


READER = Reader(name="a Zwick file (zs2)", recognises=recognises, open_parts=open_parts, library="zs2decode")
