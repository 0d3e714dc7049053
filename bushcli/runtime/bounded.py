"""Read a file of the user up to a stated size, and only if it is a regular file."""

from __future__ import annotations

import stat
from pathlib import Path


class TooLarge(ValueError):
    """A file is larger than it may be, or may never end."""


def read_bounded(path: Path, most: int) -> bytes:
    """Return the contents of a regular file.

    Parameters
    ----------
    path : Path
    most : int
        Bytes that the file may have.

    Raises
    ------
    TooLarge
        The file is larger, or is a device or a pipe, which may never end; the message distinguishes the two.
    OSError
        It cannot be read.
    """
    kind = path.stat().st_mode
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):  # a directory is refused by `open`
        raise TooLarge("is a device or a pipe, not a file")
    with path.open("rb") as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise TooLarge(f"has more than {most / 1e6:g} MB")
    return content
