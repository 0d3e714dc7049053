"""The meshes that a case needs, for `bushcli mesh`: their numbers, faces for pictures, and files for ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mpi4py import MPI

from bushcli.case import Case
from bushcli.case.loads import Load
from bushcli.errors import InputError, Problem
from cases.fields import write_mesh
from cases.mode import modes, setting_for
from cases.stretches import Surface, mesh_surface
from geometry.mesh import build
from geometry.shape import Mirrors


@dataclass(frozen=True)
class Meshed:
    """One mesh.

    Attributes
    ----------
    name : str
        "section" (half-plane) or "solid", and the planes at which it is cut.
    modes : tuple of str
        Modes that it serves.
    dimension, cells, nodes : int
    boundaries, regions : mapping
        Name -> number of facets, of cells.
    surface : Surface or None
        For pictures; on rank 0 only.
    """

    name: str
    modes: tuple[str, ...]
    dimension: int
    cells: int
    nodes: int
    boundaries: Mapping[str, int]
    regions: Mapping[str, int]
    surface: Surface | None = field(default=None, repr=False)


def meshes(case: Case, directory: Path, comm: MPI.Comm = MPI.COMM_WORLD) -> tuple[Meshed, ...]:
    """Build every mesh that the load cases and recordings of a case need, and write each as XDMF.

    Parameters
    ----------
    case : Case
        A case without load cases and recordings gets the meshes of all modes of its specimen.
    directory : Path
        Folder for the XDMF files; created if necessary.
    comm : MPI.Comm
        Ranks that share each mesh.
    """
    loads: tuple[Load, ...] = (*case.load_cases, *case.vibrations)
    simulated = {load.mode: load.simulated_mode for load in loads}
    simulated |= {source.mode: modes()[source.mode] for source in case.recordings}
    shape = case.geometry
    every = {name: m for name, m in modes().items() if m.specimen == shape.specimen and not m.follow}
    modes_by_mesh: dict[tuple[int, Mirrors], list[str]] = {}
    for name, mode in sorted((simulated or every).items()):
        dimension = 2 if mode.section is not None and shape.axisymmetric else 3
        mirrors = setting_for(mode, dimension).mirrors & shape.mirror_planes
        modes_by_mesh.setdefault((dimension, mirrors), []).append(name)
    if comm.rank == 0:
        directory.mkdir(parents=True, exist_ok=True)
    comm.barrier()
    built = []
    for (dimension, mirrors), served in modes_by_mesh.items():
        mesh = build(case.geometry, dimension, mirrors, case.mesh.refinement, comm)
        kind = "solid" if dimension == 3 else "section" if case.geometry.annulus is not None else "half-plane"
        name = "-".join([kind, *(f"cut-{plane}" for plane in sorted(mirrors))])
        file = directory / f"mesh-{name}.xdmf"
        try:
            write_mesh(mesh, file)
        except (OSError, RuntimeError) as error:  # HDF5 raises the second on a full disk
            what = f"cannot be written: {error}"
            raise InputError(Problem(str(file), what, "", "give another -o")) from None
        topology, counts = mesh.mesh.topology, []
        boundaries, regions = (mesh.facets, mesh.boundary), (mesh.cells, mesh.region)
        for dim, (tags, tag_of_name) in ((dimension - 1, boundaries), (dimension, regions)):
            owned = topology.index_map(dim).size_local
            of_rank = {key: int((tags.find(tag) < owned).sum()) for key, tag in tag_of_name.items()}
            counts.append({key: int(comm.allreduce(count)) for key, count in of_rank.items()})
        cells, nodes = topology.index_map(dimension).size_global, mesh.mesh.geometry.index_map().size_global
        facets_of, cells_of = counts
        body = name, tuple(served), dimension, cells, nodes
        built.append(Meshed(*body, facets_of, cells_of, mesh_surface(mesh)))
    return tuple(built)
