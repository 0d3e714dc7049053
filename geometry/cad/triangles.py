"""Coarse triangles of the faces in the open session, for pictures."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array
from geometry.session import model, options
from geometry.view import View

#: Longest side as a share of the part's size.
SIDE = 1 / 25


def view_of(labels: Mapping[int, str], bodies: Mapping[int, str] | None = None) -> View | None:
    """Return triangles of faces with their interpretation; None if not even these can be meshed.

    Parameters
    ----------
    labels : mapping of int to str
        Face -> name.
    bodies : mapping of int to str or None
        Solid -> name, for a section through an assembly.
    """
    bodies = bodies or {}
    names = tuple(dict.fromkeys([*labels.values(), *bodies.values()]))
    box = np.array(model().getBoundingBox(-1, -1)).reshape(2, 3)
    options().setNumber("Mesh.MeshSizeMax", SIDE * float(np.max(box[1] - box[0])))
    options().setNumber("Mesh.MeshSizeFromCurvature", 24)
    # Small holes are round, but the faces around them need no small triangles: 90,000 in place of 420,000 beside 200.
    options().setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    # A picture is not worth an error: the faces that can be meshed are shown.
    with contextlib.suppress(Exception):
        model().mesh.generate(2)
    tags, coordinates, _ = model().mesh.getNodes()
    if not len(tags):
        return None
    number = np.zeros(int(tags.max()) + 1, dtype=int)
    number[tags] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)

    def collect(named_faces: Iterable[tuple[int, str]]) -> tuple[Array, NDArray[np.int_]]:
        triangles, label = [np.zeros((0, 3, 3))], [np.zeros(0, dtype=int)]
        for face, name in named_faces:
            nodes = model().mesh.getElementsByType(2, face)[1].reshape(-1, 3).astype(int)
            triangles.append(points[number[nodes]])
            label.append(np.full(len(nodes), names.index(name)))
        return np.concatenate(triangles), np.concatenate(label)

    sides = [
        (int(face), name)
        for solid, name in bodies.items()
        for _, face in model().getBoundary([(3, solid)], oriented=False)
    ]
    shown, closed = collect(labels.items()), collect(sides)
    model().mesh.clear()
    return View(*shown, names, solids=closed[0], solid_label=closed[1])
