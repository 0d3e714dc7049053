"""Shape functions of facets: lines, triangles and quadrilaterals of any order, as polynomials with two derivatives.

Nodes of every facet are put into the order of their places in the reference facet, so that one table serves all facets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Corners of the reference facets, and their edges as pairs of corners; a line's "edges" are its ends.
CORNERS = {
    "interval": np.array([[0.0], [1.0]]),
    "triangle": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    "quadrilateral": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]),
}
EDGES: dict[str, Sequence[tuple[int, int]]] = {
    "interval": [(0, 0), (1, 1)],
    "triangle": [(0, 1), (0, 2), (1, 2)],
    "quadrilateral": [(0, 1), (2, 3), (0, 2), (1, 3)],
}


@dataclass(frozen=True)
class Basis:
    """Lagrange polynomials of a facet.

    Attributes
    ----------
    kind : str
        "interval", "triangle" or "quadrilateral".
    nodes : shape (n, a)
        Positions of the nodes in the reference facet, in lexicographic order.
    powers : shape (n, a)
        Exponents of the monomials.
    weights : shape (n, n)
        Shape functions by monomials: ``N = monomials @ weights``.
    """

    kind: str
    nodes: Array
    powers: NDArray[np.int64]
    weights: Array

    @classmethod
    def of(cls, kind: str, order: int) -> Basis:
        """Return the basis of a kind of facet, with equidistant nodes.

        Parameters
        ----------
        kind : str
            "interval", "triangle" or "quadrilateral".
        order : int
            Degree of the polynomials, from 1.
        """
        steps = range(order + 1)
        dimension = CORNERS[kind].shape[1]
        powers = np.array(
            [p for p in product(steps, repeat=dimension) if kind != "triangle" or sum(p) <= order]
        )
        nodes = powers / order
        monomials = np.prod(nodes[:, None, :] ** powers[None, :, :], axis=2)
        return cls(kind, nodes, powers, np.asarray(np.linalg.inv(monomials), dtype=np.float64))

    @property
    def edges(self) -> list[tuple[Array, Array]]:
        """Start and direction of each edge in the reference facet; the direction of a line's ends is zero."""
        corners = CORNERS[self.kind]
        return [(corners[i], corners[j] - corners[i]) for i, j in EDGES[self.kind]]

    def inside(self, xi: Array, slack: float = 0.0) -> NDArray[np.bool_]:
        """Whether points (p, a) lie in the reference facet.

        Parameters
        ----------
        xi : Array
            Points, shape (p, a), dimensionless.
        slack : float
            Distance by which they may lie outside, in reference coordinates, dimensionless.
        """
        upper = xi.sum(axis=1) if self.kind == "triangle" else xi.max(axis=1)
        return np.asarray((xi.min(axis=1) >= -slack) & (upper <= 1.0 + slack))

    def values(self, xi: Array) -> Array:
        """Shape functions at points (p, a), shape (p, n)."""
        return self._products(self._powers(xi)) @ self.weights

    def slopes(self, xi: Array) -> Array:
        """First derivatives, shape (p, a, n)."""
        return self.tables(xi)[1]

    def bends(self, xi: Array) -> Array:
        """Second derivatives, shape (p, a, a, n)."""
        return self.tables(xi)[2]

    def tables(self, xi: Array) -> tuple[Array, Array, Array]:
        """Shape functions (p, n), first (p, a, n) and second (p, a, a, n) derivatives at points (p, a)."""
        axes = range(xi.shape[1])
        powers = self._powers(xi)
        slopes = np.stack([self._products(powers, (i,)) for i in axes], axis=1)
        bends = np.stack(
            [np.stack([self._products(powers, (i, j)) for j in axes], axis=1) for i in axes], axis=1
        )
        return self._products(powers) @ self.weights, slopes @ self.weights, bends @ self.weights

    def _powers(self, xi: Array) -> Array:
        """Powers of the coordinates, shape (order + 1, p, a)."""
        table = np.ones((int(self.powers.max()) + 1, *xi.shape))
        for k in range(1, len(table)):
            # By repeated products: a general power takes ten times as long.
            table[k] = table[k - 1] * xi
        return table

    def _products(self, table: Array, by: tuple[int, ...] = ()) -> Array:
        """Monomials (p, n) of the powers, differentiated by the coordinates in ``by``."""
        total: Array = np.ones((table.shape[1], len(self.powers)))
        for axis in range(table.shape[2]):
            power: Any = self.powers[:, axis]
            factor: Any = np.ones(len(self.powers))
            for _ in range(by.count(axis)):
                factor, power = factor * power, np.maximum(power - 1, 0)
            total *= factor * table[:, :, axis][power].T
        return total


@dataclass(frozen=True)
class Nearest:
    """Points of facets nearest to given points.

    Attributes
    ----------
    xi : shape (p, a)
        Their positions in the reference facet.
    free : shape (p, a, a)
        Columns span the directions in which the point may move; a point on an edge or at a corner has fewer of them,
        and the other columns are zero.
    """

    xi: Array
    free: Array


# Largest number of Newton iterations for a point of a facet, and length of the last step in reference coordinates: the
# remaining error is of the order of its square.
PROJECTIONS, CLOSE = 12, 1e-7
# Edges are not searched where the iterate lies beyond the facet by more than this times the point's distance from it:
# `cases.contact.search.BESIDE` excludes such a point.
ASIDE = 2.0


