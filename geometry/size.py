"""Sizes that a bushing can have."""

from __future__ import annotations

from geometry.errors import GeometryError

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
