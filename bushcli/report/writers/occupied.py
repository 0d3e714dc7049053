"""One run at a time in a folder of results: a second one would replace what the first one writes."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bushcli.errors import InputError, Problem


def occupy(directory: Path) -> Callable[[], None]:
    """Lock a folder of results, creating it if necessary, and return the function that gives it back.

    The operating system releases the lock when the process ends, in whatever way. File systems without locks, as some
    in a network, are used without one.

    Parameters
    ----------
    directory : Path

    Raises
    ------
    InputError
        Another run writes into the folder.
    """
    is_new = not directory.exists()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return lambda: None  # writing will fail and say why
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        what = "is in use: another run of bushcli writes into this folder"
        raise InputError(
            Problem(str(directory), what, "", "wait until it has ended, or give another -o")
        ) from None
    except OSError:
        pass

    def leave() -> None:
        if is_new:
            with suppress(OSError):  # it is not empty: a result is in it
                directory.rmdir()
        os.close(handle)

    return leave
