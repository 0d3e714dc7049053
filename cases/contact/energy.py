"""Energy of contact, with its exact derivatives by the nodes' positions.

A point at the depth d below a facet stores the energy a d^3/3 per area. The pressure a d^2 starts without a kink of the
tangent. With a kink, Newton's method would alternate between the points in contact and those that just leave it: with a
pressure proportional to d, contact with a bump stop could not be followed for a tenth of a millimetre. The pressure
also grows faster than the depth, so that it exceeds at a hundredth of an element what a bushing's rubber bears.

The derivatives follow from those of f, the minimum over the facet of half the squared distance, with d^2 = 2 f. The
first derivative of f is the distance vector times the shape functions of both sides; the second contains the motion of
the nearest point, as a Schur complement.

References
----------
Wriggers (2006), Computational Contact Mechanics, 2nd ed., Springer, chapters 4 and 6,
doi:10.1007/978-3-540-32609-0.
Sauer and De Lorenzis (2015), An unbiased computational contact formulation for 3D friction, Int. J. Numer. Methods
Eng. 101:251-280, doi:10.1002/nme.4794 (both surfaces alike, each with half of the energy here).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.contact.bodies import Bodies
from cases.contact.facets import Basis, curvature, in_free_directions
from cases.contact.search import Inside

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# a in shear moduli over the square of the facet's size: a pressure of mu makes a depth of 0.1 % of the size.
STIFF = 1e6


@dataclass(frozen=True)
class Ramp:
    """A pressure that grows with the depth: as a parabola at first, then in proportion.

    Attributes
    ----------
    start : float
        Depth, over the facet's size, at which it begins.
    bend : float
        Further depth, over the facet's size, beyond which it is straight. Newton's method brings a deeper guess back in
        one step there; on the parabola each step would only halve the depth.
    factor : float
        Its curvature, in 2 `STIFF`.
    """

    start: float
    bend: float
    factor: float

    def parts(self, depth: Array, size: Array) -> tuple[Array, Array]:
        """Return the part of a depth in which the pressure is a parabola, and the part beyond it, mm, each shape (p,).

        Parameters
        ----------
        depth, size : shape (p,)
            Depths of the points and sizes of their facets, mm.
        """
        inside = np.maximum(depth - self.start * size, 0.0)
        bent = np.minimum(inside, self.bend * size)
        return bent, inside - bent


# It reaches 51 mu at a depth of 1 %.
USUAL = Ramp(0.0, 3e-3, 1.0)
# Added against rigid sleeves: a plain bushing that is pressed radially between long sleeves presses against them with
# up to 80 mu at 56 % of its thickness and 3,200 mu at 80 % (from the depths in docs/contact.md). It adds 7,500 mu at a
# depth of 1 %, and begins where usual contact does not reach in equilibrium. Where rubber meets rubber it would only
# cost iterations: the first guess of a step is often that deep.
RIGID = Ramp(6e-3, 5e-4, 2000.0)


@dataclass(frozen=True)
class Pressed:
    """Points in contact, ready for energy, forces and stiffness.

    Attributes
    ----------
    basis : Basis
    found : Inside
    nodes : shape (p, 2 n)
        Nodes of the point's facet and of the other facet.
    places : shape (p, n, d)
        Positions of the other facet's nodes, mm.
    A : shape (p, 2 n)
        Weights of the nodes in the distance r.
    scale : shape (p,)
        a times the area that the point stands for, per shear modulus.
    size : shape (p,)
        Size of the facet that each point belongs to, mm.
    rigid : shape (p,)
        1 where the other facet is a rigid sleeve's, else 0; behind a plane of symmetry there is rubber.
    """

    basis: Basis
    found: Inside
    nodes: Ints
    places: Array
    A: Array
    scale: Array
    size: Array
    rigid: Array

    @classmethod
    def of(cls, bodies: Bodies, inside: Inside, x: Array) -> Pressed:
        """Prepare points that penetrate other facets, with the nodes at x (nodes, d).

        Parameters
        ----------
        bodies : Bodies
            The surfaces.
        inside : Inside
            Points that penetrate other facets.
        x : Array
            Positions of the nodes, mm, shape (nodes, d).
        """
        xi, _ = bodies.points
        shape_values, other_values = bodies.basis.values(xi[inside.point]), bodies.basis.values(inside.xi)
        size = bodies.size[inside.facet]
        return cls(
            bodies.basis,
            inside,
            np.concatenate([bodies.facets[inside.facet], bodies.facets[inside.other]], axis=1),
            x[bodies.facets[inside.other]],
            np.concatenate([shape_values, -other_values], axis=1),
            inside.share * bodies.weight[inside.facet, inside.point] * STIFF / size**2,
            size,
            ((inside.other >= bodies.soft) & (inside.other < bodies.first_plane)).astype(float),
        )

    def energy(self) -> float:
        """Return the energy per shear modulus, mm^3."""
        stored = np.zeros_like(self.scale)
        for factor, bent, beyond in self._parts():
            stored += factor * (bent**3 / 3.0 + bent**2 * beyond + bent * beyond**2)
        return float(np.sum(self.scale * stored))

    def _parts(self) -> Iterator[tuple[Array, Array, Array]]:
        """Yield the factor of each ramp, and the depths on its parabola and beyond it, mm; each of shape (p,)."""
        for ramp, factor in ((USUAL, np.ones_like(self.rigid)), (RIGID, self.rigid)):
            yield ramp.factor * factor, *ramp.parts(self.found.depth, self.size)

    def _slopes(self) -> tuple[Array, Array]:
        """Pressure over the depth, and the pressure's derivative by the depth, each times the points' areas."""
        pressure, growth = np.zeros_like(self.scale), np.zeros_like(self.scale)
        for factor, bent, beyond in self._parts():
            pressure += factor * (bent**2 + 2.0 * bent * beyond)
            growth += factor * 2.0 * bent
        return self.scale * pressure / self.found.depth, self.scale * growth

    def forces(self) -> Array:
        """Return the derivative by the positions of `nodes`, per shear modulus, shape (p, 2 n, d)."""
        share, _ = self._slopes()
        return np.asarray(np.einsum("p,pn,pd->pnd", share, self.A, self.found.r))

    def own_forces(self) -> Array:
        """Return the force of each point's pressure on its own area, per shear modulus, shape (p, d)."""
        share, _ = self._slopes()
        return np.asarray(share[:, None] * self.found.r)

    def stiffness(self) -> Array:
        """Return the second derivative by the positions of `nodes`, per shear modulus, shape (p, 2 n d, 2 n d)."""
        B, S = self._factors()
        return np.asarray(B @ S @ B.transpose(0, 2, 1))

    def positive_stiffness(self) -> Array:
        """Return `stiffness` without the negative eigenvalues of each point's."""
        B, S = self._factors()
        Q, R = np.linalg.qr(B)
        # Q has orthonormal columns: the eigenvalues are those of the few between them.
        values, vectors = np.linalg.eigh(R @ S @ R.transpose(0, 2, 1))
        V = Q @ vectors
        return np.asarray((V * np.maximum(values, 0.0)[:, None, :]) @ V.transpose(0, 2, 1))

    def _factors(self) -> tuple[Array, Array]:
        """Return B, shape (p, 2 n d, d + a), and S, (p, d + a, d + a), of the stiffness B S B^T per shear modulus.

        The first d columns of B move the point against its nearest one, which stays where it is on the facet. The last
        a columns are of the nearest point's motion along the facet, which lowers the energy.
        """
        r, free = self.found.r, self.found.free
        p, n, d, a = *self.A.shape, r.shape[1], free.shape[-1]
        tangent, bend = self._facet()
        moved = np.zeros((p, a, n))
        moved[:, :, n // 2 :] = -self.basis.slopes(self.found.xi)
        mixed = moved[..., None] * r[:, None, None, :] - self.A[:, None, :, None] * tangent[:, :, None, :]
        B = np.zeros((p, n * d, d + a))
        for k in range(d):
            B[:, k::d, k] = self.A
        B[:, :, d:] = mixed.reshape(p, a, n * d).transpose(0, 2, 1) @ free
        share, growth = self._slopes()
        S = np.zeros((p, d + a, d + a))
        along = ((growth - share) / self.found.depth**2)[:, None, None] * r[:, :, None] * r[:, None, :]
        S[:, :d, :d] = share[:, None, None] * np.eye(d) + along
        S[:, d:, d:] = -share[:, None, None] * np.linalg.inv(
            in_free_directions(curvature(tangent, bend, r), free)
        )
        return B, S

    def _facet(self) -> tuple[Array, Array]:
        """Return the other facet's tangents at the nearest point, (p, a, d), and their derivatives, (p, a, a, d)."""
        xi = self.found.xi
        p, _, d = self.places.shape
        bends = self.basis.bends(xi)
        a = bends.shape[1]
        return self.basis.slopes(xi) @ self.places, (bends.reshape(p, a * a, -1) @ self.places).reshape(
            p, a, a, d
        )
