"""Search for points that penetrate other facets, and for the nearest points on these facets.

Facets are sorted along an axis at every state, and all pairs that are near along it are tested (`sweep.h`). The nearest
points of the few pairs that are left are computed anew (`nearest.h`): the distance is a function of the state alone,
and its derivatives are exact.

A point is inside if it lies behind the facet nearest to it, no deeper than `REACH`, and both surfaces face each other.
Surfaces with rubber between them, as in a thin wall or at a sharp edge, do not meet, nor do facets within a fold of the
surface (`cases.contact.folds`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.contact.bodies import Bodies
from cases.contact.folds import folds
from cases.contact.mirrors import MirrorPlane
from cases.contact.surface import MAYBE
from cases.kernels import loops, pointer

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Deepest penetration that is sought, over the breadth of the facets: with a deeper one, the two sides of a bulge on a
# coarse mesh would be taken for a fold. A step of the march that goes deeper is too long.
REACH = 0.5
# Numbers that the loops store for each facet (`surface.h`).
FRAME = 9


@dataclass(frozen=True)
class Inside:
    """Points that penetrate other facets.

    Attributes
    ----------
    facet, point : shape (p,)
        Soft facet, and its quadrature point.
    other : shape (p,)
        Facet that the point penetrates.
    xi : shape (p, a)
        Nearest point on that facet, in its reference coordinates.
    free : shape (p, a, a)
        Columns span the directions in which that point may move; at an edge or a corner there are fewer of them, and
        the other columns are zero.
    r : shape (p, d)
        Vector from there to the point, mm.
    share : shape (p,)
        Share of the contact's energy: one half where the other facet is soft, whose points are tested against this one
        too.
    """

    facet: Ints
    point: Ints
    other: Ints
    xi: Array
    free: Array
    r: Array
    share: Array

    def __len__(self) -> int:
        return len(self.facet)

    @property
    def depth(self) -> Array:
        """Penetration, mm."""
        return np.asarray(np.linalg.norm(self.r, axis=1))


class ContactSearch:
    """Finds points that penetrate other facets.

    Parameters
    ----------
    bodies
        The surfaces.
    """

    def __init__(self, bodies: Bodies) -> None:
        self.bodies = bodies
        self._surface, self._kept = self._make_surface()
        # Shape functions at the points of a facet, (n, q).
        self._shares = bodies.basis.values(bodies.points[0]).T

    def facets_meet(self, x: Array, reach: float) -> bool:
        """Whether any facets come near enough to each other for `points_inside` to find a point.

        Parameters
        ----------
        x : Array
            Places of the nodes, mm, shape (nodes, d).
        reach : float
            Deepest penetration that is looked for, as a ratio to the breadth of the facets.
        """
        if any(
            (plane.side * self._at_points(plane, x[:, plane.axis])).min() < 0.0
            for plane in self.bodies.planes
        ):
            return True
        return bool(loops().lib.meeting(self._surface, pointer(x), reach, MAYBE))

    def points_inside(self, x: Array, reach: float = REACH) -> Inside:
        """Return the points that penetrate other facets by at most ``reach``, with the nodes at x (nodes, d).

        Parameters
        ----------
        x : Array
            Places of the nodes, mm, shape (nodes, d).
        reach : float
            Deepest penetration that is looked for, as a ratio to the breadth of the facets.
        """
        count, d = 2 * self.bodies.soft * len(self.bodies.points[0]), x.shape[1]
        integers = [np.empty(count, dtype=np.int64) for _ in range(3)]
        numbers = [np.empty((count, *shape)) for shape in ((d - 1,), (d - 1, d - 1), (d,))]
        out = [*(pointer(array, "int64_t") for array in integers), *map(pointer, numbers)]
        number = loops().lib.inside(self._surface, pointer(x), reach, MAYBE, *out)
        facet, point, other_facet = (array[:number].copy() for array in integers)
        xi, free, r = (array[:number].copy() for array in numbers)
        share = np.where(other_facet < self.bodies.soft, 0.5, 1.0)
        columns: list[tuple[NDArray[Any], ...]] = [(facet, point, other_facet, xi, free, r, share)]
        columns += self._beyond(x)
        return Inside(*(np.concatenate(column) for column in zip(*columns, strict=True)))

    def _beyond(self, x: Array) -> Iterator[tuple[NDArray[Any], ...]]:
        """Return points beyond a plane of symmetry, at any depth, as the columns of `Inside`."""
        b, d = self.bodies, x.shape[1]
        for number, plane in enumerate(b.planes):
            positions = self._places(plane, x)
            facet, point = np.nonzero(plane.height(positions) < 0.0)
            xi, r = plane.nearest(positions[facet, point])
            other_facet = np.full(len(facet), b.first_plane + number)
            free = np.tile(np.eye(d - 1), (len(facet), 1, 1))
            yield plane.facets[facet], point, other_facet, xi, free, r, np.ones(len(facet))

    def _places(self, plane: MirrorPlane, x: Array) -> Array:
        """Positions of the points that may meet a plane, mm, shape (f, q, d)."""
        return np.stack([self._at_points(plane, component) for component in x.T], axis=-1)

    def _at_points(self, plane: MirrorPlane, values: Array) -> Array:
        """Return values at the nodes, (nodes,), at the points that may meet a plane, shape (f, q)."""
        return np.asarray(values[self.bodies.facets[plane.facets]] @ self._shares)

    def near(self, x: Array) -> Ints:
        """Return the pairs of soft facets that face each other at less than their breadth, shape (k, 2)."""
        count = loops().lib.facing_pairs(self._surface, pointer(x), MAYBE, loops().ffi.NULL)
        pairs = np.empty((count, 2), dtype=np.int64)
        loops().lib.facing_pairs(self._surface, pointer(x), MAYBE, pointer(pairs, "int64_t"))
        return pairs

    def _make_surface(self) -> tuple[Any, Sequence[Any]]:
        """Return the surface as the loops read it, and the arrays that have to live as long."""
        b, basis = self.bodies.without_planes(), self.bodies.basis
        (xi, _), centre = b.points, basis.nodes.mean(axis=0)
        integers = [
            np.ascontiguousarray(array, dtype=np.int64) for array in (b.facets, basis.powers, *folds(b))
        ]
        numbers = (
            *(b.sign, b.breadth, basis.values(xi), basis.slopes(xi), centre, basis.slopes(centre[None])[0]),
            *(basis.weights, np.array(basis.edges), basis.courses(), b.X, np.zeros((len(b.facets), FRAME))),
        )
        arrays = [np.ascontiguousarray(array, dtype=np.float64) for array in numbers]
        neighbours = np.zeros(len(b.facets), dtype=np.int64)
        sizes = (len(b.facets), b.soft, len(basis.nodes), b.X.shape[1], len(xi), len(basis.edges))
        rows = [
            *(pointer(array, "int64_t") for array in integers),
            *map(pointer, arrays),
            pointer(neighbours, "int64_t"),
        ]
        surface = loops().ffi.new("surface *", (*sizes, int(basis.kind == "triangle"), basis.bow, *rows))
        return surface, (*integers, *arrays, neighbours, *rows)
