"""Changes of the curves that a fitted model's parameters can make within their bounds and its law's stability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import lsq_linear, nnls

Array = NDArray[np.float64]

# Relative singular value that counts as zero. Rounding.
RANK = 1e-10
# Conditions that are tried alone, the ones violated most: in fourth 027 (`benchmarks/decks`) all but 7 of some 4000
# optima were held by one of them.
MOSTLY = 8
# Slope at which a minimum with signs counts as one, over the size of its column. Rounding.
KKT = 1e-9


@dataclass(frozen=True)
class Cuts:
    """Conditions on the parameters of a fit: values that may fall to zero.

    Attributes
    ----------
    slopes : shape (m, p)
        Derivatives of the values by the parameters.
    values : shape (m,)
        Values at the fit.
    """

    slopes: Array
    values: Array

    def with_condition(self, slope: Array, value: float) -> Cuts:
        """Return these and another one."""
        return Cuts(np.vstack([self.slopes, slope]), np.append(self.values, value))

    def after(self, change: Array) -> Cuts:
        """Return the conditions after a change (p,) of the parameters that is known to meet them."""
        return Cuts(self.slopes, np.maximum(self.values + self.slopes @ change, 0.0))

    def only(self, chosen: Sequence[int]) -> Cuts:
        """Return the conditions of these numbers."""
        return Cuts(self.slopes[list(chosen)], self.values[list(chosen)])


@dataclass(frozen=True)
class TangentSpace:
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
    inverse : shape (q, r)
        `slopes` times `inverse` is `basis`.
    rest : shape (rows,)
        Weighted misfit at `values`.
    """

    values: Array
    free: Array
    slopes: Array
    basis: Array
    inverse: Array
    rest: Array

    def left(self, columns: Array) -> Array:
        """Return what the parameters cannot make of columns (rows,) or (rows, k)."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def optimum(self, further: Array) -> Array:
        """Return the parameters (p,) with the least misfit, if others change it by `further` (rows,)."""
        return np.asarray(self.values - self.free @ (self.inverse @ (self.basis.T @ (self.rest + further))))

    def within(self, cuts: Cuts) -> TangentSpace:
        """Return the space in which conditions, with their values at `values`, are met with equality."""
        by = cuts.slopes @ self.free
        change = np.linalg.lstsq(by, -cuts.values)[0]
        left = null_space(by)
        moved = self.rest + self.slopes @ change
        return _space(self.values + self.free @ change, self.free @ left, self.slopes @ left, moved)

    def active(self, cuts: Cuts, further: Array) -> tuple[int, ...]:
        """Return which conditions hold the optimum, if other parameters change the misfit by `further` (rows,).

        Parameters
        ----------
        cuts : Cuts
            As in `within`; the values are no less than zero, so that the parameters at `values` are possible.
        further : array, shape (rows,)
            Change of the weighted misfit, in standard deviations.

        References
        ----------
        Lawson and Hanson (1995), Solving Least Squares Problems, SIAM, doi:10.1137/1.9781611971217, chapter 23.
        """
        aim = -self.basis.T @ (self.rest + further)
        E = cuts.slopes @ self.free @ self.inverse
        size = np.linalg.norm(E, axis=1)
        size[size == 0.0] = 1.0
        # The least distance from the free optimum: of y = aim + w, with E y + value >= 0.
        unit, bound = E / size[:, None], -(cuts.values + E @ aim) / size
        if (bound <= 0.0).all():
            return ()
        # Mostly one of those that are violated most holds it alone: with equality in that one all are met.
        for i in np.argsort(-bound)[:MOSTLY]:
            if bound[i] > 0.0 and (bound - bound[i] * (unit @ unit[i]) <= RANK * bound.max()).all():
                return (int(i),)
        A, b = np.vstack([unit.T, bound]), np.append(np.zeros(len(aim)), 1.0)
        held, _ = nnls(A, b)
        rising = A.T @ (A @ held - b) / np.linalg.norm(A, axis=0)
        if rising.min() < -KKT or np.abs(rising[held > 0.0]).max(initial=0.0) > KKT:
            # `nnls` of SciPy 1.15 ends before the minimum in one of 300 random problems; this takes ten times as long.
            held = lsq_linear(A, b, (0.0, np.inf), method="bvls").x
        return tuple(int(i) for i in np.flatnonzero(held > RANK))


def tangent_space(
    misfit: Array, slopes: Array, free: NDArray[np.bool_], change: Array, x: Array
) -> TangentSpace:
    """Return the space of a fit, with the parameters that bounds hold at these.

    Parameters
    ----------
    misfit : array, shape (rows,)
        Weighted misfit at the fit, in standard deviations.
    slopes : array, shape (rows, p)
        Its derivatives by the parameters.
    free : array of bool, shape (p,)
        Parameters that no bound holds.
    change : array, shape (p,)
        Change of the others to their bounds, each in its unit.
    x : array, shape (p,)
        Parameters of the fit, each in its unit.
    """
    size = np.linalg.norm(slopes, axis=0)
    changes = np.diag(1.0 / np.where(size > 0.0, size, 1.0))[:, free]
    return _space(x + change, changes, slopes @ changes, misfit + slopes @ change)


def _space(values: Array, free: Array, slopes: Array, rest: Array) -> TangentSpace:
    if not slopes.shape[1]:
        return TangentSpace(values, free, slopes, np.zeros((len(rest), 0)), np.zeros((0, 0)), rest)
    u, s, v = np.linalg.svd(slopes, full_matrices=False)
    significant = s > RANK * max(float(s.max(initial=0.0)), 1e-300)
    return TangentSpace(values, free, slopes, u[:, significant], v[significant].T / s[significant], rest)
