"""Bytes that name a question: the same for equal values, in every process, whatever way they were put together."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any


def canonical(question: tuple[Any, ...]) -> bytes:
    """Bytes of a question's values.

    What an effect is described by, its parameters with their bounds included, is part of a question. Its functions are
    pickled by name: what they do is not. A file counts by its path and by what it holds now.
    """
    out = io.BytesIO()
    _Canonical(out).dump(question)
    return out.getvalue()


class _Canonical(pickle.Pickler):
    def __init__(self, out: io.BytesIO) -> None:
        # Up to this protocol an array is the same whether it owns its memory or not.
        super().__init__(out, protocol=4)
        # No references to what was met before: whether two equal objects are one differs after a run was resumed.
        self.fast = True

    def persistent_id(self, obj: Any) -> Any:
        if isinstance(obj, set | frozenset):
            # Their order is another one in every process.
            return "set", sorted(obj, key=repr)
        if isinstance(obj, Path):
            # Not the parts of which it was put together.
            return "path", str(obj)
        contents = getattr(type(obj), "contents", None)
        if callable(contents):
            # A recording is what its file holds.
            return type(obj).__qualname__, vars(obj), contents(obj)
        return None
