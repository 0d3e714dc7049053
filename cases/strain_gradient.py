"""Energy of strain gradients, which keeps a crease of the rubber's surface at least as wide as an element.

A surface compressed beyond Biot's limit creases. Elasticity gives the crease no width, so that it forms within one
element, whatever its size: second-order elements were seen to fold there, with volume ratios of 0.16 to 5.2, and the
march stopped where the crease closed. This energy resists a deformation gradient that changes within one element by
more than a smooth deformation requires,

    E = STIFFNESS mu / 4 * sum over cells of V max(b^2 - SMOOTH^2, 0)^2,    b^2 = h^2 mean of |grad grad u|^2,

h being the edge of the regular tetrahedron of the cell's volume V, and mu the law's shear modulus. It is zero where b
is below `SMOOTH`, does not depend on rigid motions, and vanishes in a smooth deformation as the mesh is refined.

It acts in tetrahedra that touch no bond: rubber does not crease there, but its deformation gradient is unbounded at the
edges of a bond. The hexahedra of the parametric shapes are larger by design: there b exceeds 1 in smooth deformations,
too (radially 1.5 in a plain bushing at a quarter of its thickness).

References
----------
Biot (1963), Surface instability of rubber in compression, Appl. Sci. Res. A 12:168-182.
Bluhm, Sigmund and Poulios (2021), Internal contact modeling for finite strain topology optimization, Comput. Mech.
67:1099-1114, doi:10.1007/s00466-021-01974-x (the same measure, in a third medium).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from numpy.typing import NDArray

from cases.elements import QuadratureRule, Unknowns, apart_from_bonds, cells_may_fold
from geometry.dolfinx_api import cell_nodes
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]
Index = NDArray[np.int32]

# Radially, the kidney STEP (30,000 unknowns) has b < 0.5 in 99.9 % of its cells up to 1.2 mm; the energy changes the
# force by 0.02 % at 1.5 mm and by 0.08 % at 1.8 mm. Creases begin at 2.1 mm.
SMOOTH = 0.5
# With 0.03, b reaches 1.65 at 3.9 mm, with 0.1 1.2, with 1.0 and SMOOTH = 1.0 1.1; without this energy 8.7 (all
# cells taken, those on bonds included).
STIFFNESS = 0.1
# The second derivatives of second-order shape functions are constant in straight cells, and nearly so in curved ones.
DEGREE = 2


@dataclass(frozen=True)
class _Bent:
    """The cells of a model that have the energy of strain gradients, evaluated at a state.

    Attributes
    ----------
    state : shape (m,)
        This rank's unknowns.
    cells : shape (b,)
        Which cells, as indices of those given.
    bending : shape (b, components, nodes)
        Half of the derivative of b^2 by the displacements, 1/mm.
    excess : shape (b,)
        b^2 - SMOOTH^2.
    """

    state: Array
    cells: NDArray[np.intp]
    bending: Array
    excess: Array


class StrainGradient:
    """Energy of the strain gradients of some cells.

    Parameters
    ----------
    mesh, space
        The mesh, and its mixed space with the displacement first.
    cells
        Numbers of the cells on this rank, all of them tetrahedra.
    """

    def __init__(self, mesh: NamedMesh, space: Any, cells: Index) -> None:
        self._displaced = Unknowns.of(space, mesh.dimension, cells).displaced
        self._element, self._cells = space.sub(0).element.basix_element, cells
        self._shear_modulus = 0.0
        self.locate(mesh)

    def take(self, shear_modulus: float) -> None:
        """Take the law's present shear modulus, MPa."""
        self._shear_modulus = shear_modulus

    def locate(self, mesh: NamedMesh) -> None:
        """Take the geometry from the nodes of the mesh as they are now."""
        rule = QuadratureRule.gauss(mesh, DEGREE)
        element = mesh.mesh.ufl_domain().ufl_coordinate_element().sub_elements[0].basix_element
        places = mesh.mesh.geometry.x[cell_nodes(mesh.mesh)[self._cells]]
        slope, bend = _derivatives(element, rule.points)
        dN, ddN = _derivatives(self._element, rule.points)
        jacobian = np.einsum("ipm,cmk->cpki", slope, places, optimize=True)
        inverse = np.linalg.inv(jacobian)
        curved = np.einsum("ijpm,cmk->cpkij", bend, places, optimize=True)
        # Second derivatives by the coordinates: those by the reference coordinates, less what the cell's curvature
        # adds.
        slopes = np.einsum("ipn,cpik->cpnk", dN, inverse, optimize=True)
        second = ddN.transpose(2, 3, 0, 1) - np.einsum("cpnk,cpkij->cpnij", slopes, curved, optimize=True)
        second = np.einsum("cpnij,cpia,cpjb->cpnab", second, inverse, inverse, optimize=True)
        second = second.reshape(*second.shape[:3], 9)
        measure = np.abs(np.linalg.det(jacobian)) * rule.weights
        self._volume: Array = measure.sum(axis=1)
        square = np.einsum("cp,cpnx,cpmx->cnm", measure, second, second, optimize=True)
        # h^2 / V, with h^3 = 6 sqrt(2) V.
        self._square: Array = square * ((72.0**0.5 * self._volume) ** (2 / 3) / self._volume)[:, None, None]
        self._bent: _Bent | None = None

    def energy(self, state: Array) -> float:
        """Return the energy at a state (this rank's unknowns), N mm."""
        bent = self._at(state)
        return float(STIFFNESS * self._shear_modulus / 4 * self._volume[bent.cells] @ bent.excess**2)

    def bending(self, state: Array) -> Array:
        """Return b of each cell at a state: the change of the deformation gradient within it, shape (cells,)."""
        return np.asarray(np.sqrt(np.maximum(self._square_of_bending(state)[1], 0.0)))

    def add_forces(self, state: Array, forces: Array, modulus: float | None = None) -> None:
        """Add the derivative of the energy at a state.

        Parameters
        ----------
        state, forces : Array
            Vectors over this rank's unknowns, shape (m,); `forces` (N) is changed in place.
        modulus : float, optional
            Take this in place of the shear modulus, MPa (or its rate, per unit of a parameter).
        """
        bent = self._at(state)
        scale = self._scale(bent, self._shear_modulus if modulus is None else modulus) * bent.excess
        np.add.at(forces, self._displaced[bent.cells], scale[:, None, None] * bent.bending)

    @property
    def unknowns(self) -> Index:
        """Local numbers of the displacements of every cell, shape (cells, n)."""
        cells, components, nodes = self._displaced.shape  # there are no cells where all rubber touches a bond
        return np.ascontiguousarray(self._displaced.reshape(cells, components * nodes))

    def blocks(self, state: Array) -> tuple[NDArray[np.intp], Array]:
        """Second derivative at a state, by the unknowns of each cell with an energy.

        Parameters
        ----------
        state : Array
            This rank's unknowns, shape (m,).

        Returns
        -------
        cells : shape (b,)
            Those with an energy, as in `unknowns`.
        values : shape (b, n, n)
            N/mm.
        """
        bent = self._at(state)
        cells, components, nodes = bent.bending.shape
        scale = self._scale(bent, self._shear_modulus)
        flat = bent.bending.reshape(cells, components * nodes)
        values = (2.0 * scale)[:, None, None] * flat[:, :, None] * flat[:, None, :]
        parts = values.reshape(cells, components, nodes, components, nodes)
        for i in range(components):
            parts[:, i, :, i, :] += (scale * bent.excess)[:, None, None] * self._square[bent.cells]
        return bent.cells, values

    def add_action(self, state: Array, direction: Array, forces: Array) -> None:
        """Add the product of the second derivative at a state and a direction.

        Parameters
        ----------
        state, direction, forces : Array
            Vectors over this rank's unknowns, shape (m,); `forces` is changed in place.
        """
        bent = self._at(state)
        displaced = self._displaced[bent.cells]
        change = direction[displaced]
        growth = 2.0 * np.einsum("cin,cin->c", bent.bending, change)[:, None, None] * bent.bending
        growth += bent.excess[:, None, None] * (change @ self._square[bent.cells])
        np.add.at(forces, displaced, self._scale(bent, self._shear_modulus)[:, None, None] * growth)

    def _scale(self, bent: _Bent, modulus: float) -> Array:
        return STIFFNESS * modulus * self._volume[bent.cells]

    def _square_of_bending(self, state: Array) -> tuple[Array, Array]:
        """Return half of the derivative of b^2 by the displacements, (cells, components, nodes), and b^2, (cells,)."""
        u = state[self._displaced]
        bending = u @ self._square
        return bending, np.einsum("cin,cin->c", u, bending)

    def _at(self, state: Array) -> _Bent:
        if self._bent is None or not np.array_equal(state, self._bent.state):
            bending, square = self._square_of_bending(state)
            excess = square - SMOOTH**2
            cells = np.flatnonzero(excess > 0.0)
            self._bent = _Bent(state.copy(), cells, bending[cells], excess[cells])
        return self._bent


def strain_gradient(mesh: NamedMesh, space: Any, cells: Index, bonds: Iterable[str]) -> StrainGradient | None:
    """Return the energy of the strain gradients of rubber; None where the cells are no tetrahedra.

    Parameters
    ----------
    mesh, space
        The mesh, and its mixed space with the displacement first.
    cells
        Numbers of the rubber's cells on this rank.
    bonds
        Names of the boundaries on which sleeves are prescribed.
    """
    if not cells_may_fold(mesh):
        return None
    return StrainGradient(mesh, space, cells[apart_from_bonds(mesh, space, cells, bonds)])


def _derivatives(element: Any, points: Array) -> tuple[Array, Array]:
    """First (d, p, n) and second derivatives (d, d, p, n) of a scalar element's shape functions."""
    table = element.tabulate(2, points)[..., 0]
    unit = np.eye(points.shape[1], dtype=int)
    first = np.stack([table[basix.index(*axis)] for axis in unit])
    return first, np.stack([[table[basix.index(*(axis + other))] for other in unit] for axis in unit])
