"""Refusal of a half or a quarter of a bushing, of which finite-element models often consist."""

from __future__ import annotations

import numpy as np

from geometry.blocks import Array
from geometry.cad.axis import Axis, from_axis
from geometry.errors import GeometryError
from geometry.view import View

#: Sine between a face and a plane through the axis, and distance over the part's size, up to which the face is a cut.
CUT = 1e-3


def refuse_segment(
    points: Array, normals: Array, places: Array, axis: Axis, where: str, view: View | None
) -> None:
    """Refuse a part that lies on one side of a plane through its axis, with a plane face in it.

    No bushing does; a model that was cut at its planes of symmetry does. Its stiffness would be half or a quarter.

    Parameters
    ----------
    points : Array
        Points on the part, shape (n, 3), mm.
    normals : Array
        Normals of plane faces or facets that are not bonded, shape (m, 3).
    places : Array
        A point on each of these, shape (m, 3), mm.
    axis : Axis
        Axis of the bushing.
    where : str
        The file.
    view : View, optional
        Contents of a picture.

    Raises
    ------
    GeometryError
    """
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    length = np.linalg.norm(normals, axis=1)
    unit = normals[length > 0.0] / length[length > 0.0][:, None]
    offset = np.einsum("ij,ij->i", unit, places[length > 0.0] - axis.point)
    through = (np.abs(unit @ axis.direction) < CUT) & (np.abs(offset) < CUT * size)
    for normal in np.unique(np.round(unit[through], 3), axis=0):
        # The normal points out of the part, which lies behind the cut.
        if np.all((points - axis.point) @ normal < 2.0 * CUT * size):
            angle = _covered_angle(points, axis)
            raise GeometryError(
                where,
                f"holds {angle:.0f} of 360 degrees of a bushing: a plane face through the axis ends it, with normal "
                f"({', '.join(f'{x + 0.0:g}' for x in normal)})",
                "the whole bushing; bushcli finds its planes of symmetry and uses them",
                view,
            )


def _covered_angle(points: Array, axis: Axis) -> float:
    """Angle about the axis that the part covers, degrees, from the largest gap between its points."""
    radial = from_axis(points, axis)
    reference = radial[np.argmax(np.linalg.norm(radial, axis=1))]
    reference = reference / np.linalg.norm(reference)
    angles = np.sort(np.degrees(np.arctan2(radial @ np.cross(axis.direction, reference), radial @ reference)))
    gaps = np.diff(np.append(angles, angles[0] + 360.0))
    return 360.0 - float(gaps.max())
