"""Surfaces of a bushing that can come into contact: facets of the mesh, and rigid ones that continue the sleeves.

References
----------
Wriggers (2006), Computational Contact Mechanics, 2nd ed., Springer, doi:10.1007/978-3-540-32609-0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx.mesh import exterior_facet_indices
from numpy.typing import NDArray

from cases.contact.facets import Basis
from geometry.dolfinx_api import cell_nodes
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Degree of the quadrature of contact: contact ends within facets, which more points resolve better.
DEGREE = 6
# Points of two facets may face each other if the cosine between the facets' normals is below this; facets are curved.
MAYBE = -0.1


@dataclass(frozen=True)
class Patch:
    """Facets of a mesh with their nodes.

    Attributes
    ----------
    basis : Basis
    facets : shape (f, n)
        Numbers of nodes, in the order of the basis.
    sign : shape (f,)
        Sign that makes the normal given by the order of the reference coordinates point outward.
    X : shape (nodes, d)
        Coordinates on the mesh, mm.
    dofs : shape (nodes, d)
        Unknown of each component of a node's displacement, this rank's numbers.
    where : shape (nodes, 2)
        Index in `cells` of a cell that has the node, and the number of the node in that cell.
    cells : shape (c,)
        Cells that the facets belong to.
    points : shape (m, d)
        Nodes of the displacement's element in the reference cell.
    names : shape (f,)
        Name of the boundary that each facet belongs to; empty where it has none.
    """

    basis: Basis
    facets: Ints
    sign: Array
    X: Array
    dofs: Ints
    where: Ints
    cells: NDArray[np.int32]
    points: Array
    names: NDArray[np.str_]


def exterior(mesh: NamedMesh) -> Ints:
    """Numbers of the facets with one cell, without those on planes of symmetry."""
    inner = mesh.mesh
    inner.topology.create_connectivity(mesh.dimension - 1, mesh.dimension)
    facets = exterior_facet_indices(inner.topology)
    cut = [name for name in mesh.boundary if name.startswith("mirror_")]
    return np.setdiff1d(facets, facets_of(mesh, cut)).astype(np.int64)


def facets_of(mesh: NamedMesh, names: Iterable[str]) -> Ints:
    """Numbers of the facets of named boundaries.

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named boundaries.
    names : iterable of str
        Names of boundaries; those that the mesh lacks have no facets.
    """
    facets = [mesh.facets.find(mesh.boundary[name]) for name in names if name in mesh.boundary]
    return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *facets])).astype(np.int64)


def on_region(mesh: NamedMesh, facets: Ints, region: str) -> Ints:
    """Return the facets, of those given, that belong to a region.

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named regions.
    facets : shape (n,)
        Numbers of facets.
    region : str
        Its name.
    """
    cells, _ = _owners(mesh, facets)
    return facets[np.isin(cells, mesh.cells.find(mesh.region[region]))]


def patch(mesh: NamedMesh, space: Any, facets: Ints, components: tuple[int, ...]) -> Patch:
    """Return these facets of a mesh.

    Parameters
    ----------
    mesh, space
        The mesh, and its mixed space with the displacement first.
    facets
        Numbers of the facets.
    components
        Components of the displacement, one for each coordinate.
    """
    d, kind = mesh.dimension, mesh.mesh.basix_cell()
    element = space.sub(0).element.basix_element
    order = mesh.displacement_order
    cells, local = _owners(mesh, facets)
    facet_kind = basix.cell.subentity_types(kind)[d - 1][0]
    basis = Basis.of(facet_kind.name, order)
    closures = _closures(element, kind, d, basis)
    unique_cells, place = np.unique(cells, return_inverse=True)
    dofs, X = _nodes_of_cells(mesh, space, unique_cells, element.points)
    local_nodes = closures[local]
    numbers = dofs[place[:, None], local_nodes]
    _, indices, names = np.unique(numbers[..., 0], return_index=True, return_inverse=True)
    where = np.column_stack([np.repeat(place, local_nodes.shape[1])[indices], local_nodes.ravel()[indices]])
    inward = X.mean(axis=1)[place] - X[place[:, None], local_nodes].mean(axis=1)
    centre_slopes = basis.slopes(basis.nodes.mean(axis=0)[None])[0]
    normal = normals(np.einsum("an,fnd->fad", centre_slopes, X[place[:, None], local_nodes]))
    return Patch(
        basis,
        names.reshape(local_nodes.shape).astype(np.int64),
        -np.sign(np.einsum("fd,fd->f", normal, inward)),
        X[where[:, 0], where[:, 1]],
        dofs[where[:, 0], where[:, 1]][:, list(components)],
        where,
        unique_cells.astype(np.int32),
        element.points,
        _names(mesh, facets),
    )


def _names(mesh: NamedMesh, facets: Ints) -> NDArray[np.str_]:
    """Return the name of each facet's boundary; empty if it has none."""
    names = np.full(len(facets), "", dtype="<U64")
    for name in mesh.boundary:
        names[np.isin(facets, facets_of(mesh, [name]))] = name
    return names


