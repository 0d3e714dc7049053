"""Search for points that penetrate other facets, and for the nearest points on these facets.

Facets that come near to each other are listed with a margin, and listed again once a node has moved by half of it.
Tests of whole facets leave few of them, whose nearest points are computed anew at every state: the distance is a
function of the state alone, and its derivatives are exact.

A point is inside if it lies behind the facet nearest to it, no deeper than `REACH`, and both surfaces face each other.
Surfaces with rubber between them, as in a thin wall or at a sharp edge, do not meet (`THROUGH`), nor do facets within a
fold of the surface (`cases.contact.folds`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.contact.bodies import Bodies
from cases.contact.facets import Nearest, nearest
from cases.contact.folds import MAYBE, folds
from cases.contact.surface import normals
from cases.kernels import loops, pointer

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Deepest penetration that is sought, over the breadth of the facets: with a deeper one, the two sides of a bulge on a
# coarse mesh would be taken for a fold. A step of the march that goes deeper is too long.
REACH = 0.5
# Margin of the list, over the size of the facets.
SKIN = 1.0
# Two surfaces face each other if the cosine between their normals is below this.
FACING = -0.5
# There is rubber between two points if the line from one to the other leads into the rubber of the undeformed body: its
# cosine to the inward normal exceeds the first value at one end, or the second at both. In a fold of a flat face the
# cosines are zero.
THROUGH, BOTH = 0.7, 0.3
# Least cosine between the line to the nearest point and the facet's normal; at an edge, less means that the point lies
# beside the facet.
BESIDE = 0.7
# Numbers that `near.c` stores for each facet.
FRAME = 9
# Relative size of the term that decides between two facets whose common edge is nearest to a point.
TIE = 1e-6


@dataclass(frozen=True)
class Inside:
    """Points that penetrate other facets.

    Attributes
    ----------
    facet, point : shape (p,)
        Soft facet, and its quadrature point.
    other : shape (p,)
        Facet that the point penetrates.
    at : Nearest
        Nearest point on that facet.
    r : shape (p, d)
        Vector from there to the point, mm.
    share : shape (p,)
        Share of the contact's energy: one half where the other facet is soft, whose points are tested against this one
        too.
    """

    facet: Ints
    point: Ints
    other: Ints
    at: Nearest
    r: Array
    share: Array

    def __len__(self) -> int:
        return len(self.facet)

    @property
    def depth(self) -> Array:
        """Penetration, mm."""
        return np.asarray(np.linalg.norm(self.r, axis=1))


class Search:
    """Finds points that penetrate other facets.

    Parameters
    ----------
    bodies
        The surfaces.
    """

    def __init__(self, bodies: Bodies) -> None:
        self.bodies = bodies
        basis = bodies.basis
        self._xi, _ = bodies.points
        self._N = basis.values(self._xi)
        self._slopes = basis.slopes(self._xi)
        self._middle = basis.slopes(basis.nodes.mean(axis=0)[None])[0]
        self._folds = folds(bodies)
        self._surface, self._kept = self._given()
        self._listed: Array | None = None
        self._pairs = np.zeros((0, 2), dtype=np.int64)
        self._room = SKIN * float(np.median(bodies.size[: bodies.soft])) if bodies.soft else 0.0

    def meeting(self, x: Array, reach: float) -> bool:
        """Whether any facets come near enough to each other for `inside` to find a point; it takes microseconds.

        Parameters
        ----------
        x : Array
            Places of the nodes, mm, shape (nodes, d).
        reach : float
            Deepest penetration that is looked for, as a ratio to the breadth of the facets.
        """
        return bool(loops().lib.meeting(self._surface, pointer(x), reach, MAYBE))

    def inside(self, x: Array, reach: float = REACH) -> Inside:
        """Return the points that penetrate other facets by at most ``reach``, with the nodes at x (nodes, d).

        Parameters
        ----------
        x : Array
            Places of the nodes, mm, shape (nodes, d).
        reach : float
            Deepest penetration that is looked for, as a ratio to the breadth of the facets.
        """
        if self._listed is None or np.abs(x - self._listed).max(initial=0.0) > 0.5 * self._room:
            self._list(x)
        b = self.bodies
        facet, other, point = self._candidates(x, reach)
        nodes = x[b.facets[other]]
        places = np.einsum("pn,pnd->pd", self._N[point], x[b.facets[facet]])
        at = nearest(b.basis, nodes, places)
        r = places - np.einsum("pn,pnd->pd", b.basis.values(at.xi), nodes)
        depth = np.linalg.norm(r, axis=1)
        normal = self._normals(b.basis.slopes(at.xi), x, other)
        hard = other >= b.soft
        facing = np.einsum("pd,pd->p", normal, self._normals(self._slopes[point], x, facet)) < FACING
        good = (depth > 0.0) & (depth < reach * self._span(facet, other)) & (hard | facing)
        good[good] &= ~self._through(facet[good], point[good], other[good], at.xi[good])
        # The nearest facet decides whether the point is inside; at a common edge, the facet that the point lies over.
        behind = -np.einsum("pd,pd->p", r, normal) / np.maximum(depth, 1e-300)
        best = _first_of(facet, point, hard, np.where(good, depth * (1.0 - TIE * np.abs(behind)), np.inf))
        chosen = best[good[best] & (behind[best] > BESIDE)]
        return Inside(
            facet[chosen],
            point[chosen],
            other[chosen],
            Nearest(at.xi[chosen], at.free[chosen]),
            r[chosen],
            np.where(hard[chosen], 1.0, 0.5),
        )

    def near(self, x: Array) -> Ints:
        """Return the pairs of a soft facet and another that face each other at less than a facet's size."""
        self._list(x)
        centre, _ = self._spheres(x)
        s, m, normal = self._facing(x)
        apart = np.einsum("pd,pd->p", centre[s] - centre[m], normal[m])
        side = np.linalg.norm(centre[s] - centre[m] - apart[:, None] * normal[m], axis=1)
        span = self._span(s, m)
        near = (np.abs(apart) < span) & (side < 2.0 * span) & (m < self.bodies.soft)
        return np.column_stack([s[near], m[near]])

    def _given(self) -> tuple[Any, Sequence[Any]]:
        """Return the surface as `near.c` reads it, and the arrays that have to live as long."""
        b = self.bodies
        points, nodes = self._N.shape
        tables = (b.sign, b.breadth, self._N, self._slopes, self._middle, np.zeros((len(b.facets), FRAME)))
        kept = [np.ascontiguousarray(one, dtype=np.float64) for one in tables]
        facets = np.ascontiguousarray(b.facets, dtype=np.int64)
        numbers = [pointer(one, "int64_t") for one in (facets, *self._folds)]
        rows = [numbers[0], *map(pointer, kept), *numbers[1:]]
        sizes = (len(facets), b.soft, nodes, b.X.shape[1], points)
        return loops().ffi.new("surface *", (*sizes, *rows)), (facets, kept, rows)

    # -- candidates ----------------------------------------------------------------------------------------------

    def _list(self, x: Array) -> None:
        """List the pairs of facets that come near to each other."""
        from scipy.spatial import cKDTree  # takes 0.1 s: only where there is contact

        b = self.bodies
        centre, radius = self._spheres(x)
        limit = 2 * float(radius[: b.soft].max(initial=0.0)) + self._room
        pairs = cKDTree(centre[: b.soft]).query_pairs(limit, output_type="ndarray").astype(np.int64)
        pairs = np.concatenate([pairs, pairs[:, ::-1]])
        hard = np.arange(b.soft, len(b.facets))
        strips = np.column_stack([np.repeat(np.arange(b.soft), len(hard)), np.tile(hard, b.soft)])
        pairs = np.concatenate([pairs, strips])
        apart = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
        pairs = pairs[apart < radius[pairs].sum(axis=1) + self._room]
        count = len(b.facets)
        folded = np.repeat(np.arange(b.soft), np.diff(self._folds[0])) * count + self._folds[1]
        self._pairs = pairs[~np.isin(pairs[:, 0] * count + pairs[:, 1], folded)]
        self._listed = x.copy()

    def _spheres(self, x: Array) -> tuple[Array, Array]:
        nodes = x[self.bodies.facets]
        centre = nodes.mean(axis=1)
        return centre, np.linalg.norm(nodes - centre[:, None], axis=2).max(axis=1)

    def _candidates(self, x: Array, reach: float) -> tuple[Ints, Ints, Ints]:
        """Facet, other facet and point: points that may be inside, each with all facets that it is near to."""
        b = self.bodies
        s, m, normal = self._facing(x)
        centre, radius = self._spheres(x)
        height = np.einsum("fnd,fd->fn", x[b.facets] - centre[:, None], normal)
        top, bottom = height.max(axis=1), height.min(axis=1)
        slack = 0.1 * (top - bottom)
        # A facet far above the other's highest point has no point near it. It may sag between its nodes.
        above = np.einsum("pnd,pd->pn", x[b.facets[s]] - centre[m][:, None], normal[m])
        lowest = above.min(axis=1) - 0.3 * np.ptp(above, axis=1)

        def points(pairs: Ints, room: Array) -> tuple[Ints, Ints]:
            """Pair and point, for the points that are no further above the other facet than `room`."""
            s_, m_, deep = s[pairs], m[pairs], (reach * self._span(s[pairs], m[pairs]))[:, None]
            way = np.einsum("qn,pnd->pqd", self._N, x[b.facets[s_]]) - centre[m_][:, None]
            up = np.einsum("pqd,pd->pq", way, normal[m_])
            near = up < (top + slack)[m_][:, None] + room[pairs][:, None]
            near &= up > (bottom - slack)[m_][:, None] - deep
            near &= np.linalg.norm(way, axis=2) < 1.05 * radius[m_][:, None] + deep
            pair, point = np.nonzero(near)
            return pairs[pair], point

        none = np.zeros(len(s))
        pair, point = points(np.flatnonzero(lowest < (top + slack)[m]), none)
        pair, point = self._turned(x, s, m, normal, pair, point)
        inside = np.unique(s[pair] * len(self._N) + point)
        if not len(inside):
            return s[:0], m[:0], point[:0]
        room = reach * self._span(s, m)
        these = np.isin(s, inside // len(self._N)) & (lowest < (top + slack)[m] + room)
        pair, point = points(np.flatnonzero(these), room)
        known = np.isin(s[pair] * len(self._N) + point, inside)
        return s[pair[known]], m[pair[known]], point[known]

    def _turned(
        self, x: Array, s: Ints, m: Ints, normal: Array, pair: Ints, point: Ints
    ) -> tuple[Ints, Ints]:
        """Pairs and points whose own normal opposes that of the other facet."""
        own = self._normals(self._slopes[point], x, s[pair])
        turned = (m[pair] >= self.bodies.soft) | (np.einsum("pd,pd->p", own, normal[m[pair]]) < MAYBE)
        return pair[turned], point[turned]

    def _facing(self, x: Array) -> tuple[Ints, Ints, Array]:
        """Pairs of the list that may face each other, and the unit normals at the centres of all facets."""
        b = self.bodies
        slopes = np.einsum("an,fnd->fad", self._middle, x[b.facets])
        normal = normals(slopes) * b.sign[:, None]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        s, m = self._pairs.T
        face = (m >= b.soft) | (np.einsum("pd,pd->p", normal[s], normal[m]) < MAYBE)
        return s[face], m[face], normal

    def _span(self, s: Ints, m: Ints) -> Array:
        """Mean breadth of the facets of each pair; for a rigid facet, the breadth of the soft one."""
        size, soft = self.bodies.breadth, self.bodies.soft
        return np.asarray(0.5 * (size[s] + size[np.where(m < soft, m, s)]))

    # -- tests of points -----------------------------------------------------------------------------------------

    def _normals(self, slopes: Array, x: Array, facet: Ints) -> Array:
        """Outward unit normals where facets have shape functions with these slopes (p, a, n)."""
        nodes = x[self.bodies.facets[facet]]
        found = normals(np.einsum("pan,pnd->pad", slopes, nodes)) * self.bodies.sign[facet][:, None]
        return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])

    def _through(self, facet: Ints, point: Ints, other: Ints, xi: Array) -> NDArray[np.bool_]:
        """Whether rubber lies between points and other facets in the stress-free body."""
        b: Any = self.bodies
        here = np.einsum("pn,pnd->pd", self._N[point], b.X[b.facets[facet]])
        there = np.einsum("pn,pnd->pd", b.basis.values(xi), b.X[b.facets[other]])
        way = there - here
        way /= np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
        own = np.einsum("pd,pd->p", way, self._normals(self._slopes[point], b.X, facet))
        its = -np.einsum("pd,pd->p", way, self._normals(b.basis.slopes(xi), b.X, other))
        into = (np.minimum(own, its) < -THROUGH) | (np.maximum(own, its) < -BOTH)
        return np.asarray(into & (other < b.soft))


def _first_of(facet: Ints, point: Ints, hard: NDArray[np.bool_], depth: Array) -> Ints:
    """Index of the least depth of each point, separately for soft and rigid facets."""
    order = np.lexsort((depth, hard, point, facet))
    keys = np.column_stack([facet, point, hard])[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = np.any(keys[1:] != keys[:-1], axis=1)
    return np.asarray(order[new])
