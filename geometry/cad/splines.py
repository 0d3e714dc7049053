"""Areas and volumes of parts with spline faces, from a mesh of their surface.

OpenCASCADE integrates over a face with a fixed number of points, which is exact for planes, cylinders and other simple
surfaces. Of a ring whose cylinders were written as B-splines it gave 0.9 % too large a volume. Second-order
triangles, of which 24 lie around a circle, are exact to some 1e-5.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable

import numpy as np

from geometry.blocks import Array
from geometry.cad.measure import area, flux
from geometry.cad.triangles import SIDE
from geometry.raw import Ints
from geometry.session import model, options

SIMPLE = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
#: Gmsh's number of triangles with six nodes.
TRIANGLE6 = 9


def areas_and_volumes(solids: Iterable[int], size: float) -> tuple[dict[int, float], dict[int, float]]:
    """Return areas of faces (mm^2) and volumes of solids (mm^3) where OpenCASCADE's are inexact.

    Parameters
    ----------
    solids : iterable of int
        Solids of the open session.
    size : float
        Largest extent of the part, mm.
    """
    sides = {s: [int(f) for _, f in model().getBoundary([(3, s)], oriented=False)] for s in solids}
    sides = {
        solid: faces
        for solid, faces in sides.items()
        if any(model().getType(2, face) not in SIMPLE for face in faces)
    }
    if not sides:
        return {}, {}
    options().setNumber("Mesh.MeshSizeMax", SIDE * size)
    options().setNumber("Mesh.MeshSizeFromCurvature", 24)
    # A part whose surface cannot be meshed keeps OpenCASCADE's values, and is refused later.
    with contextlib.suppress(Exception):
        model().mesh.generate(2)
        model().mesh.setOrder(2)
        return _integrals(sides, size)
    return {}, {}


def _integrals(sides: dict[int, list[int]], size: float) -> tuple[dict[int, float], dict[int, float]]:
    tags, coordinates, _ = model().mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)
    areas: dict[int, float] = {}
    volumes: dict[int, float] = {}
    for solid, faces in sides.items():
        volumes[solid] = 0.0
        for face in faces:
            nodes = number[model().mesh.getElementsByType(TRIANGLE6, face)[1].reshape(-1, 6).astype(np.int64)]
            areas[face] = area(points, nodes)
            volumes[solid] += _outward(points, nodes, solid, size) * flux(points, nodes)
    model().mesh.clear()
    return areas, volumes


def _outward(points: Array, nodes: Ints, solid: int, size: float) -> float:
    """Return 1 if the order of the nodes of a face gives normals out of the solid, else -1."""
    a, b, c = (points[nodes[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    largest = int(np.argmax(np.linalg.norm(normals, axis=1)))
    # The middle of a second-order triangle from its mid-side nodes, which lie on the face, and its corners.
    middle = (4.0 * points[nodes[largest, 3:]].sum(axis=0) - points[nodes[largest, :3]].sum(axis=0)) / 9.0
    step = 1e-3 * size * normals[largest] / np.linalg.norm(normals[largest])
    return 1.0 if model().isInside(3, solid, (middle - step).tolist()) else -1.0
