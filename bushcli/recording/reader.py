"""The type of a reader: one file in `bushcli/recording/readers` per format, found without registration.

A reader of a binary format returns the groups of columns in a file, with names and units as written there; it converts
nothing. A reader that uses another library's parser runs in a separate process
(`bushcli.recording.isolated`).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from bushcli.recording.text.clock_times import Instant

#: Bytes at the beginning of a file by which its format is recognised.
HEAD = 8192


@dataclass(frozen=True)
class FilePart:
    """A sheet, group or raster of a file: columns of equal length.

    Attributes
    ----------
    name : str
    names, units : sequence of str
        By column, as written; empty texts where there is none.
    samples : int
        Rows; 0 if unknown before reading.
    load : callable, optional
        Index of a column from 0 -> its values (n,), as the file stores them. The file is open only while the part is.
    cells : sequence of (int, sequence of str), optional
        Instead of columns: number from 1 and fields of each row of a sheet, the header included.
    dates : sequence of (int, int, Instant)
        Columns of cells, from 0, in which dates or times of day are written as seconds since the first; the number of
        these; and the first.
    origin : Instant, optional
        Where its times count from, if the file says it: times of parts with the same reference are compared.
    remarks : sequence of str
        What a user should know about how the part was read.
    """

    name: str
    names: Sequence[str] = ()
    units: Sequence[str] = ()
    samples: int = 0
    load: Callable[[int], NDArray[Any]] | None = None
    cells: Sequence[tuple[int, Sequence[str]]] | None = None
    dates: Sequence[tuple[int, int, Instant]] = ()
    origin: Instant | None = None
    remarks: Sequence[str] = ()


@dataclass(frozen=True)
class Reader:
    """A reader: recognises and reads the files of a format.

    Attributes
    ----------
    name : str
        Name of the format in messages, with its article: ``an MDF file``.
    recognises : callable
        First bytes of the file, its suffix in lower case -> whether it is of this format.
    open_parts : callable
        Path -> context manager that gives the parts of the file. It raises `OSError` or `ValueError` for a damaged
        file.
    library : str
        Module that it needs; empty where it needs none.
    """

    name: str
    recognises: Callable[[bytes, str], bool]
    open_parts: Callable[[Path], AbstractContextManager[Sequence[FilePart]]]
    library: str = ""


@cache
def readers() -> dict[str, Reader]:
    """Return all readers found in ``bushcli/recording/readers``, by the name of their file."""
    package = importlib.import_module("bushcli.recording.readers")
    modules = [module.name for module in pkgutil.iter_modules(package.__path__)]
    return {name: importlib.import_module(f"{package.__name__}.{name}").READER for name in modules}


def unit_of(values: Any) -> str:
    """Return a unit that a file stores as text or as bytes, without blanks around it; empty where there is none."""
    if isinstance(values, bytes):
        values = values.decode("utf-8", "replace")
    return values.strip() if isinstance(values, str) else ""


def unique_names(names: Sequence[str]) -> list[str]:
    """Return names, repeated ones with a number appended: ``raster``, ``raster 2``."""
    unique: list[str] = []
    for name in names:
        count, candidate = 1, name
        while candidate in unique:
            count += 1
            candidate = f"{name} {count}"
        unique.append(candidate)
    return unique
