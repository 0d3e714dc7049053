"""Sizes of elements: uniform inside, small at the edges of bonds, where stresses are singular."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from geometry.session import model, options


@dataclass(frozen=True)
class Sizes:
    """Lengths of elements, mm.

    Attributes
    ----------
    inside
        Length away from all edges.
    edge
        Length at the edges of bonds.
    growth
        Growth of the length per distance from an edge.
    per_circle
        Elements on a full circle of a curved entity.
    near : mapping
        Boundary entity -> length at it, where two faces are near to each other.
    """

    inside: float
    edge: float
    growth: float
    per_circle: float
    near: Mapping[int, float]


def grade(dimension: int, edges: Sequence[int], sizes: Sizes) -> None:
    """Set the sizes of the open session's mesh.

    Parameters
    ----------
    dimension
        Dimension of the mesh, 2 or 3.
    edges
        Points (2) or curves (3) where bonds end.
    sizes
        Sizes to be set.
    """
    field = model().mesh.field
    fields = []
    kind = "PointsList" if dimension == 2 else "CurvesList"
    if edges:
        fields.append(_around(kind, edges, sizes.edge, sizes))
    for length in sorted(set(sizes.near.values())):
        tags = [tag for tag, size in sizes.near.items() if size == length]
        fields.append(_around("CurvesList" if dimension == 2 else "SurfacesList", tags, length, sizes))
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", fields)
    field.setAsBackgroundMesh(smallest)
    option = options().setNumber
    option("Mesh.MeshSizeMax", sizes.inside)
    option("Mesh.MeshSizeMin", 0.2 * sizes.edge)
    option("Mesh.MeshSizeFromPoints", 0)
    option("Mesh.MeshSizeExtendFromBoundary", 1)
    option("Mesh.MeshSizeFromCurvature", sizes.per_circle)
    option("Mesh.Algorithm", 6)
    option("Mesh.RandomSeed", 1)


def _around(kind: str, entities: Sequence[int], length: float, sizes: Sizes) -> int:
    field = model().mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, kind, list(entities))
    field.setNumber(distance, "Sampling", 60)
    threshold = field.add("Threshold")
    field.setNumber(threshold, "InField", distance)
    field.setNumber(threshold, "SizeMin", length)
    field.setNumber(threshold, "SizeMax", sizes.inside)
    field.setNumber(threshold, "DistMin", 0.0)
    field.setNumber(threshold, "DistMax", max((sizes.inside - length) / sizes.growth, 1e-6 * sizes.inside))
    return int(threshold)
