"""Faces in space -> polygons in the plane of the picture, far ones first.

A parallel projection and the painter's algorithm. Faces are split before they are sorted, so that neither the
order nor the colour shows how coarse the elements are. This module does not depend on Matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from bushcli.report.document import Array
from cases.stretches import Surface

_Value = TypeVar("_Value", bound=np.generic)

# Edges at which the surface bends by more than this are drawn as outlines.
_CREASE = np.cos(np.radians(35.0))
# Sector in which a body of revolution is drawn, and the step of its meridians; the open quarter faces the viewer.
_SECTOR, _MERIDIANS = 270.0, 15.0


@dataclass(frozen=True)
class Projection:
    """A parallel projection by three orthogonal unit vectors: to the right, up, and towards the eye."""

    right: Array
    up: Array
    towards: Array

    def project(self, points: Array) -> Array:
        """Project points (..., 3), mm, into the plane of the picture (..., 2), mm."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)

    def depth(self, points: Array) -> Array:
        """Return the distance of points (..., 3) towards the eye (...), mm; larger is nearer."""
        return np.asarray(points @ self.towards)


class Layer(NamedTuple):
    """Polygons that are painted alike; those of larger depth are painted later."""

    polygons: Array  # (n, 3 or 4, 3), mm
    fill: Array  # (n, 4), red, green, blue and opacity, 0 to 1
    ink: Array  # (n, 4), of the lines around them
    depth: Array  # (n,), mm
    width: float  # of the lines, points


def line_layer(segments: Array, ink: Sequence[float], depth: Array, width: float) -> Layer:
    """Return segments (n, 2, 3), mm, as polygons without area, in one ink (4,)."""
    inks = np.tile(ink, (len(segments), 1))
    return Layer(segments[:, [0, 1, 1, 0]], np.zeros_like(inks), inks, depth, width)


SECTION = Projection(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0]))


def view_from(direction: Array) -> Projection:
    """Return the view from a direction, with z upwards."""
    towards = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return Projection(right, np.cross(towards, right), towards)


def cut_view(reference: Array) -> Projection:
    """Return a view of the cut faces: a model on one side of x = 0 or y = 0 was cut there.

    The view is always from above, because the free end of the rubber is there.
    """
    low, high = reference.reshape(-1, 3).min(axis=0), reference.reshape(-1, 3).max(axis=0)
    small = 1e-3 * (high - low)
    # A model that is not cut is viewed from -y, with x to the right.
    direction = np.array([0.3, -1.0, 0.65])
    for axis in (0, 1):
        if low[axis] > -small[axis]:
            direction[axis] = -(1.0 if axis else 0.75)
        elif high[axis] < small[axis]:
            direction[axis] = 1.0 if axis else 0.75
    return view_from(direction)


# The view into the open quarter of a body of revolution, from above.
_OPEN = np.radians((_SECTOR + 360.0) / 2.0)
OPEN_QUARTER = view_from(np.array([np.cos(_OPEN), np.sin(_OPEN), 0.75]))


def is_section(surface: Surface) -> bool:
    """Whether the faces are those of a half-plane."""
    return bool(np.allclose(surface.reference[..., 1], 0.0))


def is_twisted(surface: Surface) -> bool:
    """Whether the faces of a half-plane have rotated out of it."""
    return bool(np.abs(surface.deformed[..., 1]).max() > 1e-9 * np.abs(surface.reference).max())


def lattice(surface: Surface, points: Array, pieces: int) -> Array:
    """Return points on a grid over each face, shape (n, pieces + 1, pieces + 1, 3), of its corners (n, 4, 3) in mm.

    Between its corners a face of a bushing follows the circle on which the corners lie; the displacements from the
    reference positions to ``points`` are interpolated bilinearly.
    """
    reference = surface.reference
    radius = np.hypot(reference[..., 0], reference[..., 1])
    if radius.min() > 1e-6 * radius.max():
        angle = np.arctan2(reference[..., 1], reference[..., 0])
        first_angle = angle[:, :1]
        # The corners of a face must have similar angles also where the angle jumps from pi to -pi.
        angle = first_angle + (angle - first_angle + np.pi) % (2 * np.pi) - np.pi
        r, a, z = np.moveaxis(bilinear(np.stack([radius, angle, reference[..., 2]], axis=-1), pieces), -1, 0)
        base = np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1)
    else:
        base = bilinear(reference, pieces)
    return np.asarray(base + bilinear(points - reference, pieces))


