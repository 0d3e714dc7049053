"""Elements, the positions of their unknowns in the global vector, and their quadrature points."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from geometry.mesh import NamedMesh

Array = NDArray[np.float64]
Index = NDArray[np.int32]


@dataclass(frozen=True)
class Unknowns:
    """Positions of the unknowns of cells in the global vector.

    Attributes
    ----------
    displaced : shape (cells, components, nodes)
    pressed : shape (cells, corners)
    """

    displaced: Index
    pressed: Index

    @property
    def of_cells(self) -> Index:
        """All unknowns of each cell, shape (cells, n), in the order of element matrices."""
        cells, components, nodes = self.displaced.shape
        displaced = self.displaced.reshape(cells, components * nodes)
        return np.ascontiguousarray(np.concatenate([displaced, self.pressed], axis=1))

    @classmethod
    def of(cls, space: Any, components: int, cells: Index) -> Unknowns:
        """Return the positions for cells of the mixed space (u, p, ...).

        Parameters
        ----------
        space : Any
            DOLFINx's mixed space.
        components : int
            Components of the displacement.
        cells : Index
            Numbers of cells, shape (cells,).
        """
        displaced, pressed = (_unknowns(space.sub(i), cells) for i in range(2))
        by_node = displaced.reshape(len(cells), displaced.shape[1] // components, components)
        return cls(np.ascontiguousarray(by_node.transpose(0, 2, 1)), np.ascontiguousarray(pressed))


def _unknowns(part: Any, cells: Index) -> Index:
    """Unknowns of a part of a mixed space, those of a block in sequence; a rank may have no cells."""
    dofs = [part.dofmap.cell_dofs(cell) for cell in cells]
    return np.array(dofs, dtype=np.int32).reshape(len(cells), part.element.space_dimension)


@dataclass(frozen=True)
class QuadratureRule:
    """Points in the reference cell (p, d), and weights (p,) where something is integrated."""

    points: Array
    weights: Array

    @classmethod
    def gauss(cls, mesh: NamedMesh, degree: int) -> QuadratureRule:
        """Return the quadrature rule of the form compiler.

        Parameters
        ----------
        mesh : NamedMesh
            The mesh with its named boundaries.
        degree : int
            Degree of the quadrature.
        """
        return cls(*basix.make_quadrature(mesh.mesh.basix_cell(), degree))

    @classmethod
    def at(cls, points: Array) -> QuadratureRule:
        """Return points without weights, for evaluation only."""
        return cls(points, np.ones(len(points)))


def cells_may_fold(mesh: NamedMesh) -> bool:
    """Whether individual cells may fold, so that they need energies (`strain_gradient`, `forms.volumetric`).

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named boundaries.
    """
    return mesh.mesh.topology.cell_name() == "tetrahedron" and mesh.displacement_order > 1


def apart_from_bonds(mesh: NamedMesh, space: Any, cells: Index, bonds: Iterable[str]) -> NDArray[np.bool_]:
    """Return which rubber cells touch neither a bond nor metal, at whose edges the strains are unbounded.

    Parameters
    ----------
    mesh, space
        The mesh, and its mixed space with the displacement first.
    cells
        Numbers of the rubber's cells on this rank, shape (c,).
    bonds
        Names of the boundaries on which sleeves are prescribed.
    """
    facets = [mesh.facets.find(mesh.boundary[name]) for name in bonds if name in mesh.boundary]
    dimension = mesh.dimension
    on_bond = np.zeros(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, dtype=np.bool_)
    if facets:
        # Asks the other ranks for unknowns that lie on a bond of theirs.
        on_bond[
            fem.locate_dofs_topological(space.sub(0), dimension - 1, np.unique(np.concatenate(facets)))
        ] = True
    mesh.mesh.topology.create_connectivity(dimension, dimension)
    for name in mesh.sleeves:
        metal = mesh.cells.find(mesh.region[name])
        on_bond[fem.locate_dofs_topological(space.sub(0), dimension, metal)] = True
    return np.asarray(~on_bond[_unknowns(space.sub(0), cells)].any(axis=1))


def mixed_element(mesh: NamedMesh, components: int, followed: int) -> Any:
    """Return the Taylor-Hood element (u, p), with one more displacement for each boundary motion that energies need.

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named boundaries.
    components : int
        Components of the displacement.
    followed : int
        Number of boundaries whose motion is followed.
    """
    cell, order = mesh.mesh.basix_cell(), mesh.displacement_order
    displacement = basix.ufl.element("Lagrange", cell, order, shape=(components,))
    pressure = ("DG", 0) if order == 1 else ("Lagrange", order - 1)
    fields = [displacement, basix.ufl.element(pressure[0], cell, pressure[1])]
    return basix.ufl.mixed_element([*fields, *[displacement] * followed])
