"""Straighten second-order tetrahedra that a curved face has folded; Gmsh's own optimiser may end the process."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geometry.blocks import Array
from geometry.raw import TETRAHEDRON10, RawMesh

#: Corners beside each mid-side node, in Gmsh's order.
SIDES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
#: Least determinant over that of the straight element.
LEAST = 0.1
ROUNDS = 10


def straightened(mesh: RawMesh) -> RawMesh:
    """Put the mid-side nodes of folded elements into the middle of their sides."""
    if mesh.kind != TETRAHEDRON10:
        return mesh
    points = mesh.points.copy()
    cells = np.concatenate(list(mesh.cells.values()))
    for _ in range(ROUNDS):
        bad = cells[_folded(points[cells])]
        if not len(bad):
            break
        for node, (a, b) in enumerate(SIDES, start=4):
            points[bad[:, node]] = 0.5 * (points[bad[:, a]] + points[bad[:, b]])
    return replace(mesh, points=points)


def _folded(x: Array) -> Array:
    """Whether the determinant of the chart is too small at a node of an element; x has shape (n, 10, 3)."""
    at = np.vstack([np.eye(4), [[0.5 * (i in side) for i in range(4)] for side in SIDES]])
    slope = np.vstack([-np.ones(3), np.eye(3)])  # of the barycentric coordinates
    derivative = np.zeros((10, 10, 3))
    for k in range(4):
        derivative[:, k] = (4 * at[:, k] - 1)[:, None] * slope[k]
    for k, (i, j) in enumerate(SIDES, start=4):
        derivative[:, k] = 4 * (at[:, i, None] * slope[j] + at[:, j, None] * slope[i])
    curved = np.linalg.det(np.einsum("pki,nkj->npij", derivative, x))
    straight = np.linalg.det(x[:, 1:4] - x[:, :1])
    return np.asarray((curved / straight[:, None]).min(axis=1) < LEAST)
