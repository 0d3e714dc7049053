"""Guess the tested mode from the name of a file: ``run_03_axial.csv``, ``Zug_23C.xlsx``."""

from __future__ import annotations

import re

from cases.mode import modes


def modes_of_name(name: str, specimen: str) -> tuple[str, ...]:
    """Return the modes that the name of a file may mean: of several, those that share no word with each other.

    A name contains a mode's word if one of its words equals it or, from four letters on, begins with it. "quad_shear" has a
    word of simple shear alone beside one that it shares with planar tests: it is simple shear; "shear" may be either.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower().replace("equi-biaxial", "equibiaxial")
    apart = re.sub(r"(pure|simple)[\W_]+shear", r"\1shear", apart)
    words = [word for word in re.split(r"[\W_\d]+", apart) if word]
    said = {
        mode.name: {
            known
            for known in mode.words
            if any(word == known or (len(known) >= 4 and word.startswith(known)) for word in words)
        }
        for mode in modes().values()
        if mode.specimen == specimen
    }
    found = {mode: known for mode, known in said.items() if known}
    others = {mode: set().union(*(found[other] for other in found if other != mode)) for mode in found}
    sure = tuple(mode for mode in found if found[mode] - others[mode])
    return sure or tuple(found)


def mode_of_name(name: str, specimen: str) -> str | None:
    """Return the mode that the name of a file contains, or None where it contains none or several.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    found = modes_of_name(name, specimen)
    return found[0] if len(found) == 1 else None
