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

    @property
    def bow(self) -> int:
        """Degree of the shape functions along an edge."""
        return int(self.powers.max())

    def courses(self) -> Array:
        """Shape functions along each edge as polynomials of the way, 0 to 1: coefficients (edges, bow + 1, n)."""
        positions = np.linspace(0.0, 1.0, self.bow + 1)
        powers = np.linalg.inv(positions[:, None] ** np.arange(self.bow + 1))
        return np.array(
            [powers @ self.values(start + positions[:, None] * along) for start, along in self.edges]
        )

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


def in_free_directions(H: Array, free: Array) -> Array:
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