def nearest(basis: Basis, nodes: Array, x: Array) -> Nearest:
    """Return where facets with these nodes (p, n, d) are nearest to points x (p, d).

    If that point is not inside a facet, it is the nearest of the nearest points of its edges; for points far beside a
    facet, it is only approximate.

    Parameters
    ----------
    basis : Basis
        Shape functions of the facets.
    nodes : Array
        Places of each facet's nodes, mm, shape (p, n, d).
    x : Array
        Points, one for each facet, mm, shape (p, d).
    """
    count, a = len(x), basis.nodes.shape[1]
    everywhere = np.broadcast_to(np.eye(a), (count, a, a))
    centre = np.broadcast_to(basis.nodes.mean(axis=0), (count, a))
    xi = _newton(basis, nodes, x, centre, everywhere)
    free = everywhere.copy()
    out = np.flatnonzero(~basis.inside(xi, 1e-12))
    if len(out):
        beyond = np.einsum("pn,pnd->pd", basis.values(xi[out]), nodes[out])
        xi[out], free[out] = np.clip(xi[out], 0.0, 1.0), 0.0
        edge = np.einsum("pn,pnd->pd", basis.values(xi[out]), nodes[out])
        aside, distance = (np.linalg.norm(beyond - p, axis=1) for p in (edge, x[out]))
        out = out[aside < ASIDE * distance]
        xi[out], free[out] = _on_edges(basis, nodes[out], x[out])
    return Nearest(xi, free)


def _on_edges(basis: Basis, nodes: Array, x: Array) -> tuple[Array, Array]:
    """Nearest points of the edges, and the directions in which they may move."""
    count, a = len(x), basis.nodes.shape[1]
    best = np.full(count, np.inf)
    xi, free = np.zeros((count, a)), np.zeros((count, a, a))
    for start, along in basis.edges:
        direction = np.zeros((count, a, a))
        direction[:, :, 0] = along
        middle = np.broadcast_to(start + 0.5 * along, (count, a))
        found = _newton(basis, nodes, x, middle, direction) if along.any() else middle
        t = ((found - start) @ along) / max(float(along @ along), 1.0)
        held = np.clip(t, 0.0, 1.0)
        found = start + held[:, None] * along
        direction[held != t] = 0.0
        distance = np.linalg.norm(x - np.einsum("pn,pnd->pd", basis.values(found), nodes), axis=1)
        nearer = distance < best
        best[nearer], xi[nearer], free[nearer] = distance[nearer], found[nearer], direction[nearer]
    return xi, free


def _newton(basis: Basis, nodes: Array, x: Array, start: Array, free: Array) -> Array:
    """Minimise half the squared distance over the directions ``free``, from ``start``."""
    xi = np.array(start)
    busy = np.arange(len(xi))
    for _ in range(PROJECTIONS):
        if not len(busy):
            break
        own, T, here = nodes[busy], free[busy], xi[busy]
        N, dN, ddN = basis.tables(here)
        r = x[busy] - np.einsum("pn,pnd->pd", N, own)
        slope = dN @ own
        plain = reduced(slope @ slope.transpose(0, 2, 1), T)
        H = reduced(curvature(slope, np.einsum("pabn,pnd->pabd", ddN, own), r), T)
        # Far from a curved facet the distance is not convex: the facet is then treated as plane.
        bad = ~(_least(H) > 0.2 * _least(plain))
        H[bad] = plain[bad]
        force = np.einsum("pab,pad,pd->pb", T, slope, r)
        step = np.einsum("pab,pb->pa", T, np.linalg.solve(H, force[..., None])[..., 0])
        # Points beyond the neighbouring facets do not matter: the iterate is kept near the facet.
        xi[busy] = np.clip(here + np.clip(step, -0.5, 0.5), -0.5, 1.5)
        busy = busy[np.abs(xi[busy] - here).max(axis=1) > CLOSE]
    return xi


def _least(H: Array) -> Array:
    """Least eigenvalue of symmetric matrices of one or two rows."""
    if H.shape[1] == 1:
        return H[:, 0, 0]
    half = 0.5 * (H[:, 0, 0] + H[:, 1, 1])
    return np.asarray(half - np.hypot(0.5 * (H[:, 0, 0] - H[:, 1, 1]), H[:, 0, 1]))


def curvature(slope: Array, bend: Array, r: Array) -> Array:
    """Second derivative (p, a, a) of half the squared distance by the place on the facet.

    Parameters
    ----------
    slope : Array
        First derivatives of the place by the reference coordinates, mm, shape (p, a, d).
    bend : Array
        Second derivatives, mm, shape (p, a, a, d).
    r : Array
        Vector from the place on the facet to the point, mm, shape (p, d).
    """
    return np.asarray(slope @ slope.transpose(0, 2, 1) - np.einsum("pabd,pd->pab", bend, r))


def reduced(H: Array, free: Array) -> Array:
    """H in the directions ``free``, with ones on the diagonal for those that are missing.

    Parameters
    ----------
    H : Array
        Symmetric matrices, mm^2, shape (p, a, a).
    free : Array
        Directions as columns, shape (p, a, a), dimensionless; zero where one is missing.
    """
    small = free.transpose(0, 2, 1) @ H @ free
    missing = ~np.any(free != 0.0, axis=1)
    index = np.arange(small.shape[1])
    small[:, index, index] += missing
    return np.asarray(small)
