"""Planes of symmetry as walls: a part that meets its own mirror image meets the plane between them.

Only a half, a quarter or an eighth of a symmetric part is meshed. Where its free surface comes to lie beyond the plane
at which it is cut, it is inside the part's mirror image. The plane is therefore a rigid, frictionless wall for the free
surface. It is plane and has no end: the nearest point is known without a search. Every plane of symmetry passes through
the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.contact.facets import Basis
from cases.contact.surface import MAYBE, Patch, normals
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class MirrorPlane:
    """A plane at which the mesh is cut.

    Attributes
    ----------
    axis : int
        Coordinate that is zero on the plane.
    side : float
        1 where the mesh has positive values, -1 where it has negative ones.
    facets : shape (f,)
        Numbers of the facets of the free surface that may meet the plane.
    corner, span : float
        A square of the plane as a facet: smallest coordinate and width, mm.
    """

    axis: int
    side: float
    facets: Ints
    corner: float
    span: float

    def nodes(self, basis: Basis, d: int) -> Array:
        """Return the nodes of the plane's facet, mm, shape (n, d).

        Parameters
        ----------
        basis : Basis
            Shape functions of the facets.
        d : int
            Number of coordinates.
        """
        X = np.zeros((len(basis.nodes), d))
        X[:, self._along(d)] = self.corner + self.span * basis.nodes
        return X

    def height(self, x: Array) -> Array:
        """Return how far points (..., d) are from the plane, mm; it is negative beyond the plane."""
        return np.asarray(self.side * x[..., self.axis])

    def nearest(self, x: Array) -> tuple[Array, Array]:
        """Return the nearest point of the plane, in coordinates of its facet (p, d - 1), and the vector from it (p, d).

        Parameters
        ----------
        x : shape (p, d)
            Points, mm.
        """
        d = x.shape[1]
        r = np.zeros_like(x)
        r[:, self.axis] = x[:, self.axis]
        return np.asarray((x[:, self._along(d)] - self.corner) / self.span), r

    def _along(self, d: int) -> list[int]:
        return [k for k in range(d) if k != self.axis]


def mirror_planes(mesh: NamedMesh, free: Patch) -> list[MirrorPlane]:
    """Return the planes at which a mesh is cut, with the facets of its free surface that may meet them.

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named boundaries.
    free : Patch
        The free surface.
    """
    planes = []
    for name in sorted(mesh.mirrors):
        axis = {"x": 0, "y": 1, "z": mesh.dimension - 1}[name]
        side = float(np.sign(free.X[:, axis].mean()))
        span = 4.0 * float(np.ptp(free.X, axis=0).max())
        facets = _facets_without_fold(free, axis)
        if len(facets):
            planes.append(MirrorPlane(axis, side, facets, float(free.X.min()) - 0.5 * span, 2.0 * span))
    return planes


def _facets_without_fold(free: Patch, axis: int) -> Ints:
    """Return the facets, except those at the plane that do not face it at rest.

    They would meet their mirror images only in a fold of the surface that the mesh does not resolve
    (`cases.contact.folds`): a free end, say, which meets the plane at a right angle.
    """
    distances = np.abs(free.X[:, axis])
    at_plane = (distances < 1e-6 * np.ptp(free.X, axis=0).max())[free.facets].any(axis=1)
    at_plane = np.isin(free.facets, free.facets[at_plane]).any(axis=1)
    centre_slopes = free.basis.slopes(free.basis.nodes.mean(axis=0)[None])[0]
    upright = normals(np.einsum("an,fnd->fad", centre_slopes, free.X[free.facets]))
    cosine = upright[:, axis] / np.linalg.norm(upright, axis=1)
    # The cosine between a facet's normal and that of its mirror image.
    return np.flatnonzero(~at_plane | (1.0 - 2.0 * cosine**2 < MAYBE))
