"""Gmsh: from the blocks of a shape to a structured mesh with named boundaries and regions.

The only place where a Gmsh session opens and closes.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI

from geometry.dolfinx_api import model_to_mesh
from geometry.shape import Array, Blocks, Mirrors, Refinement, Shape, Sleeve

DEFAULT = Refinement()


@dataclass(frozen=True)
class NamedMesh:
    """A distributed mesh whose boundaries and regions have names.

    Attributes
    ----------
    mesh
        DOLFINx mesh; coordinates in mm; dimension 2 is the half-plane (R, Z).
    facets, cells
        Facet and cell tags.
    boundary, region
        Name -> tag.
    sleeves
        Elastic sleeves by region name.
    displacement_order
        Polynomial degree that the shape asks of the displacement.
    shape
        What is meshed.
    mirrors
        Planes of symmetry at which the mesh is cut.
    """

    mesh: Any
    facets: Any
    cells: Any
    boundary: Mapping[str, int]
    region: Mapping[str, int]
    sleeves: Mapping[str, Sleeve]
    displacement_order: int
    shape: Shape
    mirrors: Mirrors = frozenset()

    @property
    def dimension(self) -> int:
        """2 (half-plane) or 3."""
        return int(self.mesh.topology.dim)


def build(
    shape: Shape,
    dimension: int = 3,
    mirrors: Mirrors = frozenset(),
    refinement: Refinement = DEFAULT,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> NamedMesh:
    """Mesh a shape.

    Parameters
    ----------
    shape
        What to mesh.
    dimension
        2 for the half-plane of a shape of revolution, 3 for the solid.
    mirrors
        Planes of symmetry at which the solid is cut.
    refinement
        Elements in each direction of the whole bushing.
    comm
        The mesh is built on rank 0 and distributed.

    Raises
    ------
    ValueError
        The shape cannot be cut at these planes, or is not one of revolution and `dimension` is 2.
    """
    if dimension == 2 and not shape.axisymmetric:
        raise ValueError(f"a {shape.name} shape is not one of revolution: it has no half-plane model")
    if not mirrors <= shape.mirror_planes:
        planes = ", ".join(sorted(mirrors - shape.mirror_planes))
        raise ValueError(f"a {shape.name} shape is not symmetric about the planes normal to {planes}")
    blocks = shape.blocks(dimension, mirrors, refinement)
    names: dict[int, dict[str, int]] = {dimension: {}, dimension - 1: {}}
    with _session():
        if comm.rank == 0:
            names = _mesh_blocks(blocks, order=2 if shape.displacement_order > 1 else 1)
        names = comm.bcast(names, root=0)
        mesh, cells, facets = _distributed(comm, dimension)
    return NamedMesh(
        mesh,
        facets,
        cells,
        names[dimension - 1],
        names[dimension],
        shape.elastic_sleeves,
        shape.displacement_order,
        shape,
        mirrors,
    )


@contextmanager
def _session() -> Iterator[None]:
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("bushing")
        yield
    finally:
        gmsh.finalize()


def _mesh_blocks(blocks: Blocks, order: int) -> dict[int, dict[str, int]]:
    """Mesh the box in units of one element, move the nodes through vertices and chart, name the entities."""
    from gmsh import model

    dimension = len(blocks.axes)
    # One unit of the index box is one element; `positions` maps indices to parameters, linearly inside an
    # element, so that mid-side nodes stay in the middle of graded elements.
    positions = [_positions(axis) for axis in blocks.axes]
    breaks = [np.cumsum([0, *(interval.elements for interval in axis)]) for axis in blocks.axes]
    solids = []
    for index in itertools.product(*(range(len(axis)) for axis in blocks.axes)):
        low = np.array([breaks[a][i] for a, i in enumerate(index)], dtype=float)
        high = np.array([breaks[a][i + 1] for a, i in enumerate(index)], dtype=float)
        name = blocks.region(_parameters(0.5 * (low + high), positions))
        if name is None:
            continue
        size = high - low
        if dimension == 2:
            solids.append((2, model.occ.addRectangle(*low, 0.0, *size)))
        else:
            solids.append((3, model.occ.addBox(*low, *size)))
    if len(solids) > 1:
        model.occ.fragment(solids[:1], solids[1:])
    model.occ.synchronize()
    names = {
        dimension: _name_regions(blocks, positions, dimension),
        dimension - 1: _name_faces(blocks, positions, dimension),
    }
    for _, curve in model.getEntities(1):
        box = np.array(model.getBoundingBox(1, curve))
        model.mesh.setTransfiniteCurve(curve, round(float(np.max(box[3:] - box[:3]))) + 1)
    for _, surface in model.getEntities(2):
        model.mesh.setTransfiniteSurface(surface)
        model.mesh.setRecombine(2, surface)
    for _, volume in model.getEntities(3):
        model.mesh.setTransfiniteVolume(volume)
    model.mesh.generate(dimension)
    # A mesh of order 2 has curved elements whose nodes all lie on the chart.
    model.mesh.setOrder(order)
    tags, coordinates, _ = model.mesh.getNodes()
    indices = coordinates.reshape(-1, 3)[:, :dimension]
    points = np.zeros((len(tags), 3))
    points[:, :dimension] = blocks.chart(_parameters(indices, positions))
    for tag, point in zip(tags, points, strict=True):
        model.mesh.setNode(tag, point, [])
    if blocks.closed:
        model.mesh.removeDuplicateNodes()
    return names


def _positions(axis: tuple[Any, ...]) -> Array:
    return np.concatenate([axis[0].vertices(), *(interval.vertices()[1:] for interval in axis[1:])])


def _parameters(indices: Array, positions: list[Array]) -> Array:
    columns = [np.interp(indices[..., a], np.arange(len(p)), p) for a, p in enumerate(positions)]
    return np.stack(columns, axis=-1)


def _middle(dimension: int, tag: int, positions: list[Array]) -> tuple[Array, Array]:
    """Extent (in elements) and midpoint (in parameters) of an entity."""
    from gmsh import model

    box = np.array(model.getBoundingBox(dimension, tag)).reshape(2, 3)[:, : len(positions)]
    return box[1] - box[0], _parameters(box.mean(axis=0), positions)


def _name_regions(blocks: Blocks, positions: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension):
        name = blocks.region(_middle(dimension, tag, positions)[1])
        assert name is not None
        members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension, tags, name=name) for name, tags in members.items()}


def _name_faces(blocks: Blocks, positions: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    ends = [(p[0], p[-1]) for p in positions]
    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension - 1):
        if len(model.getAdjacencies(dimension - 1, tag)[0]) != 1:
            continue
        extent, middle = _middle(dimension - 1, tag, positions)
        axis = int(np.argmin(extent))
        if blocks.closed and axis == 1 and np.isclose(middle[1], ends[1]).any():
            continue
        name = blocks.face(axis, middle)
        if name is not None:
            members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension - 1, tags, name=name) for name, tags in members.items()}


def _distributed(comm: MPI.Comm, dimension: int) -> tuple[Any, Any, Any]:
    from gmsh import model

    return model_to_mesh(model, comm, dimension)
