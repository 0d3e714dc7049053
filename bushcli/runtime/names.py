"""Turns names of channels into names of files."""

from __future__ import annotations

import re
from collections.abc import Iterable

#: Most characters of a name: with what is added to it, a file name stays within the 255 bytes of a file system.
_LONGEST = 50


def file_names(channels: Iterable[str]) -> dict[str, str]:
    """Return channel -> a name for its files that stays in the folder and is valid on every file system.

    Parameters
    ----------
    channels : iterable of str
        In the order in which equal names are numbered.
    """
    names: dict[str, str] = {}
    for channel in dict.fromkeys(channels):
        safe = re.sub(r"[^\w.-]+", "_", channel).strip("._-")[:_LONGEST] or "channel"
        number, name = 1, safe
        while name.casefold() in {taken.casefold() for taken in names.values()}:
            number += 1
            name = f"{safe}_{number}"
        names[channel] = name
    return names
