"""A mesh as arrays, with names: mirrored at planes of symmetry, revolved about the axis, handed to Gmsh.

Only the smallest repeated piece of a part is meshed, and the part is put together from mirror images of it, so that it
is symmetric to the last digit whatever planes of symmetry a load leaves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array
from geometry.session import model

Ints = NDArray[np.int64]

# Gmsh's numbers of element types.
LINE2, TRIANGLE3, QUADRANGLE4, TETRAHEDRON4, HEXAHEDRON8 = 1, 2, 3, 4, 5
LINE3, TRIANGLE6, QUADRANGLE9, TETRAHEDRON10, HEXAHEDRON27 = 8, 9, 10, 11, 12
#: Type of the facets for each type of cell.
FACET = {
    TRIANGLE3: LINE2,
    QUADRANGLE4: LINE2,
    TETRAHEDRON4: TRIANGLE3,
    HEXAHEDRON8: QUADRANGLE4,
    TRIANGLE6: LINE3,
    QUADRANGLE9: LINE3,
    TETRAHEDRON10: TRIANGLE6,
    HEXAHEDRON27: QUADRANGLE9,
}
DIMENSION = {TRIANGLE3: 2, QUADRANGLE4: 2, TRIANGLE6: 2, QUADRANGLE9: 2}


@dataclass(frozen=True)
class RawMesh:
    """Nodes, cells and named facets.

    Attributes
    ----------
    points : shape (n, 3)
        mm; (r, z, 0) in the half-plane.
    kind
        Gmsh's number of the cells' type.
    cells, facets : mapping
        Region or boundary -> nodes, shape (m, nodes of one), in Gmsh's order.
    """

    points: Array
    kind: int
    cells: Mapping[str, Ints]
    facets: Mapping[str, Ints] = field(default_factory=dict)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return DIMENSION.get(self.kind, 3)


def from_gmsh(regions: Mapping[str, Sequence[int]], boundaries: Mapping[str, Sequence[int]]) -> RawMesh:
    """Read the mesh of the open session: entities by name of region and of boundary.

    Every region must be meshed with one and the same type of cell.

    Parameters
    ----------
    regions : Mapping[str, Sequence[int]]
        Entities of each region by name.
    boundaries : Mapping[str, Sequence[int]]
        Entities of each boundary by name.
    """
    mesh = model().mesh
    tags, coordinates, _ = mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    dimension = max(d for d, _ in model().getEntities())

    def elements_of(d: int, entities: Sequence[int]) -> tuple[int, Ints]:
        kinds, blocks = set(), []
        for entity in entities:
            for kind, _, nodes in zip(*mesh.getElements(d, entity), strict=True):
                size = mesh.getElementProperties(kind)[3]
                kinds.add(int(kind))
                blocks.append(number[nodes.astype(np.int64)].reshape(-1, size))
        if len(kinds) != 1:
            raise ValueError(f"elements of {len(kinds)} types where one was expected")
        return kinds.pop(), np.concatenate(blocks)

    elements = {name: elements_of(dimension, entities) for name, entities in regions.items()}
    facets = {
        name: elements_of(dimension - 1, entities)[1] for name, entities in boundaries.items() if entities
    }
    return _compact(
        RawMesh(
            coordinates.reshape(-1, 3),
            next(iter(elements.values()))[0],
            {name: cells for name, (_, cells) in elements.items()},
            facets,
        )
    )


def _compact(mesh: RawMesh) -> RawMesh:
    """Leave out nodes that no cell has, such as centres of arcs."""
    used_nodes = np.unique(np.concatenate([cells.ravel() for cells in mesh.cells.values()]))
    number = np.full(len(mesh.points), -1, dtype=np.int64)
    number[used_nodes] = np.arange(len(used_nodes))
    return replace(
        mesh,
        points=mesh.points[used_nodes],
        cells={name: number[cells] for name, cells in mesh.cells.items()},
        facets={name: number[facets] for name, facets in mesh.facets.items()},
    )


def add_mirror_image(mesh: RawMesh, component: int, plane: str) -> RawMesh:
    """Join a mesh and its mirror image; the boundary `plane` is then inside the mesh and loses its name.

    Parameters
    ----------
    mesh
        Mesh on one side of the plane where a coordinate vanishes.
    component
        That coordinate: 0, 1 or 2.
    plane
        Name of the boundary in it.
    """
    on = np.zeros(len(mesh.points), dtype=bool)
    if plane in mesh.facets:
        on[mesh.facets[plane].ravel()] = True
    points = mesh.points.copy()
    points[on, component] = 0.0
    image_nodes = np.arange(len(points))
    image_nodes[~on] = len(points) + np.arange(int((~on).sum()))
    reflected = points[~on]
    reflected[:, component] *= -1.0

    def both(parts: Mapping[str, Ints]) -> dict[str, Ints]:
        return {
            name: np.concatenate([nodes, image_nodes[nodes]])
            for name, nodes in parts.items()
            if name != plane
        }

    return replace(
        mesh, points=np.concatenate([points, reflected]), cells=both(mesh.cells), facets=both(mesh.facets)
    )


def revolve(section: RawMesh, angles: Array) -> RawMesh:
    """Sweep a section of second-order quadrilaterals about the axis: second-order hexahedra.

    Parameters
    ----------
    section
        Mesh in the half-plane (r, z).
    angles : shape (2 n + 1,)
        Angles of corners and mid-side nodes in turn, rad. A full circle is closed; a smaller angle ends in the
        boundaries "mirror_y" (an end at a multiple of pi) and "mirror_x".
    """
    closed = bool(np.isclose(angles[-1] - angles[0], 2 * np.pi))
    layers = len(angles) - 1 if closed else len(angles)
    count = len(section.points)
    r, z = section.points[:, 0], section.points[:, 1]
    points = np.concatenate([np.column_stack([r * np.cos(a), r * np.sin(a), z]) for a in angles[:layers]])
    solid, face = _layer_table(HEXAHEDRON27, QUADRANGLE9), _layer_table(QUADRANGLE9, LINE3)

    def sweep(nodes: Ints, table: tuple[Ints, Ints]) -> Ints:
        where, layer = table
        parts = [nodes[:, where] + count * ((2 * k + layer) % layers) for k in range((len(angles) - 1) // 2)]
        return np.concatenate(parts)

    facets = {name: sweep(nodes, face) for name, nodes in section.facets.items()}
    if not closed:
        everything = np.concatenate(list(section.cells.values()))
        for end, layer in ((angles[0], 0), (angles[-1], layers - 1)):
            name = "mirror_y" if abs(np.sin(end)) < 1e-9 else "mirror_x"
            cut_facets = everything + count * layer
            facets[name] = np.concatenate([facets[name], cut_facets]) if name in facets else cut_facets
    # Nodes in a plane of symmetry are put exactly there: the computed sine of pi is not zero.
    points[np.abs(points) < 1e-12 * np.abs(points).max()] = 0.0
    cells = {name: sweep(nodes, solid) for name, nodes in section.cells.items()}
    return RawMesh(points, HEXAHEDRON27, cells, facets)


def _layer_table(kind: int, base: int) -> tuple[Ints, Ints]:
    """For each node of a swept element: its node in the element that was swept, and its layer (0, 1 or 2)."""

    def nodes(of: int) -> Array:
        properties = model().mesh.getElementProperties(of)
        return np.asarray(properties[4]).reshape(-1, properties[1])

    cell_nodes, below = nodes(kind), nodes(base)
    distance = np.linalg.norm(cell_nodes[:, None, :-1] - below[None, :, :], axis=2)
    return np.argmin(distance, axis=1), np.rint(cell_nodes[:, -1] + 1.0).astype(np.int64)


def to_gmsh(mesh: RawMesh) -> dict[int, dict[str, int]]:
    """Write the mesh into the open session's model; physical groups by dimension and name."""
    gmsh_model = model()
    gmsh_model.add("arrays")
    dimension = mesh.dimension
    names: dict[int, dict[str, int]] = {dimension: {}, dimension - 1: {}}
    tag, element = 0, 1
    for d, kind, parts in (
        (dimension, mesh.kind, mesh.cells),
        (dimension - 1, FACET[mesh.kind], mesh.facets),
    ):
        for name, nodes in parts.items():
            if not len(nodes):
                continue
            tag += 1
            gmsh_model.addDiscreteEntity(d, tag)
            if element == 1:
                gmsh_model.mesh.addNodes(d, tag, np.arange(1, len(mesh.points) + 1), mesh.points.ravel())
            elements = np.arange(element, element + len(nodes))
            gmsh_model.mesh.addElementsByType(tag, kind, elements, (nodes + 1).ravel())
            element += len(nodes)
            names[d][name] = gmsh_model.addPhysicalGroup(d, [tag], name=name)
    return names


