"""Estimate of the number of cells of a free mesh from its sizes alone, to refuse a mesh before the mesher starts.

The number of cells is the integral of their density, 1 over the volume of a cell of the local size h. Away from all
fine entities, h is the size of the interior; from a fine point, curve or face it grows in proportion to the distance
until it reaches that size (`geometry.grading`). The integrals are taken as if fine entities were far from each other.
Compared with meshes of the references, the number is right within a factor of two, and four times too large for a
section that is meshed by one block (tests/unit/test_estimate.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

#: Area of a triangle and volume of a tetrahedron over the square and the cube of the prescribed size: a regular
#: triangle of that side has 0.433, a regular tetrahedron 0.118, of which Gmsh's, slivers among them, have half
#: (measured).
TRIANGLE, TETRAHEDRON = 0.43, 0.055
#: Angle of the body at an edge or a corner, rad.
CORNER = 0.5 * math.pi


@dataclass(frozen=True)
class Fine:
    """Entities with smaller elements than the interior.

    Attributes
    ----------
    dimension : int
        0 for points, 1 for curves, 2 for faces.
    measure : float
        Number, length (mm) or area (mm^2).
    size : float
        Length of the elements there, mm.
    """

    dimension: int
    measure: float
    size: float


def triangles(area: float, inside: float, growth: float, fine: Iterable[Fine]) -> float:
    """Number of triangles on an area (mm^2) with points and curves that are finer.

    Parameters
    ----------
    area : float
        mm^2.
    inside, growth : float
        Length of the elements away from fine entities (mm); growth of the length per distance from them.
    fine : iterable of Fine
    """
    total = area / (TRIANGLE * inside**2)
    for entity in fine:
        e, g = min(entity.size, inside), growth
        if entity.dimension == 0:
            # Integral of d / (e + g d)^2 up to the distance where the size is that of the interior.
            total += entity.measure * CORNER * (math.log(inside / e) - 1.0 + e / inside) / g**2 / TRIANGLE
        else:
            total += entity.measure * (1.0 / e - 1.0 / inside) / g / TRIANGLE
    return total


def tetrahedra(volume: float, inside: float, growth: float, fine: Iterable[Fine]) -> float:
    """Number of tetrahedra in a volume (mm^3) with curves and faces that are finer.

    Parameters
    ----------
    volume : float
        mm^3.
    inside, growth : float
        Length of the elements away from fine entities (mm); growth of the length per distance from them.
    fine : iterable of Fine
    """
    total = volume / (TETRAHEDRON * inside**3)
    for entity in fine:
        e, g = min(entity.size, inside), growth
        if entity.dimension == 1:
            # Integral of d / (e + g d)^3.
            total += entity.measure * CORNER * 0.5 / e * (1.0 - e / inside) ** 2 / g**2 / TETRAHEDRON
        else:
            total += entity.measure * 0.5 * (1.0 / e**2 - 1.0 / inside**2) / g / TETRAHEDRON
    return total
