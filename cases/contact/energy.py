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
from cases.contact.facets import Basis, curvature, reduced
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
        1 where the other facet is rigid, else 0.
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
    def of(cls, bodies: Bodies, found: Inside, x: Array) -> Pressed:
        """Prepare points that penetrate other facets, with the nodes at x (nodes, d).

        Parameters
        ----------
        bodies : Bodies
            The surfaces.
        found : Inside
            Points that penetrate other facets.
        x : Array
            Positions of the nodes, mm, shape (nodes, d).
        """
        xi, _ = bodies.points
        own, its = bodies.basis.values(xi[found.point]), bodies.basis.values(found.xi)
        size = bodies.size[found.facet]
        return cls(
            bodies.basis,
            found,
            np.concatenate([bodies.facets[found.facet], bodies.facets[found.other]], axis=1),
            x[bodies.facets[found.other]],
            np.concatenate([own, -its], axis=1),
            found.share * bodies.weight[found.facet, found.point] * STIFF / size**2,
            size,
            (found.other >= bodies.soft).astype(float),
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
        r, depth = self.found.r, self.found.depth
        p, n, d = *self.A.shape, r.shape[1]
        K = -self._of_place()
        K += np.einsum("pi,pj,kl->pikjl", self.A, self.A, np.eye(d), optimize=True).reshape(p, n * d, n * d)
        share, growth = self._slopes()
        K *= share[:, None, None]
        slope = np.einsum("pi,pd->pid", self.A, r).reshape(p, n * d)
        K += np.einsum("p,px,py->pxy", (growth - share) / depth**2, slope, slope, optimize=True)
        return np.asarray(K)

    def positive_stiffness(self) -> Array:
        """Return `stiffness` without the negative eigenvalues of each point's."""
        values, vectors = np.linalg.eigh(self.stiffness())
        return np.asarray((vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1))

    def _of_place(self) -> Array:
        """Part that the nearest point's motion takes off the second derivative of half the squared distance."""
        xi, r = self.found.xi, self.found.r
        p, n, d = *self.A.shape, r.shape[1]
        slopes = self.basis.slopes(xi)
        tangent = np.einsum("pan,pnd->pad", slopes, self.places)
        bend = np.einsum("pabn,pnd->pabd", self.basis.bends(xi), self.places)
        H = reduced(curvature(tangent, bend, r), self.found.free)
        moved = np.zeros((p, slopes.shape[1], n))
        moved[:, :, n // 2 :] = -slopes
        mixed = np.einsum("pai,pj->paij", moved, r) - np.einsum("paj,pi->paij", tangent, self.A)
        mixed = np.einsum("pab,paij->pbij", self.found.free, mixed).reshape(p, -1, n * d)
        return np.asarray(np.einsum("pax,pay->pxy", mixed, np.linalg.solve(H, mixed), optimize=True))
