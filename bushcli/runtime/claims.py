"""Names of files in the folder of results that a run may leave behind if it ends before `result.json` lists them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path

from bushcli.runtime.bounded import read_bounded

CLAIMED = ".bushcli-files"
#: Bytes of the list; a longer one is not bushcli's.
_LARGEST = 10_000_000


def claim(directory: Path, names: Iterable[str]) -> None:
    """Note files that are about to be written, so that a later run may replace them even if this one is interrupted.

    Parameters
    ----------
    directory : Path
        Created if necessary.
    names : iterable of str
        Files that this run may replace (`bushcli.report.folder.refuse_others`).

    Raises
    ------
    OSError
        The folder cannot be written to.
    """
    text = json.dumps(sorted({*claimed(directory), *names}))
    directory.mkdir(parents=True, exist_ok=True)
    part = directory / f"{CLAIMED}.{os.getpid()}.part"
    try:
        # Created exclusively, in case somebody has placed a link of this name.
        with os.fdopen(
            os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW, 0o666), "w"
        ) as file:
            file.write(text)
        part.replace(directory / CLAIMED)
    finally:
        part.unlink(missing_ok=True)


def claimed(directory: Path) -> frozenset[str]:
    """Return the files that an interrupted run has noted in a folder."""
    file = directory / CLAIMED
    try:
        found = None if file.is_symlink() else json.loads(read_bounded(file, _LARGEST))
    except (OSError, ValueError, RecursionError):
        return frozenset()
    return frozenset(map(str, found)) if isinstance(found, list) else frozenset()


def release(directory: Path) -> None:
    """Forget the files noted: `result.json` lists them now."""
    (directory / CLAIMED).unlink(missing_ok=True)
