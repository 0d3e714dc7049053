"""The axis of a part: the line about which most of its curved area is a surface of revolution.

The normals of a surface of revolution all meet its axis: in Pluecker coordinates this is one linear equation for each
point, whose solutions are the axis (and further lines for cylinders, spheres and planes).

References
----------
Pottmann and Wallner (2001), Computational Line Geometry, Springer, chapter 3, doi:10.1007/978-3-642-04018-4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry.blocks import Array
from geometry.cad.sampling import Sampled

#: Largest sine between a normal and the meridian plane at which a face counts as coaxial; exports have ten digits.
COAXIAL = 1e-3
#: Axes closer than this (sine; distance as a share of the part's size) count as one.
SAME_AXIS = 1e-3


@dataclass(frozen=True)
class Axis:
    """A line: a point on it (mm) and its direction."""

    point: Array
    direction: Array


def find_axis(faces: Sequence[Sampled], size: float, centre: Array) -> Axis | None:
    """Return the axis shared by most of the curved area; None if no face is a surface of revolution about one line.

    Spheres alone have none: the axis is then the normal of a plane face, through the centre of gravity (mm).

    Parameters
    ----------
    faces : Sequence[Sampled]
        Sampled faces of the part.
    size : float
        Largest extent of the part, mm.
    centre : Array
        Centre of gravity, shape (3,), mm.
    """
    candidates = [axis for face in faces if (axis := axis_of(face, size)) is not None]
    if not candidates:
        flat = [face for face in faces if face.kind == "Plane" and len(face.points)]
        candidates = [Axis(centre, face.normals[0]) for face in flat]
    curved = [face for face in faces if face.kind != "Plane"]
    shares = [sum(f.area for f in curved if is_coaxial(f, axis, size)) for axis in candidates]
    if not candidates or max(shares) == 0.0:
        return None
    best = candidates[int(np.argmax(shares))]
    direction = best.direction * np.sign(best.direction[np.argmax(np.abs(best.direction))])
    # A direction that is a coordinate axis except for rounding is replaced by that axis.
    direction = np.where(np.abs(direction) < 1e-7, 0.0, direction)
    return Axis(best.point, direction / np.linalg.norm(direction))


def axis_of(face: Sampled, size: float) -> Axis | None:
    """Return the line about which a face is a surface of revolution; None for planes, spheres and all other faces.

    Parameters
    ----------
    face : Sampled
        Sampled face.
    size : float
        Largest extent of the part, mm.
    """
    if len(face.points) < 5 or face.kind in ("Plane", "Sphere"):
        return None
    p, n = face.points / size, face.normals
    centre = p.mean(axis=0)
    p = p - centre
    _, spread, rows = np.linalg.svd(n, full_matrices=True)
    if spread[-1] < COAXIAL * spread[0] and len(spread) == 3:
        direction = rows[-1]
    else:
        _, values, lines = np.linalg.svd(np.column_stack([np.cross(p, n), n]), full_matrices=True)
        if values[-1] > COAXIAL * values[0] or np.linalg.norm(lines[-1][:3]) < 1e-3:
            return None
        direction = lines[-1][:3] / np.linalg.norm(lines[-1][:3])
    # n . (d x (p - a)) = 0, linear in a: the point of the axis nearest to the face's centre.
    matrix = np.vstack([np.cross(n, direction), direction])
    right = np.append(np.einsum("ij,ij->i", n, np.cross(direction, p)), 0.0)
    point, *_ = np.linalg.lstsq(matrix, right, rcond=None)
    axis = Axis((point + centre) * size, direction)
    return axis if is_coaxial(face, axis, size) else None


def is_coaxial(face: Sampled, axis: Axis, size: float) -> bool:
    """Whether a face is a surface of revolution about an axis: its normals lie in meridian planes.

    Parameters
    ----------
    face : Sampled
        Sampled face.
    axis : Axis
        Axis of the bushing.
    size : float
        Largest extent of the part, mm.
    """
    if len(face.points) < 2:
        return False
    radial = from_axis(face.points, axis)
    distance = np.linalg.norm(radial, axis=1)
    if distance.max() < 1e-9 * size:
        return False
    tangents = np.cross(axis.direction, radial)
    return bool(np.abs(np.einsum("ij,ij->i", tangents, face.normals)).max() < COAXIAL * distance.max())


def own_line(face: Sampled, axis: Axis, size: float) -> Axis | None:
    """Return the line, parallel to the axis, about which a face is a surface of revolution: the axis itself if it is.

    Parameters
    ----------
    face : Sampled
        Sampled face.
    axis : Axis
        Axis of the bushing.
    size : float
        Largest extent of the part, mm.
    """
    if is_coaxial(face, axis, size):
        return axis
    line = axis_of(face, size)
    if line is None or np.linalg.norm(np.cross(line.direction, axis.direction)) > SAME_AXIS:
        return None
    return Axis(line.point, axis.direction)


def turned_about(faces: Sequence[Sampled], axis: Axis, size: float) -> Array:
    """Return a point of the line about which the inner sleeve turns, mm: its own axis, if that is parallel to the axis.

    A bore may be eccentric in its housing, whose faces then have most of the curved area.

    Parameters
    ----------
    faces : Sequence[Sampled]
        Sampled faces of the inner bond.
    axis : Axis
        Axis of the bushing.
    size : float
        Largest extent of the part, mm.
    """
    for face in sorted(faces, key=lambda face: -face.area):
        line = own_line(face, axis, size)
        if line is not None:
            return line.point
    return axis.point


def distance_between(point: Array, other: Array, direction: Array, size: float) -> float:
    """Return the distance of two parallel lines, mm; 0 if it is less than what exports round.

    Parameters
    ----------
    point, other : Array
        A point of each, shape (3,), mm.
    direction : Array
        Of both, shape (3,), a unit vector.
    size : float
        Largest extent of the part, mm.
    """
    distance = float(np.linalg.norm(from_axis(other[None, :], Axis(point, direction))))
    return distance if distance > SAME_AXIS * size else 0.0


def from_axis(points: Array, axis: Axis) -> Array:
    """Vectors from the axis to points, normal to it, shape (n, 3), mm.

    Parameters
    ----------
    points : Array
        Coordinates, shape (n, 3), mm.
    axis : Axis
        Axis of the bushing.
    """
    vectors = points - axis.point
    return np.asarray(vectors - np.outer(vectors @ axis.direction, axis.direction))
