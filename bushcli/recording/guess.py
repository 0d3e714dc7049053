"""Guess the tested mode from the name of a file: ``run_03_axial.csv``, ``Zug_23C.xlsx``."""

from __future__ import annotations

import re

from cases.mode import modes


def mode_of_name(name: str, specimen: str) -> str | None:
    """Return the mode that the name of a file contains, or None where it contains none or several.

    A name contains a mode's word if one of its words equals it or, from four letters on, begins with it.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    words = [word for word in re.split(r"[\W_\d]+", name.lower().replace("pure_shear", "pureshear")) if word]
    found = {
        mode.name
        for mode in modes().values()
        if mode.specimen == specimen
        for known in mode.words
        if any(word == known or (len(known) >= 4 and word.startswith(known)) for word in words)
    }
    return found.pop() if len(found) == 1 else None
