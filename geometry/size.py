"""Sizes that a bushing can have, and units of length."""

from __future__ import annotations

from typing import Literal

from geometry.errors import GeometryError

Unit = Literal["mm", "cm", "m", "inch"]
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
#: Remedy for a part of impossible size.
UNITS = 'unit = "mm", "cm", "m" or "inch", if the numbers in the file are not in the unit that it states'
#: Notes on a file with a unit, and on one without.
STATES = "the file states the unit of length {}"
UNSTATED = "the file states no unit: its numbers are taken as mm (geometry.unit for another)"

#: Least and largest size of a bushing, mm; beyond them the unit must be wrong.
SMALLEST, LARGEST = 2.0, 3000.0


def refuse_size(size: float, where: str, remedy: str) -> None:
    """Refuse a part whose largest extent (mm) is not that of a bushing.

    Parameters
    ----------
    size
        Largest extent, mm.
    where
        File, or key of the case.
    remedy
        How to state the unit.

    Raises
    ------
    GeometryError
    """
    if not SMALLEST <= size <= LARGEST:
        raise GeometryError(where, f"is {size:.4g} mm in size, which is impossible for a bushing", remedy)
