"""Areas of facets and volumes of cells of a mesh, with the curved sides of second-order ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array

Ints = NDArray[np.int64]
#: Facets of a tetrahedron of Gmsh with 10 nodes: corners, then the middles of the sides after each.
TETRAHEDRON = ((0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 9, 7), (1, 2, 3, 5, 8, 9), (0, 3, 2, 7, 8, 6))
#: Points (u, v) and weights of a rule of degree 4 on a triangle (Dunavant 1985, doi:10.1002/nme.1620210612).
_A, _B = 0.445948490915965, 0.091576213509771
_POINTS = np.array(
    [(_A, _A), (1 - 2 * _A, _A), (_A, 1 - 2 * _A), (_B, _B), (1 - 2 * _B, _B), (_B, 1 - 2 * _B)]
)
_WEIGHTS = 0.5 * np.repeat([0.223381589678011, 0.109951743655322], 3)


def volume(points: Array, cells: Ints) -> float:
    """Return the volume of tetrahedra or hexahedra, mm^3; hexahedra with flat sides.

    Parameters
    ----------
    points : Array
        Coordinates of the nodes, shape (n, 3), mm.
    cells : array of int
        Nodes of each cell, shape (m, 4), (m, 8) or (m, 10).
    """
    if cells.shape[1] == 10:
        # Gauss: a third of the flux of x through the sides of each cell.
        parts = []
        for facet in TETRAHEDRON:
            parts.append(_flux(points, cells[:, list(facet)]))
        return float(np.abs(np.sum(parts, axis=0)).sum())
    if cells.shape[1] == 4:
        corners = points[cells]
        a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
        return float(np.abs(np.einsum("ij,ij->i", np.cross(a, b), c)).sum() / 6)
    # A hexahedron is five tetrahedra.
    tetrahedra = ((0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6))
    return sum(volume(points, cells[:, list(part)]) for part in tetrahedra)


def flux(points: Array, facets: Ints) -> float:
    """Return a third of the flux of the position through facets, mm^3: the volume that closed facets enclose.

    Parameters
    ----------
    points : Array
        Coordinates of the nodes, shape (n, 3), mm.
    facets : array of int
        Nodes of each facet, shape (m, 6), in an order that gives normals outward.
    """
    return float(_flux(points, facets).sum())


def _flux(points: Array, facets: Ints) -> Array:
    x, normal = _surface(points, facets)
    return np.asarray(np.einsum("mqi,mqi,q->m", x, normal, _WEIGHTS)) / 3


def area(points: Array, facets: Ints) -> float:
    """Return the area of facets, mm^2; quadrilaterals as two flat triangles.

    Parameters
    ----------
    points : Array
        Coordinates of the nodes, shape (n, 3), mm.
    facets : array of int
        Nodes of each facet, shape (m, 3), (m, 4) or (m, 6).
    """
    if facets.shape[1] == 6:
        _, normal = _surface(points, facets)
        return float((np.linalg.norm(normal, axis=2) @ _WEIGHTS).sum())
    t = triangles(points, facets)
    return float(0.5 * np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum())


def triangles(points: Array, facets: Ints) -> Array:
    """Return the corners of facets, shape (k, 3, 3), mm; quadrilaterals as two triangles.

    Parameters
    ----------
    points : Array
        Coordinates of the nodes, shape (n, 3), mm.
    facets : array of int
        Nodes of each facet, shape (m, 3), (m, 4) or (m, 6).
    """
    if facets.shape[1] in (3, 6):
        return np.asarray(points[facets[:, :3]])
    return np.concatenate([points[facets[:, [0, 1, 2]]], points[facets[:, [0, 2, 3]]]])


def _surface(points: Array, facets: Ints) -> tuple[Array, Array]:
    """Positions and normals (not of unit length), (m, 6, 3) each, of facets of six nodes at the rule's points."""
    u, v = _POINTS.T
    w = 1.0 - u - v
    zero = np.zeros_like(u)
    shape = np.stack(
        [w * (2 * w - 1), u * (2 * u - 1), v * (2 * v - 1), 4 * w * u, 4 * u * v, 4 * v * w], axis=1
    )
    by_u = np.stack([1 - 4 * w, 4 * u - 1, zero, 4 * (w - u), 4 * v, -4 * v], axis=1)
    by_v = np.stack([1 - 4 * w, zero, 4 * v - 1, -4 * u, 4 * u, 4 * (w - v)], axis=1)
    nodes = points[facets]
    x, a, b = (np.einsum("qk,mki->mqi", functions, nodes) for functions in (shape, by_u, by_v))
    return x, np.cross(a, b)
