"""Reads a user's file, if it is a regular file and not larger than a given size."""

from __future__ import annotations

import stat
from pathlib import Path


class TooLarge(ValueError):
    """A file is larger than it may be, or may never end."""


class Endless(TooLarge):
    """It is a device or a pipe: no part of it can be left out."""


def read_beginning(path: Path, count: int, most: int) -> bytes:
    """Return the first bytes of a regular file.

    Parameters
    ----------
    path : Path
    count : int
        Bytes to return, fewer where the file has fewer.
    most : int
        Largest size that the file may have, bytes.

    Raises
    ------
    TooLarge
        The file is larger, or is a device or a pipe.
    OSError
        It cannot be read.
    """
    _refuse_endless(path)
    if path.stat().st_size > most:
        raise TooLarge(f"has more than {most / 1e6:g} MB")
    with path.open("rb") as file:
        return file.read(count)


def read_bounded(path: Path, most: int) -> bytes:
    """Return the contents of a regular file.

    Parameters
    ----------
    path : Path
    most : int
        Largest size that the file may have, bytes.

    Raises
    ------
    TooLarge
        The file is larger, or is a device or a pipe, which may never end; the message distinguishes the two.
    OSError
        It cannot be read.
    """
    _refuse_endless(path)
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise TooLarge(f"has more than {most / 1e6:g} MB")
    return content


def _refuse_endless(path: Path) -> None:
    """Refuse what is neither a regular file nor a directory, which `open` refuses."""
    kind = path.stat().st_mode
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):
        raise Endless("is a device or a pipe, not a file")
