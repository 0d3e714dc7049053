"""Bytes that identify a question: the same for equal values, in every process, however the values were built."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any


def canonical(question: tuple[Any, ...]) -> bytes:
    """Return bytes that identify a question; equal questions give equal bytes in every process.

    The description of an effect is part of a question, including its parameters and their bounds. Its functions are
    pickled by name, so their code is not part of it. A file is identified by its path and its present contents.
    """
    out = io.BytesIO()
    _Canonical(out).dump(question)
    return out.getvalue()


class _Canonical(pickle.Pickler):
    def __init__(self, out: io.BytesIO) -> None:
        # Up to this protocol an array gives the same bytes whether it owns its memory or not.
        super().__init__(out, protocol=4)
        # No references to earlier objects: whether two equal objects are identical changes when a run is resumed.
        self.fast = True

    def persistent_id(self, obj: Any) -> Any:
        if isinstance(obj, set | frozenset):
            # Their order differs from process to process.
            return "set", sorted(obj, key=repr)
        if isinstance(obj, Path):
            # The whole path: its parts depend on how it was built.
            return "path", str(obj)
        contents = getattr(type(obj), "contents", None)
        if callable(contents):
            # A recording is identified by the contents of its file.
            return type(obj).__qualname__, vars(obj), contents(obj)
        return None
