"""The changes that a fitted model's parameters can make within their bounds and the stability of its law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Room:
    """First-order changes of the misfit by the parameters of a fitted model.

    Attributes
    ----------
    values : shape (p,)
        Parameters, each in its unit, about which they change: at the bounds and edges that hold them.
    free : shape (p, q)
        Changes of the parameters that are left.
    slopes : shape (rows, q)
        Changes of the weighted misfit by these.
    basis : shape (rows, r)
        Orthonormal basis of the columns of `slopes`.
    rest : shape (rows,)
        Weighted misfit at `values`.
    """

    values: Array
    free: Array
    slopes: Array
    basis: Array
    rest: Array

    def left(self, columns: Array) -> Array:
        """Return what the parameters cannot make of columns (rows,) or (rows, k)."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def optimum(self, further: Array) -> Array:
        """Return the parameters (p,) with the least misfit, if others change it by `further` (rows,)."""
        if not self.free.shape[1]:
            return self.values
        size = np.linalg.norm(self.slopes, axis=0)
        size[size == 0.0] = 1.0
        best = np.linalg.lstsq(self.slopes / size, -(self.rest + further))[0] / size
        return np.asarray(self.values + self.free @ best)


def room(
    misfit: Array,
    slopes: Array,
    free: NDArray[np.bool_],
    change: Array,
    x: Array,
    edges: tuple[Array, Array] | None = None,
) -> Room:
    """Return the room of a fit.

    Parameters
    ----------
    misfit : (rows,) array
        Weighted misfit at the fit.
    slopes : (rows, p) array
        Its derivatives by the parameters.
    free : (p,) array of bool
        Parameters that no bound holds.
    change : (p,) array
        Change of the others to their bounds.
    x : (p,) array
        Parameters of the fit, each in its unit.
    edges : (k,) array and (k, p) array, optional
        Margins of the law's stability at the fit and their derivatives, in states in which it is to be at its edge.
    """
    size = np.linalg.norm(slopes, axis=0)
    size[size == 0.0] = 1.0
    changes = np.diag(1.0 / size)[:, free]
    if edges is not None:
        margins, by = edges
        change = change + changes @ np.linalg.lstsq(by @ changes, -(margins + by @ change))[0]
        changes = changes @ null_space(by @ changes)
    left = slopes @ changes
    u, s, _ = np.linalg.svd(left, full_matrices=False)
    basis = u[:, s > 1e-10 * max(float(s.max(initial=0.0)), 1e-300)]
    return Room(x + change, changes, left, basis, misfit + slopes @ change)
