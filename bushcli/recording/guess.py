"""Guess the tested mode from the name of a file: ``run_03_axial.csv``, ``Zug_23C.xlsx``."""

from __future__ import annotations

import re
from collections.abc import Mapping

from cases.mode import modes

#: Words for the sense of a load, which tests of several modes have.
SENSES = frozenset({"tension", "tensile", "zug", "compression", "druck", "stauch"})


def modes_of_name(name: str, specimen: str) -> tuple[str, ...]:
    """Return the modes that the name of a file may mean: of several, those that share no word with each other.

    A name contains a mode's word if one of its words equals it or, from four letters on, begins with it. "quad_shear"
    has a word of simple shear alone beside one that it shares with planar tests: it is simple shear; "shear" may be
    either.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    return _sure(_said(name, specimen))


def contradicted(name: str, mode: str) -> tuple[str, ...]:
    """Return the modes of which the name of a file speaks, where the given one is not among them.

    Short words, which may be units or directions ("rad", "ax"), and those for tension and compression, which a planar
    or a volumetric test has too, contradict no mode.

    Parameters
    ----------
    name : str
        Without the suffix.
    mode : str
        Name of the mode that the case file gives.
    """
    found = _said(name, modes()[mode].specimen)
    if mode in found:
        return ()
    plain = {
        other: {word for word in said if len(word) > 3 and word not in SENSES}
        for other, said in found.items()
    }
    return _sure({other: said for other, said in plain.items() if said})


def _sure(found: Mapping[str, set[str]]) -> tuple[str, ...]:
    """Return the modes with a word that no other has; all if there is none."""
    others = {mode: set().union(*(found[other] for other in found if other != mode)) for mode in found}
    return tuple(mode for mode in found if found[mode] - others[mode]) or tuple(found)


def _said(name: str, specimen: str) -> dict[str, set[str]]:
    """Return the words of each mode that the name of a file contains."""
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
    return {mode: known for mode, known in said.items() if known}


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
