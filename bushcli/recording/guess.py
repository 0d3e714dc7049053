"""Guess the tested mode from the name of a file: ``run_03_axial.csv``, ``Zug_23C.xlsx``."""

from __future__ import annotations

import re

#: Words in lower case; a name contains one if one of its words equals it or, from four letters on, begins with it.
_WORDS = {
    "axial": ("axial", "ax", "längs", "laengs", "longitudinal"),
    "radial": ("radial", "rad", "quer", "lateral"),
    "torsional": ("torsional", "torsion", "tors", "tor", "verdreh", "drehung"),
    "conical": ("conical", "cardanic", "cardan", "kardan", "kard", "konisch", "coni"),
    "uniaxial": ("uniaxial", "tension", "tensile", "zug", "uni", "compression", "druck", "stauch"),
    "equibiaxial": ("equibiaxial", "biaxial", "biax", "equibiax"),
    "planar": ("planar", "pureshear", "shear", "schub", "scher"),
    "volumetric": ("volumetric", "volumetrisch", "bulk"),
}
_SPECIMENS = {
    "bushing": ("axial", "radial", "torsional", "conical"),
    "coupon": ("uniaxial", "equibiaxial", "planar", "volumetric"),
}


def mode_of_name(name: str, specimen: str) -> str | None:
    """Return the mode that the name of a file contains, or None where it contains none or several.

    Parameters
    ----------
    name : str
        Without the suffix.
    specimen : str
        "bushing" or "coupon": the specimen whose modes are considered.
    """
    words = [word for word in re.split(r"[\W_\d]+", name.lower().replace("pure_shear", "pureshear")) if word]
    found = {
        mode
        for mode in _SPECIMENS.get(specimen, ())
        for known in _WORDS[mode]
        if any(word == known or (len(known) >= 4 and word.startswith(known)) for word in words)
    }
    return found.pop() if len(found) == 1 else None
