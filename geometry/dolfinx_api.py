"""Differences between the DOLFINx releases that bushcli runs on; all other modules are the same for every release.

The module is in this package because meshes are the first to need it, and `cases` may import `geometry`. It does not
load DOLFINx before one of its functions is called: `bushcli check` needs the version only.

``Expression.eval`` needs no function here: since 0.10 it returns the shape (cells, points, values), before that the
last two axes were one, and all callers reshape the result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: First and last release that the tests have run on: DOLFINx renames things with each one.
TRIED = ((0, 9), (0, 11))


def is_tried(version: str) -> bool:
    """Whether a version ("0.11.0.post0") belongs to one of the releases that bushcli was tried with."""
    return TRIED[0] <= release(version) <= TRIED[1]


def release(version: str) -> tuple[int, int]:
    """Release of a version: (0, 11) of "0.11.0.post0"."""
    major, minor = version.split(".")[:2]
    return int(major), int(minor)


def model_to_mesh(model: Any, comm: Any, dimension: int) -> tuple[Any, Any, Any]:
    """Distribute the Gmsh model of rank 0, without ghost cells: mesh, cell tags, facet tags.

    Parameters
    ----------
    model : Any
        Gmsh's model.
    comm : Any
        Ranks that share the mesh.
    dimension : int
        2 for the half-plane, 3 for the solid.
    """
    from dolfinx.mesh import GhostMode, create_cell_partitioner

    try:
        # 0.10 renamed `gmshio`.
        from dolfinx.io import gmsh as reader
    except ImportError:
        from dolfinx.io import gmshio as reader
    try:
        # 0.11 requires the largest number of cells at a facet, two; 0.10 assumed it, 0.9 has no such argument.
        partitioner = create_cell_partitioner(GhostMode.none, 2)
    except TypeError:
        partitioner = create_cell_partitioner(GhostMode.none)
    result = reader.model_to_mesh(model, comm, 0, gdim=dimension, partitioner=partitioner)
    # Since 0.10 the result is a named tuple with more members than these three.
    return tuple(result) if type(result) is tuple else (result.mesh, result.cell_tags, result.facet_tags)


def cell_nodes(mesh: Any) -> Any:
    """Nodes of each cell of a mesh, shape (cells, nodes)."""
    # 0.11 has one table for each type of cell, and the old name will be removed.
    geometry = mesh.geometry
    return geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap


def mesh_order(mesh: Any) -> int:
    """Return the order of a mesh's cells: 1 for straight ones, 2 for curved ones."""
    # `cmap` is deprecated from 0.11 on.
    maps = getattr(mesh.geometry, "cmaps", None)
    return int((maps[0] if maps else mesh.geometry.cmap).degree)


def collapse(space: Any) -> tuple[Any, NDArray[np.int32]]:
    """Return a part of a mixed space as a space of its own, and its unknowns' numbers in the mixed space."""
    import numpy as np

    subspace, dofs = space.collapse()
    # 0.11 has one list of numbers for each type of cell; a mesh has one type here.
    return subspace, np.asarray(dofs, dtype=np.int32).reshape(-1)


def interpolation_points(element: Any) -> Any:
    """Points of a finite element at which a function is evaluated to interpolate it, shape (n, dimension)."""
    points = element.interpolation_points
    # 0.10 made a property of the method.
    return points() if callable(points) else points
