"""Planes of symmetry of what stands in the open session: verified by moments and by points.

Volume, centre and moments of inertia of every region and boundary must be those of the mirror image, which a single
small feature on one side disturbs; and points strewn over the part must be inside or outside on both sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from geometry.blocks import Array
from geometry.session import model

#: Largest difference of moments, as shares of the part's size; exports round to some ten digits.
SAME = 1e-5
POINTS = 400


def symmetric(
    parts: Mapping[str, Sequence[tuple[int, int]]], component: int, size: float, inside: Iterable[int] = ()
) -> bool:
    """Whether the parts are their own mirror images at the plane where a coordinate vanishes.

    Parameters
    ----------
    parts
        Name -> entities (dimension, tag) of regions and boundaries.
    component
        0, 1 or 2.
    size
        Of the part, mm.
    inside
        Solids in which points are looked for.
    """
    return all(_balanced(entities, component, size) for entities in parts.values()) and _mirrored_points(
        list(inside), component
    )


def moments(entities: Sequence[tuple[int, int]]) -> tuple[float, Array, Array]:
    """Measure (mm^d), centre (mm) and second moments about the origin (mm^(d+2)) of entities of one dimension."""
    occ = model().occ
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for dimension, tag in entities:
        m = occ.getMass(dimension, tag)
        c = np.array(occ.getCenterOfMass(dimension, tag))
        inertia = np.array(occ.getMatrixOfInertia(dimension, tag)).reshape(3, 3)
        # Of the inertia tensor about the centre: the moments x_i x_j are half its trace less itself.
        second += 0.5 * np.trace(inertia) * np.eye(3) - inertia + m * np.outer(c, c)
        mass, first = mass + m, first + m * c
    return mass, first / mass if mass else first, second


def _balanced(entities: Sequence[tuple[int, int]], component: int, size: float) -> bool:
    mass, centre, second = moments(entities)
    if not mass:
        return True
    mixed = np.delete(second[component], component)
    return bool(abs(centre[component]) < SAME * size and np.all(np.abs(mixed) < SAME * mass * size**2))


def _mirrored_points(solids: Sequence[int], component: int) -> bool:
    if not solids:
        return True
    boxes = np.array([model().getBoundingBox(3, tag) for tag in solids])
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    points = np.random.default_rng(1).uniform(low, high, (POINTS, 3))
    image = points.copy()
    image[:, component] *= -1.0
    for one, other in zip(points, image, strict=True):
        counts = [sum(model().isInside(3, tag, list(p)) for tag in solids) for p in (one, other)]
        if counts[0] != counts[1]:
            return False
    return True
