"""Index files beside the compiled kernels: which library belongs to a function of a point.

The form compiler names a library by the signature of its UFL, which takes some 20 ms per kernel to build, ten times as
long as loading the library. A record is found by the name of the function, and is valid only for the present text of
`forms`, version of UFL and flags of the compiler. If there is none, or if it or its library is damaged, the function is
built and compiled as if there were no records.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import sys
from collections.abc import Hashable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

from cases import jit
from cases.checksum import is_sound
from forms.point import PointFunction

_SOURCES = ("forms", "cases/compiling.py", "cases/records.py")


@dataclass(frozen=True)
class Record:
    """Facts about a compiled function that a caller needs.

    Attributes
    ----------
    library : str
        Name of the file in the kernels' folder.
    size : int
        Numbers that the function returns at a point.
    names : tuple of str
        Inputs that it reads, in the order of its arguments.
    """

    library: str
    size: int
    names: tuple[str, ...]


def find(function: PointFunction) -> tuple[Record, Any] | None:
    """Return the record of a function and its library, loaded; None if there is no complete one."""
    file = _file(function)
    if file is None:
        return None
    try:
        entry = json.loads(file.read_text(encoding="utf-8"))
        record = Record(str(entry["library"]), int(entry["size"]), tuple(map(str, entry["names"])))
        library = file.parent / record.library
        if library.parent != file.parent or not is_sound(library):
            return None
        return record, jit.load(library)
    except (OSError, ValueError, LookupError, TypeError, ImportError):
        return None


def note(function: PointFunction, library: Path, size: int, names: tuple[str, ...]) -> None:
    """Save which library a function was compiled to; nothing is saved in a folder that cannot be written.

    Parameters
    ----------
    function : PointFunction
    library : Path
        The compiled library, in the kernels' folder.
    size : int
        Numbers that the function returns at a point.
    names : tuple of str
        Inputs that it reads, in the order of its arguments.
    """
    file = _file(function)
    if file is None or library.parent.resolve() != file.parent.resolve():
        return
    temporary_file = file.with_suffix(f".{os.getpid()}.part")
    with suppress(OSError):
        temporary_file.write_text(json.dumps(asdict(Record(library.name, size, names))), encoding="utf-8")
        temporary_file.replace(file)


def _file(function: PointFunction) -> Path | None:
    """Path of a function's record; None for a function without a lasting name."""
    key = _stable_key(function.key)
    if key is None:
        return None
    digest = hashlib.sha256(
        f"{_revision()} {key} {sorted(function.blocks.items())} {function.batch}".encode()
    )
    return jit.cache_directory() / f"point-{digest.hexdigest()[:24]}.json"


def _stable_key(part: Hashable) -> str | None:
    """Return a key as text that is the same in every process; None if there is none.

    A function is identified by module and name only if it stands at the top level of a module of `forms`: `_revision`
    covers the text of these modules, and not that of a law which somebody writes elsewhere.
    """
    if isinstance(part, tuple):
        parts = [_stable_key(member) for member in part]
        return None if None in parts else f"({', '.join(map(str, parts))})"
    if isinstance(part, FunctionType):
        home = sys.modules.get(part.__module__)
        lasting = part.__module__.startswith("forms.") and getattr(home, part.__qualname__, None) is part
        return f"{part.__module__}:{part.__qualname__}" if lasting else None
    return repr(part) if isinstance(part, (str, int)) else None


@cache
def _revision() -> str:
    """Digest of all that determines how a function of a point is compiled, except what the folder's name contains."""
    root = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256(" ".join(jit.FLAGS).encode())
    for package in ("fenics-ufl", "fenics-basix", "cffi"):
        with suppress(importlib.metadata.PackageNotFoundError):
            digest.update(f"{package} {importlib.metadata.version(package)}".encode())
    for source in _SOURCES:
        place = root / source
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(file.relative_to(root).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()