def bilinear(corners: Array, pieces: int) -> Array:
    """Interpolate values at the corners of faces, (n, 4, k), bilinearly on a grid, (n, pieces + 1, pieces + 1, k)."""
    t = np.linspace(0.0, 1.0, pieces + 1)
    s, r = (grid[..., None] for grid in np.meshgrid(t, t, indexing="ij"))
    a, b, c, d = (corners[:, None, None, i] for i in range(4))
    return np.asarray((1 - s) * ((1 - r) * a + r * b) + s * ((1 - r) * d + r * c))


def cells(grid: Array) -> Array:
    """Return the small faces of a grid: (n, p + 1, p + 1, k) -> (n * p**2, 4, k)."""
    corners = (grid[:, :-1, :-1], grid[:, :-1, 1:], grid[:, 1:, 1:], grid[:, 1:, :-1])
    return np.stack(corners, axis=3).reshape(-1, 4, grid.shape[-1])


def sides(grid: NDArray[_Value]) -> NDArray[_Value]:
    """Return what is along the sides of faces, (n, p, p, ...) -> (4 n, p, ...), in the order of `face_edges`."""
    parts = (grid[:, 0], grid[:, :, -1], grid[:, -1, ::-1], grid[:, ::-1, 0])
    return np.stack(parts, axis=1).reshape(-1, *grid.shape[2:])


def segments(lines: Array) -> Array:
    """Return the segments (n * p, 2, 3) of polygonal lines (n, p + 1, 3)."""
    return np.stack([lines[:, :-1], lines[:, 1:]], axis=2).reshape(-1, 2, 3)


def dashes(lines: Array, length: float) -> Array:
    """Cut lines (n, p + 1, 3) into dashes (m, 2, 3) of about this length in mm, with gaps of the same length."""
    parts = []
    for line in lines:
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        count = 2 * max(1, round(along[-1] / (2 * length))) + 1
        at = np.linspace(0.0, along[-1], count + 1)
        points = np.stack([np.interp(at, along, line[:, k]) for k in range(3)], axis=-1)
        parts.append(np.stack([points[:-1:2], points[1::2]], axis=1))
    return np.concatenate(parts) if parts else np.empty((0, 2, 3))


def once(lines: Array) -> Array:
    """Return the lines (n, p + 1, 3) without duplicates; a line and its reverse are duplicates."""
    middle = np.round(lines.mean(axis=1), 5)
    return np.asarray(lines[np.unique(middle, axis=0, return_index=True)[1]])


def face_edges(faces: Array) -> Array:
    """Return the sides of faces (n, 4, 3) as segments (4 n, 2, 3), face by face."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2, 3)


def outline(surface: Surface) -> NDArray[np.bool_]:
    """Return whether each of `face_edges` bounds the body, is a sharp bend, or separates rubber from metal, (4 n,)."""
    group, count = _same_sides(surface)
    normal = normals(surface.reference)
    order = np.argsort(group, kind="stable")
    end = np.cumsum(count)
    face, other = order[end - count] // 4, order[end - 1] // 4
    sharp = np.abs(np.einsum("ij,ij->i", normal[face], normal[other])) < _CREASE
    parts = surface.rubber[face] != surface.rubber[other]
    return np.asarray(((count == 1) | sharp | parts)[group])


def _same_sides(surface: Surface) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return the number of each of `face_edges`, (4 n,), equal for equal ones, and how many have each number."""
    middle = np.round(face_edges(surface.reference).mean(axis=1), 5)
    _, group, count = np.unique(middle, axis=0, return_inverse=True, return_counts=True)
    return group.ravel(), count


