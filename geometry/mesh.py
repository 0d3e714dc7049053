"""From a shape to a distributed mesh with named boundaries and regions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

from geometry.dolfinx_api import model_to_mesh
from geometry.errors import GeometryError
from geometry.metal import Metal
from geometry.session import model, session
from geometry.shape import Mirrors, Names, Refinement, Shape

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
        Polynomial degree that the shape requires of the displacement.
    shape
        The meshed shape.
    mirrors
        Planes of symmetry at which the mesh is cut.
    """

    mesh: Any
    facets: Any
    cells: Any
    boundary: Mapping[str, int]
    region: Mapping[str, int]
    sleeves: Mapping[str, Metal]
    displacement_order: int
    shape: Shape
    mirrors: Mirrors = frozenset()

    @property
    def dimension(self) -> int:
        """2 (half-plane) or 3."""
        return int(self.mesh.topology.dim)

    @property
    def simplices(self) -> bool:
        """Whether the cells are triangles or tetrahedra."""
        return self.mesh.basix_cell().name in ("triangle", "tetrahedron")

    @property
    def corners(self) -> int:
        """Corners of a cell, which come first among its nodes."""
        return self.dimension + 1 if self.simplices else 2**self.dimension


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
        The shape to mesh.
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
    GeometryError
        An outline or a CAD file cannot be meshed.
    """
    if dimension == 2 and not shape.axisymmetric:
        raise ValueError(f"a {shape.name} shape is not a body of revolution: it has no half-plane model")
    if not mirrors <= shape.mirror_planes:
        planes = ", ".join(sorted(mirrors - shape.mirror_planes))
        raise ValueError(f"a {shape.name} shape is not symmetric about the planes normal to {planes}")
    # Before the session opens, because a shape may need a session of its own to find its sleeves.
    sleeves = shape.elastic_sleeves
    with session():
        names = _generate_on_rank_0(shape, dimension, mirrors, refinement, comm)
        mesh, cells, facets = model_to_mesh(model(), comm, dimension)
    return NamedMesh(
        mesh,
        facets,
        cells,
        names[dimension - 1],
        names[dimension],
        sleeves,
        shape.displacement_order,
        shape,
        mirrors,
    )


def _generate_on_rank_0(
    shape: Shape, dimension: int, mirrors: Mirrors, refinement: Refinement, comm: MPI.Comm
) -> Names:
    """Fill the session of rank 0; every rank learns the names, or why there is no mesh."""
    outcome: Names | GeometryError = {}
    if comm.rank == 0:
        try:
            outcome = shape.generate(dimension, mirrors, refinement)
        except GeometryError as error:
            outcome = error
    outcome = comm.bcast(outcome, root=0)
    if isinstance(outcome, GeometryError):
        raise outcome
    return outcome
