"""Planes of symmetry of the part in the open session, verified by moments and by points.

Measure, centre and moments of inertia of every region and boundary must be those of the mirror image, which a single
small feature on one side changes; and random points must be inside the part if and only if their images are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from geometry.blocks import Array
from geometry.session import model

#: Largest difference of moments, as a share of the part's measure and size; exports round to some ten digits.
SAME = 1e-5
POINTS = 300


def moments(entities: Sequence[tuple[int, int]]) -> tuple[float, Array, Array]:
    """Measure (mm^d), centre (mm) and second moments about the centre (mm^(d+2)) of entities of one dimension."""
    occ = model().occ
    masses = np.array([occ.getMass(d, t) for d, t in entities])
    centres = np.array([occ.getCenterOfMass(d, t) for d, t in entities]).reshape(-1, 3)
    mass = float(masses.sum())
    if mass == 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    centre = masses @ centres / mass
    second = np.zeros((3, 3))
    for (d, t), m, c in zip(entities, masses, centres - centre, strict=True):
        inertia = np.array(occ.getMatrixOfInertia(d, t)).reshape(3, 3)
        # The moments of x_i x_j are half the trace of the inertia tensor minus the tensor itself.
        second += 0.5 * np.trace(inertia) * np.eye(3) - inertia + m * np.outer(c, c)
    return mass, centre, second


def is_symmetric(
    parts: Mapping[str, Sequence[tuple[int, int]]], origin: Array, rows: Array, component: int, size: float
) -> bool:
    """Whether the moments of all parts are those of their mirror images.

    Parameters
    ----------
    parts : Mapping[str, Sequence[tuple[int, int]]]
        Name -> entities (dimension, tag) of regions and boundaries.
    origin : Array
        A point of the plane, shape (3,), mm.
    rows : Array
        Three directions, shape (3, 3), of which that of number `component` is normal to the plane.
    component : int
        Index of the direction that is mirrored.
    size : float
        Size of the part, mm.
    """
    normal, others = rows[component], np.delete(rows, component, axis=0)
    for entities in parts.values():
        mass, centre, second = moments(entities)
        offset = float((centre - origin) @ normal)
        second = second + mass * np.outer(centre - origin, centre - origin)
        mixed = np.abs(others @ second @ normal)
        if abs(offset) > SAME * size or np.any(mixed > SAME * mass * size**2):
            return False
    return True


class SampledSolids:
    """Random points of a box around solids, and which of them are in a solid.

    Parameters
    ----------
    solids : sequence of int
        Their tags in the open session.
    """

    def __init__(self, solids: Sequence[int]) -> None:
        self._solids = solids
        boxes = np.array([model().getBoundingBox(3, tag) for tag in solids])
        low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
        self._points = np.random.default_rng(1).uniform(low, high, (POINTS, 3))

    @cached_property
    def _which_inside(self) -> list[bool]:
        return [self._is_inside(point) for point in self._points]

    def _is_inside(self, point: Array) -> bool:
        return any(model().isInside(3, tag, point.tolist()) for tag in self._solids)

    def is_symmetric(self, origin: Array, normal: Array) -> bool:
        """Whether points are in a solid if and only if their mirror images are.

        Parameters
        ----------
        origin : Array
            A point of the plane, shape (3,), mm.
        normal : Array
            Unit vector normal to the plane, shape (3,).
        """
        images = self._points - 2.0 * np.outer((self._points - origin) @ normal, normal)
        return all(
            is_inside == self._is_inside(image)
            for is_inside, image in zip(self._which_inside, images, strict=True)
        )
