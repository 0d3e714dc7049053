"""Morphing: the mesh of a structured shape moved to new dimensions, with the same elements.

A node of a structured mesh is a place in a box of elements, which the shape's chart maps to space. The nodes of a mesh
that differs only in dimensions are therefore computed in microseconds, whereas Gmsh and the set-up of everything that
refers to a mesh take as long as a quarter of a march.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable
from typing import Any

import numpy as np
from pydantic import BaseModel

from geometry.blocks import Array, Blocks
from geometry.mesh import NamedMesh
from geometry.shape import Mirrors, Refinement, Shape
from geometry.structured import parameters, positions

# Largest distance of a node from its position on the chart, over the size of the body: several times rounding.
EXACT = 1e-9


def elements_of(
    shape: Shape, dimension: int, mirrors: Mirrors, refinement: Refinement
) -> tuple[Hashable, ...] | None:
    """Return a key that two shapes share if the mesh of one can be moved to the other; None if it never can be moved.

    Parameters
    ----------
    shape : Shape
        A structured shape of `Shape.blocks`; any other gives None.
    dimension : int
        2 for the half-plane, 3 for the solid.
    mirrors : frozenset of str
        Planes at which the solid is cut.
    refinement : Refinement
        Elements in each direction.
    """
    if type(shape).blocks is Shape.blocks or type(shape).generate is not Shape.generate:
        return None
    blocks = shape.blocks(dimension, mirrors, refinement)
    counts = tuple(tuple(interval.elements for interval in axis) for axis in blocks.axes)
    # They tell which blocks are void, and which are metal.
    middles = itertools.product(*([0.5 * (part.start + part.stop) for part in axis] for axis in blocks.axes))
    regions = tuple(blocks.region(np.array(middle)) for middle in middles)
    return type(shape).name, dimension, mirrors, counts, blocks.closed, regions, _words(shape)


def _words(value: Any) -> Hashable:
    """Return all fields of a shape that are not numbers, such as which sleeves exist and how they are held."""
    if isinstance(value, BaseModel):
        return tuple((name, _words(getattr(value, name))) for name in type(value).model_fields)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return None


class Morph:
    """Places of a mesh's nodes in the box of elements, and where they are in another shape.

    Parameters
    ----------
    mesh
        As `geometry.mesh.build` returned it.
    refinement
        Refinement with which it was built.
    """

    def __init__(self, mesh: NamedMesh, refinement: Refinement) -> None:
        self._dimension, self._mirrors, self._refinement = mesh.dimension, mesh.mirrors, refinement
        blocks = self._blocks(mesh.shape)
        ends = [sum(interval.elements for interval in axis) for axis in blocks.axes]
        # Corners, and the middles of sides, faces and elements.
        halves = [np.arange(0.0, end + 0.25, 0.5) for end in ends]
        self._places = np.stack([grid.ravel() for grid in np.meshgrid(*halves, indexing="ij")], axis=-1)
        self._points = self._points_at(blocks, self._places)

    def places(self, points: Array) -> Array | None:
        """Return the places of points of the mesh in its box of elements, (n, d); None if they are not all nodes.

        Parameters
        ----------
        points : shape (n, 3)
            Points of this rank, mm.
        """
        from scipy.spatial import KDTree

        distances, nearest = KDTree(self._points).query(points)
        size = float(np.abs(self._points).max())
        return None if np.any(distances > EXACT * size) else self._places[nearest]

    def points(self, shape: Shape, places: Array) -> Array:
        """Return the positions of places of the box in another shape, (n, 3), mm.

        Parameters
        ----------
        shape
            A shape with the same `elements_of`.
        places : shape (n, d)
            As `places` returned them.
        """
        return self._points_at(self._blocks(shape), places)

    def _blocks(self, shape: Shape) -> Blocks:
        return shape.blocks(self._dimension, self._mirrors, self._refinement)

    def _points_at(self, blocks: Blocks, places: Array) -> Array:
        points = np.zeros((len(places), 3))
        points[:, : self._dimension] = blocks.chart(parameters(places, [positions(a) for a in blocks.axes]))
        return points
