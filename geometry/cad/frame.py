"""From the file's coordinates to the bushing's: axis along z, radial load along x, centre at the origin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry.blocks import Array
from geometry.errors import GeometryError


@dataclass(frozen=True)
class Frame:
    """The bushing's place in the file: its centre (mm) and its directions x, y, z as rows, shape (3, 3)."""

    centre: tuple[float, float, float]
    rows: tuple[tuple[float, float, float], ...]

    def local(self, points: Array) -> Array:
        """Points of the file (mm), shape (n, 3), in the bushing's coordinates."""
        return np.asarray((points - np.array(self.centre)) @ np.array(self.rows).T)

    def in_file(self, points: Array) -> Array:
        """Points of the bushing in the file's coordinates."""
        return np.asarray(points @ np.array(self.rows) + np.array(self.centre))


def frame_of(axis: Array, centre: Array, direction: Array | None) -> Frame:
    """Return the frame with z along the axis and x along the part of `direction` that is normal to it.

    Without a direction: the file's x, or its y where the axis is nearly along x.

    Parameters
    ----------
    axis : Array
        Unit vector along the axis, shape (3,).
    centre : Array
        Origin of the frame, shape (3,), mm.
    direction : Array | None
        Vector whose part normal to the axis becomes x, shape (3,); None for the file's own x.

    Raises
    ------
    GeometryError
        The direction is along the axis, or no direction.
    """
    z = axis / np.linalg.norm(axis)
    if direction is None:
        direction = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = direction - (direction @ z) * z
    if not np.linalg.norm(x) > 1e-3 * np.linalg.norm(direction):
        raise GeometryError(
            "geometry.direction",
            "is along the axis: a radial load acts across it",
            "a vector normal to the axis",
        )
    x /= np.linalg.norm(x)
    rows = np.array([x, np.cross(z, x), z])
    return Frame(
        (float(centre[0]), float(centre[1]), float(centre[2])),
        tuple((float(a), float(b), float(c)) for a, b, c in rows),
    )


def vector_text(vector: Sequence[float] | Array) -> str:
    """Return a direction for a message: ``(0, 0.7071, 0.7071)``."""
    return "(" + ", ".join(f"{round(x, 4) + 0.0:g}" for x in vector) + ")"
