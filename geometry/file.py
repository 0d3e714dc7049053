"""Checks a geometry file before it is read: a regular file, and small enough to be read within minutes."""

from __future__ import annotations

import stat
from pathlib import Path

#: Largest size of a file by its suffix, bytes. Measured on one core: a drawing of 20 MB is read in 5 s, a STEP file of
#: 10 MB with 2500 holes in one solid in 16 s, a mesh of 64 MB (as large as 250,000 tetrahedra with 10 nodes) in 13 s.
_SOLID, _MESH, _DRAWING = 20_000_000, 64_000_000, 20_000_000
_LARGEST = {
    ".step": (_SOLID, "only the rubber, the sleeves and the plates, without the parts around them"),
    ".stp": (_SOLID, "only the rubber, the sleeves and the plates, without the parts around them"),
    ".brep": (_SOLID, "only the rubber, the sleeves and the plates, without the parts around them"),
    ".brp": (_SOLID, "only the rubber, the sleeves and the plates, without the parts around them"),
    ".msh": (_MESH, "a coarser mesh, or the rubber alone"),
    ".inp": (_MESH, "a coarser mesh, or the rubber alone"),
}


def existing_file(folder: Path, name: str) -> str:
    """Return the path of a file that a case names.

    Parameters
    ----------
    folder : Path
        Folder of the case file.
    name : str
        As written there.

    Raises
    ------
    ValueError
        There is no such file, it is not a regular file, or it is larger than a file of its kind may be.
    """
    path = folder / name
    try:
        status = path.stat()
    except (OSError, ValueError):  # a name with a null character
        raise ValueError("no such file") from None
    if stat.S_ISDIR(status.st_mode):
        raise ValueError("is a directory, not a file")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("is a device or a pipe, not a file")
    limit, remedy = _LARGEST.get(
        path.suffix.lower(), (_DRAWING, "only the section, without the sheet around it")
    )
    if status.st_size > limit:
        raise ValueError(
            f"has {status.st_size / 1e6:.4g} MB, at most {limit / 1e6:g} MB are read: export {remedy}"
        )
    return str(path)
