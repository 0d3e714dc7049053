"""All surfaces of a model that can come into contact, and their positions at a state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cases.contact.facets import Basis
from cases.contact.mirrors import MirrorPlane
from cases.contact.sleeves import RigidFacets
from cases.contact.surface import Patch, normals, rule

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Bodies:
    """Facets of the mesh, which are tested for contact on both sides, followed by rigid ones, which are obstacles only.

    The last of the rigid ones are planes of symmetry, one facet each, whose nodes do not move.

    Attributes
    ----------
    basis : Basis
    facets : shape (f, n)
        Numbers of the nodes of each facet.
    sign : shape (f,)
        As in `Patch`.
    X : shape (nodes, d)
        Coordinates of the nodes on the mesh, mm.
    soft : int
        Number of the facets that belong to the mesh; they come first.
    dofs : shape (k, d)
        Unknowns of the nodes that the others follow: those of the mesh, which come first, and those of the bonds.
    follow : sparse matrix, shape (nodes, k), or None
        Weights that give the displacements of all nodes from theirs; None where these are all nodes.
    axisymmetric : bool
        Whether the facets are lines in the half-plane, which stand for surfaces of revolution.
    names : shape (f,)
        Name of the boundary that each facet belongs to.
    planes : sequence of MirrorPlane
        The planes of symmetry.
    """

    basis: Basis
    facets: Ints
    sign: Array
    X: Array
    soft: int
    dofs: Ints
    follow: csr_matrix | None
    axisymmetric: bool
    names: NDArray[np.str_]
    planes: Sequence[MirrorPlane] = ()

    @classmethod
    def of(cls, free: Patch, strips: Sequence[RigidFacets], axisymmetric: bool) -> Bodies:
        """Collect the facets of the free surface and of the sleeves beyond the bonds.

        Parameters
        ----------
        free : Patch
            The free surface.
        strips : sequence of RigidFacets
            Sleeves beyond their bonds.
        axisymmetric : bool
            Whether the mesh is the half-plane.
        """
        count = len(free.X)
        follow = None
        if strips:
            from scipy.sparse import block_diag, identity  # takes 0.1 s: only where sleeves have strips

            parts = [identity(count, format="csr")] + [strip.weights for strip in strips]
            follow = block_diag(parts, format="csr")
        starts = count + np.cumsum([0, *(len(strip.X) for strip in strips)])
        return cls(
            free.basis,
            np.concatenate(
                [free.facets, *(strip.facets + n for strip, n in zip(strips, starts, strict=False))]
            ),
            np.concatenate([free.sign, *(strip.sign for strip in strips)]),
            np.concatenate([free.X, *(strip.X for strip in strips)]),
            len(free.facets),
            np.concatenate([free.dofs, *(strip.anchors.dofs for strip in strips)]),
            follow,
            axisymmetric,
            np.concatenate([free.names, *(np.repeat(strip.name, len(strip.facets)) for strip in strips)]),
        )

    def without(self, facets: Ints) -> Bodies:
        """Return the bodies without some of the rigid facets."""
        keep = np.setdiff1d(np.arange(len(self.facets)), facets)
        return replace(self, facets=self.facets[keep], sign=self.sign[keep], names=self.names[keep])

    def with_planes(self, planes: Sequence[MirrorPlane]) -> Bodies:
        """Return the bodies with planes of symmetry."""
        count, (nodes, d) = len(self.basis.nodes), self.X.shape
        rows = nodes + np.arange(count * len(planes)).reshape(-1, count)
        return replace(
            self,
            facets=np.concatenate([self.facets, rows]),
            sign=np.concatenate([self.sign, np.ones(len(planes))]),
            X=np.concatenate([self.X, *(plane.nodes(self.basis, d) for plane in planes)]),
            names=np.concatenate([self.names, np.repeat("", len(planes))]),
            planes=planes,
        )

    def without_planes(self) -> Bodies:
        """Return the bodies without the planes of symmetry; the numbers of nodes and of other facets stay."""
        bodies = self.without(np.arange(self.first_plane, len(self.facets)))
        return replace(bodies, planes=())

    @property
    def first_plane(self) -> int:
        """Number of the first facet that is a plane of symmetry."""
        return len(self.facets) - len(self.planes)

    @property
    def movable(self) -> int:
        """Number of the nodes that can move; they come first."""
        return len(self.X) - len(self.basis.nodes) * len(self.planes)

    def displacements(self, unknowns: Array) -> Array:
        """Return the displacements of the nodes, shape (nodes, d)."""
        return self.expand(unknowns[self.dofs])

    def expand(self, values: Array) -> Array:
        """Return values at all nodes, (nodes, d), from those at the nodes that are followed, (k, d)."""
        positions = values if self.follow is None else np.asarray(self.follow @ values)
        if not self.planes:
            return positions
        return np.concatenate([positions, np.zeros((len(self.X) - len(positions), positions.shape[1]))])

    def gather(self, nodes: Ints, values: Array) -> Array:
        """Sum values at nodes over the nodes that they follow, shape (k, d): the transpose of `expand`.

        Parameters
        ----------
        nodes : shape (p, m)
            Numbers of nodes.
        values : Array
            Values at them, shape (p, m, d), such as forces in N.
        """
        total = np.zeros(self.X.shape)
        np.add.at(total, nodes, values)
        total = total[: self.movable]
        return total if self.follow is None else np.asarray(self.follow.T @ total)

    @cached_property
    def points(self) -> tuple[Array, Array]:
        """Quadrature of a facet: places and weights in the reference facet."""
        return rule(self.basis)

    @cached_property
    def weight(self) -> Array:
        """Area that each point of the soft facets stands for, mm^2, shape (soft, q)."""
        xi, weights = self.points
        X = self.X[self.facets[: self.soft]]
        slopes = np.einsum("qan,fnd->fqad", self.basis.slopes(xi), X)
        flat = slopes.reshape(-1, *slopes.shape[2:])
        area = np.linalg.norm(normals(flat), axis=1).reshape(slopes.shape[:2]) * weights
        if self.axisymmetric:
            area *= 2 * np.pi * np.einsum("qn,fn->fq", self.basis.values(xi), X[..., 0])
        return np.asarray(area)

    @cached_property
    def size(self) -> Array:
        """Size of each facet, mm: a line's length, or the side of a square of the same area."""
        xi, weights = self.points
        slopes = np.einsum("qan,fnd->fqad", self.basis.slopes(xi), self.X[self.facets])
        flat = slopes.reshape(-1, *slopes.shape[2:])
        area = np.linalg.norm(normals(flat), axis=1).reshape(slopes.shape[:2]) @ weights
        if self.X.shape[1] == 2:
            return np.asarray(area)
        return np.asarray(np.sqrt(area * (2.0 if self.basis.kind == "triangle" else 1.0)))

    @cached_property
    def breadth(self) -> Array:
        """Least extent of each facet, mm: its area over its largest extent."""
        if self.X.shape[1] == 2:
            return self.size
        nodes = self.X[self.facets]
        longest = np.linalg.norm(nodes[:, :, None] - nodes[:, None, :], axis=3).max(axis=(1, 2))
        return np.asarray(self.size**2 / longest)
