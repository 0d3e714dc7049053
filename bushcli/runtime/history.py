"""Which folder holds the saved results of a question: other questions, and files of the user, keep theirs."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import count
from pathlib import Path


def history_of(folder: Path, is_of: Callable[[Path], bool], resume: bool | None) -> tuple[Path, bool]:
    """Return the folder for the saved results of a question, and whether those in it are used.

    A folder of another question is left alone: that of this question gets the same name with -2, -3 and so on.

    Parameters
    ----------
    folder : Path
        Its first name.
    is_of : callable
        Whether an existing folder holds results of the question.
    resume : bool or None
        True: use them; a folder that exists without any is returned, to be refused. False: begin anew in it. None:
        use them if there are any.
    """
    names = (folder if n == 1 else folder.with_name(f"{folder.name}-{n}") for n in count(1))
    for one in names:
        if not os.path.lexists(one):
            break
        real = one.is_dir() and not one.is_symlink()
        if real and is_of(one):
            return one, resume is not False
        if real and not any(one.iterdir()):
            break
    return (folder, True) if resume else (one, False)