def places(mesh: NamedMesh, of: Patch) -> Array:
    """Return the positions of a patch's nodes on a mesh of the same elements, mm, shape (nodes, d).

    Parameters
    ----------
    mesh : NamedMesh
        The mesh, whose nodes may have moved.
    of : Patch
        Facets of that mesh.
    """
    X = _coordinates(mesh, of.cells.astype(np.int64), of.points)
    return X[of.where[:, 0], of.where[:, 1]]


def normals(slope: Array) -> Array:
    """Normals of facets with tangents (f, a, d), as long as the facets' measure; the tangents' order gives the sign."""
    if slope.shape[-1] == 2:
        return np.stack([slope[:, 0, 1], -slope[:, 0, 0]], axis=-1)
    return np.asarray(np.cross(slope[:, 0], slope[:, 1]), dtype=np.float64)


def rule(basis: Basis) -> tuple[Array, Array]:
    """Quadrature of a facet: points (q, a), and weights for its measure in the reference facet."""
    points, weights = basix.make_quadrature(basix.CellType[basis.kind], DEGREE)
    return np.asarray(points), np.asarray(weights)


def _owners(mesh: NamedMesh, facets: Ints) -> tuple[Ints, Ints]:
    """Cell of each facet, and the number of the facet within the cell."""
    topology, d = mesh.mesh.topology, mesh.dimension
    topology.create_connectivity(d, d - 1)
    up, down = topology.connectivity(d - 1, d), topology.connectivity(d, d - 1)
    cells = np.array([up.links(facet)[0] for facet in facets], dtype=np.int64)
    local = [int(np.flatnonzero(down.links(c) == f)[0]) for c, f in zip(cells, facets, strict=True)]
    return cells, np.array(local, dtype=np.int64)


def _closures(element: Any, kind: Any, d: int, basis: Basis) -> Ints:
    """For each facet of the reference cell, the numbers of its nodes in the element, in the order of the basis."""
    corners, rows = basix.geometry(kind), []
    for vertices, nodes in zip(basix.topology(kind)[d - 1], element.entity_closure_dofs[d - 1], strict=True):
        origin = corners[vertices[0]]
        axes = np.array([corners[v] - origin for v in vertices[1:d]])
        flat = (element.points[nodes] - origin) @ np.linalg.pinv(axes)
        distance = np.linalg.norm(flat[None, :, :] - basis.nodes[:, None, :], axis=2)
        rows.append(np.asarray(nodes)[np.argmin(distance, axis=1)])
    return np.array(rows, dtype=np.int64)


def _nodes_of_cells(mesh: NamedMesh, space: Any, cells: Ints, points: Array) -> tuple[Ints, Array]:
    """Unknowns (cells, nodes, components) of cells, and coordinates of their nodes (cells, nodes, d)."""
    part = space.sub(0)
    cell_dofs = np.array([part.dofmap.cell_dofs(int(cell)) for cell in cells], dtype=np.int64)
    dofs = cell_dofs.reshape(len(cells), len(points), -1)
    return dofs, _coordinates(mesh, cells, points)


def _coordinates(mesh: NamedMesh, cells: Ints, points: Array) -> Array:
    """Coordinates of points of the reference cell in cells, shape (cells, points, d)."""
    coordinate = mesh.mesh.ufl_domain().ufl_coordinate_element().sub_elements[0].basix_element
    N = coordinate.tabulate(0, points)[0, :, :, 0]
    corners = mesh.mesh.geometry.x[cell_nodes(mesh.mesh)[cells]][..., : mesh.dimension]
    return np.asarray(np.einsum("mn,cnd->cmd", N, corners), dtype=np.float64)
