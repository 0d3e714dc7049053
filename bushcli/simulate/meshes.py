"""The meshes that a case needs, for `bushcli mesh`: their numbers, faces for pictures, and files for ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from mpi4py import MPI

from bushcli.case import Case
from bushcli.errors import InputError, Problem
from cases.fields import write_mesh
from cases.mode import mode_of, modes, setting_for
from cases.stretches import Surface, mesh_surface
from geometry.mesh import build


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

    A case without either gets the meshes of all bushing modes.

    Parameters
    ----------
    case : Case
        A case without load cases and recordings gets the meshes of all modes of its specimen.
    directory : Path
        Folder for the XDMF files; created if necessary.
    comm : MPI.Comm
        Ranks that share each mesh.
    """
    asked = {load.mode: mode_of(load.mode, load.six) for load in case.load_cases}
    asked |= {test.mode: mode_of(test.mode, test.six and test.six.whole_body) for test in case.vibrations}
    asked |= {source.mode: modes()[source.mode] for source in case.recordings}
    specimen = case.geometry.specimen
    alone = {name: mode for name, mode in modes().items() if mode.specimen == specimen and not mode.follow}
    wanted: dict[tuple[int, frozenset[str]], list[str]] = {}
    planes = case.geometry.mirror_planes
    for name, mode in sorted((asked or alone).items()):
        dimension = 2 if mode.section is not None and case.geometry.axisymmetric else 3
        mirrors = setting_for(mode, dimension).mirrors & planes
        wanted.setdefault((dimension, mirrors), []).append(name)
    if comm.rank == 0:
        directory.mkdir(parents=True, exist_ok=True)
    comm.barrier()
    return tuple(
        _build(case, directory, dimension, mirrors, tuple(served), comm)
        for (dimension, mirrors), served in wanted.items()
    )


def _build(
    case: Case,
    directory: Path,
    dimension: int,
    mirrors: frozenset[str],
    served: tuple[str, ...],
    comm: MPI.Comm,
) -> Meshed:
    mesh = build(case.geometry, dimension, mirrors, case.mesh.refinement, comm)  # type: ignore[arg-type]
    kind = "solid" if dimension == 3 else "section" if case.geometry.annulus is not None else "half-plane"
    name = "-".join([kind, *(f"cut-{plane}" for plane in sorted(mirrors))])
    file = directory / f"mesh-{name}.xdmf"
    try:
        write_mesh(mesh, file)
    except (OSError, RuntimeError) as error:  # HDF5 raises the second on a full disk
        raise InputError(Problem(str(file), f"cannot be written: {error}", "", "give another -o")) from None
    topology = mesh.mesh.topology

    def count(tags: object, tag: int, owned: int) -> int:
        found = tags.find(tag)  # type: ignore[attr-defined]
        return int(comm.allreduce(int((found < owned).sum())))

    cells, facets = topology.index_map(dimension).size_local, topology.index_map(dimension - 1).size_local
    return Meshed(
        name=name,
        modes=served,
        dimension=dimension,
        cells=topology.index_map(dimension).size_global,
        nodes=mesh.mesh.geometry.index_map().size_global,
        boundaries={key: count(mesh.facets, tag, facets) for key, tag in mesh.boundary.items()},
        regions={key: count(mesh.cells, tag, cells) for key, tag in mesh.region.items()},
        surface=mesh_surface(mesh),
    )