#: Corners beside each mid-side node, in Gmsh's order.
SIDES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
#: Least determinant over that of the straight element.
LEAST = 0.1
ROUNDS = 10


def straighten_folds(mesh: RawMesh) -> RawMesh:
    """Put the mid-side nodes of folded elements into the middle of their sides."""
    if mesh.kind != TETRAHEDRON10:
        return mesh
    points = mesh.points.copy()
    cells = np.concatenate(list(mesh.cells.values()))
    for _ in range(ROUNDS):
        folded_cells = cells[_is_folded(points[cells])]
        if not len(folded_cells):
            break
        for node, (a, b) in enumerate(SIDES, start=4):
            points[folded_cells[:, node]] = 0.5 * (points[folded_cells[:, a]] + points[folded_cells[:, b]])
    return replace(mesh, points=points)


def _is_folded(x: Array) -> Array:
    """Whether the determinant of the chart is too small at a node of an element; x has shape (n, 10, 3)."""
    coordinates = np.vstack([np.eye(4), [[0.5 * (i in side) for i in range(4)] for side in SIDES]])
    slope = np.vstack([-np.ones(3), np.eye(3)])  # of the barycentric coordinates
    derivative = np.zeros((10, 10, 3))
    for k in range(4):
        derivative[:, k] = (4 * coordinates[:, k] - 1)[:, None] * slope[k]
    for k, (i, j) in enumerate(SIDES, start=4):
        derivative[:, k] = 4 * (coordinates[:, i, None] * slope[j] + coordinates[:, j, None] * slope[i])
    curved = np.linalg.det(np.einsum("pki,nkj->npij", derivative, x))
    straight_volume = np.linalg.det(x[:, 1:4] - x[:, :1])
    return np.asarray((curved / straight_volume[:, None]).min(axis=1) < LEAST)
