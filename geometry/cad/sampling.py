"""Points and normals on faces of the open session, from which axis, bonds, symmetry and thickness are determined.

References
----------
Ma, Bae and Choi (2012), 3D medial axis point approximation using nearest neighbors and the normal field, Vis. Comput.
28:7-19, doi:10.1007/s00371-011-0594-7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from geometry.blocks import Array
from geometry.session import model

#: Points in each direction of a face's parameters; more where few of them are on the face.
GRIDS = (7, 25, 101)
ENOUGH = 6


@dataclass(frozen=True)
class Sampled:
    """Points on a face (mm) with unit normals out of its solid, each shape (n, 3), and its area (mm^2)."""

    tag: int
    kind: str
    points: Array
    normals: Array
    area: float


def sample(face: int, size: float, area: float | None = None) -> Sampled:
    """Sample a face.

    Parameters
    ----------
    face
        Tag of the face.
    size
        Size of the part, mm.
    area
        Area, mm^2; None for OpenCASCADE's.
    """
    low, high = (np.array(bound) for bound in model().getParametrizationBounds(2, face))
    parameters = np.zeros((0, 2))
    for count in GRIDS:
        shares = (np.arange(count) + 0.5) / count
        grid = np.stack(np.meshgrid(*[a + shares * (b - a) for a, b in zip(low, high, strict=True)]), axis=-1)
        candidates = grid.reshape(-1, 2)
        inside = [bool(model().isInside(2, face, uv.tolist(), parametric=True)) for uv in candidates]
        parameters = candidates[np.array(inside)]
        if len(parameters) >= ENOUGH:
            break
    flat = parameters.ravel().tolist()
    points = np.array(model().getValue(2, face, flat)).reshape(-1, 3)
    normals = np.array(model().getNormal(face, flat)).reshape(-1, 3)
    solids = model().getAdjacencies(2, face)[0]
    if len(points) and len(solids):
        step = 1e-4 * size
        ahead, behind = ((points[0] + sign * step * normals[0]).tolist() for sign in (1.0, -1.0))
        # Each costs 0.1 s in a solid of 1,500 faces, and most normals point outward already.
        if model().isInside(3, int(solids[0]), ahead) and not model().isInside(3, int(solids[0]), behind):
            normals = -normals
    if area is None:
        area = float(model().occ.getMass(2, face))
    return Sampled(face, str(model().getType(2, face)), points, normals, area)


def extent(faces: Sequence[Sampled], direction: Array) -> tuple[float, float]:
    """Return the least and largest position of faces along a direction (mm), from their edges too.

    Parameters
    ----------
    faces
        Sampled faces, mm, which have no samples on their edges.
    direction
        Unit vector, shape (3,).
    """
    ends = [float(end) for face in faces if len(face.points) for end in face.points @ direction]
    sides = [(2, face.tag) for face in faces]
    for _, curve in model().getBoundary(sides, combined=False, oriented=False):
        low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, curve))
        points = np.array(model().getValue(1, curve, np.linspace(low, high, 9).tolist())).reshape(-1, 3)
        ends += [float(end) for end in points @ direction]
    return min(ends), max(ends)


#: Two faces are opposite where the cosine of their normals is below this.
OPPOSITE = -0.5
#: Share of a face's points that must be near another face for the face to count as narrow.
SHARE = 0.5


def local_thickness(faces: Sequence[Sampled], thickness: float) -> dict[int, float]:
    """Distance to the opposite face (mm), for the faces where it is less than the thickness.

    It is the diameter of the ball that touches a face and the opposite face (Ma, Bae and Choi 2012).

    Parameters
    ----------
    faces : Sequence[Sampled]
        Sampled faces of the part.
    thickness : float
        Distance beyond which faces are not opposite each other, mm.
    """
    points = np.concatenate([face.points for face in faces])
    normals = np.concatenate([face.normals for face in faces])
    narrow = {}
    for face in faces:
        if not len(face.points):
            continue
        vectors = points[None] - face.points[:, None]
        depth = -np.einsum("ijk,ik->ij", vectors, face.normals)
        opposite = (face.normals @ normals.T < OPPOSITE) & (depth > 1e-9 * thickness)
        squares = np.einsum("ijk,ijk->ij", vectors, vectors)
        diameter = np.where(opposite, squares / np.where(opposite, depth, 1.0), np.inf).min(axis=1)
        distance = float(np.quantile(diameter, SHARE, method="lower"))
        if distance < thickness:
            narrow[face.tag] = distance
    return narrow
