"""The file of an export: one file, replaced only if bushcli wrote it."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from bushcli.errors import InputError, Problem

# Files that an export wrote contain this near their beginning, FMUs (archives) the shorter one in the name of an entry;
# a table of curves begins with its columns. The program's name alone also stands in case files and notes of a user.
_MARK = b"written by bushcli"
_ARCHIVE, _ENTRY = b"PK", b"bushcli"
_TABLE = b"channel,mode,time_s,displacement_"
_LOOKED_AT = 4096


def check_file(path: Path) -> None:
    """Refuse a path where no file can be written, before anything is computed.

    Raises
    ------
    InputError
        The path is a folder or a link, its folder does not exist, or it is a file that bushcli has not written.
    """
    if path.is_symlink():
        what = "is a symbolic link, which is not followed"
        raise InputError(Problem(str(path), what, "", "give another -o FILE"))
    if path.is_dir():
        raise InputError(Problem(str(path), "is a folder", "", "give the name of a file to write: -o FILE"))
    if path.exists() and not path.is_file():
        what = "is no ordinary file but a device, a pipe or a socket, which would be replaced"
        remedy = "give another -o FILE; without -o text goes to standard output"
        raise InputError(Problem(str(path), what, "", remedy))
    if not path.parent.is_dir():
        what = "lies in a folder that does not exist"
        raise InputError(Problem(str(path), what, "", "give another -o FILE"))
    if path.exists():
        with suppress(OSError), path.open("rb") as file:
            head = file.read(_LOOKED_AT)
            if _MARK in head or head.startswith(_TABLE) or (head.startswith(_ARCHIVE) and _ENTRY in head):
                return
        what = "exists already and was not written by an earlier export"
        raise InputError(Problem(str(path), what, "", "give another -o FILE, or delete this one"))


def write_file(path: Path, content: bytes) -> None:
    """Write a file; a failure half way leaves an existing file unchanged.

    Parameters
    ----------
    path : Path
        In a folder that exists.
    content : bytes
        The whole content.

    Raises
    ------
    InputError
        As in `check_file`, or the operating system cannot write the file.
    """
    check_file(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise InputError(Problem(str(path), what, "", "free some space, or give another -o FILE")) from None
    finally:
        part.unlink(missing_ok=True)
