"""Checks that a compiled kernel is undamaged: its length against its own header, its content against a checksum.

Loading a damaged library crashes the process, or gives wrong results. The checksum is written to a file beside the
library when it is compiled; a library without that file, from an earlier version, is accepted if its length is right.
CRC-32 detects every error of up to 32 neighbouring bits, and all but one in 4e9 of the others; it takes 0.1 ms for a
kernel (SHA-256: 0.2 ms).
"""

from __future__ import annotations

import os
import struct
import sys
import sysconfig
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

#: Behind the name of a library.
SUFFIX = ".crc32"
#: What the form compiler writes when it has compiled a source.
READY = ".c.cached"


def library_of(folder: Path, module: str) -> Path:
    """Return the library of a module.

    Parameters
    ----------
    folder : Path
        Folder of the kernels.
    module : str
        Name of the module.
    """
    return folder / f"{module}{sysconfig.get_config_var('EXT_SUFFIX')}"


def checksum_file(library: Path) -> Path:
    """Return the file that holds the checksum of a library."""
    return library.with_name(library.name + SUFFIX)


def checksum(content: bytes) -> str:
    """Return the checksum of a content, in hexadecimal digits."""
    return f"{zlib.crc32(content):08x}"


def note_checksum(library: Path, beside: Path | None = None) -> None:
    """Save the checksum of a library; nothing is saved in a folder that cannot be written.

    Parameters
    ----------
    library : Path
        The library that was compiled.
    beside : Path, optional
        Its final place, if it will be moved there.
    """
    with suppress(OSError):
        file = checksum_file(beside or library)
        fresh = file.with_name(f"{file.name}.{os.getpid()}.part")
        fresh.write_text(checksum(library.read_bytes()))
        fresh.replace(file)


def is_sound(library: Path) -> bool:
    """Whether a library is whole, and equal to its checksum if there is one."""
    if not is_whole(library):
        return False
    try:
        return checksum_file(library).read_text(errors="replace").strip() == checksum(library.read_bytes())
    except FileNotFoundError:
        return True
    except OSError:
        return False


def is_whole(file: Path) -> bool:
    """Whether a shared library is as long as its own header says; loading a truncated one ends in a bus error.

    A 64-bit ELF file ends with its table of sections. Any other file is whole on macOS if it is not empty, and nowhere
    else.
    """
    try:
        size = file.stat().st_size
        with file.open("rb") as stream:
            head = stream.read(64)
    except OSError:
        return False
    if len(head) < 64 or head[:4] != b"\x7fELF":
        return sys.platform == "darwin" and size > 0
    order = "<" if head[5] == 1 else ">"
    (start,) = struct.unpack(order + "Q", head[40:48])
    width, count = struct.unpack(order + "HH", head[58:62])
    return bool(size >= start + width * count)


def remove_damaged(folder: Path, module: str, is_good: Callable[[Path], bool] = is_sound) -> None:
    """Remove a module that was compiled, but whose library is damaged or not there.

    Parameters
    ----------
    folder : Path
        Folder of the kernels.
    module : str
        Name of the module.
    is_good : callable
        `is_whole` or `is_sound`.
    """
    ready = folder / f"{module}{READY}"
    if not ready.exists():
        return  # not there, or another process compiles it
    library = library_of(folder, module)
    if not is_good(library):
        # The mark of completion first: a process that finds the source without it waits.
        for file in (ready, library, checksum_file(library), folder / f"{module}.c"):
            file.unlink(missing_ok=True)


def watch_compiler(folder: Path) -> None:
    """Check each kernel of a folder before the form compiler loads it, and note its checksum after a compilation.

    The form compiler has no place for that. It creates the source first, which fails if there is one, and then loads
    the library; after a compilation it creates the mark of completion. Python announces both to audit hooks. A hook
    cannot be removed, and takes less than 1 us for each event. A kernel that is damaged and cannot be replaced is not
    loaded: opening its source raises OSError.

    Parameters
    ----------
    folder : Path
        Folder of the kernels.
    """
    place = os.path.realpath(folder)

    def hook(event: str, details: tuple[object, ...]) -> None:
        if event != "open" or details[1] != "x" or not isinstance(details[0], str):
            return
        parent, name = os.path.split(details[0])
        if os.path.realpath(parent) != place:
            return
        if name.endswith(READY):
            note_checksum(library_of(folder, name.removesuffix(READY)))
        elif name.endswith(".c"):
            try:
                remove_damaged(folder, name.removesuffix(".c"))
            except OSError as error:
                # It must not be loaded: the form compiler ends with this error instead.
                library = library_of(folder, name.removesuffix(".c"))
                reason = f"{error.strerror}, and it is damaged"
                raise OSError(error.errno, reason, str(library)) from error

    sys.addaudithook(hook)