def body_of_revolution(surface: Surface) -> Surface:
    """Return the body of revolution of a half-plane with a quarter left open: its outside and the two cut faces."""
    group, count = _same_sides(surface)
    # Sides that belong to one face only bound the half-plane.
    face, side = np.nonzero((count[group] == 1).reshape(-1, 4))
    ends = np.stack([side, (side + 1) % 4], axis=1)
    angles = np.radians(np.arange(0.0, _SECTOR + _MERIDIANS / 2, _MERIDIANS))

    def sweep(points: Array) -> Array:
        lines = points[face[:, None], ends]
        rings = np.stack([_rotate(lines, angle) for angle in angles])
        walls = np.stack([rings[:-1, :, 0], rings[:-1, :, 1], rings[1:, :, 1], rings[1:, :, 0]], axis=2)
        cuts = [_rotate(points, angles[0]), _rotate(points, angles[-1])]
        return np.concatenate([walls.reshape(-1, 4, 3), *cuts])

    pieces, values = len(angles) - 1, surface.stretch[face[:, None], ends]
    walls = np.tile(values[:, [0, 1, 1, 0]], (pieces, 1))
    stretch = np.concatenate([walls, surface.stretch, surface.stretch])
    rubber = np.concatenate([np.tile(surface.rubber[face], pieces), surface.rubber, surface.rubber])
    return Surface(sweep(surface.reference), sweep(surface.deformed), stretch, rubber, surface.displacement)


def normals(pieces: Array) -> Array:
    """Unit normals of faces (n, 3 or 4, 3), outwards where their corners are counter-clockwise, (n, 3)."""
    normal = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, -1] - pieces[:, 1])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30))


def shade(pieces: Array, view: Projection, contrast: float = 0.16) -> Array:
    """Return the brightness (n,) of faces (n, 3 or 4, 3), from 0 to 1, in a light from the upper left.

    The contrast is low where the colour of a face shows a value.
    """
    light = view.towards + 0.7 * view.up - 0.5 * view.right
    return np.asarray(1.0 - contrast * (1.0 - np.abs(normals(pieces) @ light) / np.linalg.norm(light)))


# What a plane makes of a triangle or a tetrahedron, by the number of corners below it: the corners of each part lie on
# the edges between two corners, counted upwards, or are corners.
_Shapes: TypeAlias = dict[int, list[tuple[tuple[int, int], ...]]]
_ABOVE: _Shapes = {
    0: [((0, 0), (1, 1), (2, 2))],
    1: [((1, 1), (2, 2), (0, 1)), ((2, 2), (0, 2), (0, 1))],
    2: [((2, 2), (0, 2), (1, 2))],
}
_ACROSS: dict[int, _Shapes] = {
    3: {1: [((0, 1), (0, 2))], 2: [((0, 2), (1, 2))]},
    4: {
        1: [((0, 1), (0, 2), (0, 3), (0, 3))],
        2: [((0, 2), (0, 3), (1, 3), (1, 2))],
        3: [((0, 3), (1, 3), (2, 3), (2, 3))],
    },
}


def cut(
    simplices: Array, normal: Array, distance: float = 0.0, *, above: bool
) -> tuple[Array, NDArray[np.int_]]:
    """Cut triangles (n, 3, 3) or tetrahedra (n, 4, 3), mm, by a plane with this normal at this distance in mm.

    Return the parts, and which simplex each is of: of triangles those above the plane, (m, 3, 3); otherwise where the
    plane cuts triangles, (m, 2, 3), or tetrahedra, (m, 4, 3), with the last corner of a triangle repeated.
    """
    height = simplices @ normal - distance
    order = np.argsort(height, axis=1, kind="stable")
    corners = np.take_along_axis(simplices, order[..., None], axis=1)
    h = np.take_along_axis(height, order, axis=1)
    below = (h < 0.0).sum(axis=1)
    parts, owner = [], []
    for count, shapes in (_ABOVE if above else _ACROSS[simplices.shape[1]]).items():
        at = np.flatnonzero(below == count)
        for shape in shapes:
            i, j = np.array(shape).T
            low, high = h[at][:, i], h[at][:, j]
            share = np.where(i == j, 0.0, low / np.where(low == high, 1.0, low - high))[..., None]
            parts.append(corners[at][:, i] + share * (corners[at][:, j] - corners[at][:, i]))
            owner.append(at)
    return np.concatenate(parts), np.concatenate(owner)


def _rotate(points: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
