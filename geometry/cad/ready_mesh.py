"""A finished mesh, from a .msh file of Gmsh or an Abaqus .inp: its groups are the names of regions and boundaries."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array
from geometry.cad.axis import Axis
from geometry.cad.frame import frame_of, vector_text
from geometry.cad.measure import TETRAHEDRON, area, triangles, volume
from geometry.cad.segment import refuse_segment
from geometry.connections import bonds_touch_error
from geometry.errors import GeometryError
from geometry.isolated import isolated
from geometry.raw import HEXAHEDRON8, TETRAHEDRON4, TETRAHEDRON10, RawMesh
from geometry.size import refuse_size
from geometry.view import View
from geometry.wall import Wall, cylindrical, wall_of

Ints = NDArray[np.int64]
Vector = tuple[float, float, float]
SUFFIXES = (".msh", ".inp")
#: Remedy for a mesh of impossible size.
UNIT = 'unit = "mm", "cm", "m" or "inch": that of the numbers in the file; absent = mm'
#: Types of cells by meshio's names.
KINDS = {"tetra": TETRAHEDRON4, "tetra10": TETRAHEDRON10, "hexahedron": HEXAHEDRON8}
#: Nodes of the facets of a cell: corners first, then the middles of the sides, then the centre.
_HEXAHEDRON = ((0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7))
_CONTINUED = re.compile(r"^\*[A-Za-z](?:[^\n]*,[ \t\r]*\n(?!\*))+[^\n]*", re.M)
FREE, RUBBER = "free", "rubber"
#: Spread of the normals along the axis, over that across it, up to which an inner bond is a cylinder.
UPRIGHT = 0.15
#: A fitted axis with a direction cosine this near to 1 (2.5 degrees) is replaced by a coordinate axis: facets are flat.
ALONG = 1e-3


@dataclass(frozen=True)
class ReadyMesh:
    """A mesh from a file, in the bushing's coordinates (mm), with every outer facet named.

    Attributes are those of `FoundPart`; nothing is cut at planes of symmetry.
    """

    raw: RawMesh
    measures: Mapping[str, float]
    view: View
    notes: tuple[str, ...]
    wall: Wall | None
    planes: frozenset[Literal["x", "y", "z"]] = frozenset()

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the groups of cells."""
        return tuple(self.raw.cells)


@lru_cache(maxsize=4)
@isolated("cannot be read as a mesh", lambda path, *_: path)
def read_mesh(
    path: Path,
    changed: float,
    scale: float,
    axis: Vector | None,
    origin: Vector | None,
    direction: Vector | None,
) -> ReadyMesh:
    """Read a mesh with groups "inner" and "outer" (of facets, elements' faces or nodes).

    Parameters
    ----------
    path : Path
        The file.
    changed : float
        Time of the file's last change, s since 1970: a file that was changed is read again.
    scale : float
        mm per unit of the file.
    axis, origin, direction : Vector | None
        As in the case; the axis is otherwise fitted to the inner bond.

    Raises
    ------
    GeometryError
        It cannot be read, or the groups are not there.
    """
    mesh = _read(path)
    kinds = [kind for kind in KINDS if any(block.type == kind for block in mesh.cells)]
    solids = {block.type for block in mesh.cells if block.dim == 3}
    if len(kinds) != 1 or solids != set(kinds):
        cell_types = ", ".join(sorted({block.type for block in mesh.cells})) or "no elements"
        raise GeometryError(
            str(path), f"holds {cell_types}", "tetrahedra of 4 or 10 nodes or hexahedra of 8, one type only"
        )
    points = scale * np.asarray(mesh.points, dtype=float)[:, :3]
    refuse_size(float(np.ptp(points, axis=0).max()), str(path), UNIT)
    cells = _regions(mesh, kinds[0], str(path))
    all_cells = np.concatenate(list(cells.values()))
    outer = _outer_facets(all_cells, kinds[0])
    facets = _boundaries(mesh, outer, str(path))
    _refuse_loose(points, all_cells, facets, str(path))
    line = _axis(points, facets["inner"], axis, str(path))
    _refuse_segment(points, facets, line, str(path))
    centre = line.point if origin is None else np.array(origin, dtype=float)
    frame = frame_of(line.direction, centre, None if direction is None else np.array(direction, dtype=float))
    points = frame.local(points)
    raw = RawMesh(points, KINDS[kinds[0]], cells, facets)
    measures = {name: volume(points, nodes) for name, nodes in cells.items()}
    measures |= {
        f"{name}_bond" if name in ("inner", "outer") else name: area(points, nodes)
        for name, nodes in facets.items()
    }
    notes = (
        f"{len(all_cells)} elements ({kinds[0]}) as they are; groups: {', '.join((*cells, *facets))}",
        f"axis {'given' if axis else 'fitted to the inner bond'}: direction {vector_text(frame.rows[2])} through "
        f"{vector_text(frame.centre)} mm, the bushing's centre",
        f"a radial load acts along {vector_text(frame.rows[0])}",
    )
    bonds = {name: cylindrical(points[np.unique(facets[name])]) for name in ("inner", "outer")}
    return ReadyMesh(raw, measures, _view(points, facets), notes, wall_of(bonds))


def _refuse_segment(points: Array, facets: Mapping[str, Ints], axis: Axis, where: str) -> None:
    if FREE in facets:
        t = triangles(points, facets[FREE])
        normals: Array = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]).astype(np.float64)
        refuse_segment(points, normals, t[:, 0], axis, where, _view(points, facets))


def _refuse_loose(points: Array, cells: Ints, facets: Mapping[str, Ints], where: str) -> None:
    """Refuse bodies that are held by no bond, bonds that no elements join by common nodes, and bonds that touch."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first_nodes = np.repeat(cells[:, 0], cells.shape[1])
    graph = coo_array(
        (np.ones(first_nodes.size), (first_nodes, cells.ravel())), shape=(len(points), len(points))
    )
    _, body = connected_components(graph, directed=False)
    bodies_by_bond = {name: set(body[facets[name]].ravel().tolist()) for name in ("inner", "outer")}
    loose_bodies = sorted(set(body[cells[:, 0]].tolist()) - bodies_by_bond["inner"] - bodies_by_bond["outer"])
    if loose_bodies:
        x, y, z = points[body == loose_bodies[0]].mean(axis=0)
        raise GeometryError(
            where,
            f"elements around ({x:.4g}, {y:.4g}, {z:.4g}) are held by no bond: they share no nodes with those that are",
            "one body, or bodies that share nodes",
            _view(points, facets),
        )
    if not bodies_by_bond["inner"] & bodies_by_bond["outer"]:
        raise GeometryError(
            where,
            "nothing joins the inner bond to the outer one: no elements lead from one to the other by common nodes",
            "bodies that share nodes where they touch",
            _view(points, facets),
        )
    common = np.intersect1d(facets["inner"], facets["outer"])
    if len(common):
        raise bonds_touch_error(points[common[0]], where, _view(points, facets))


def _axis(points: Array, inner: Ints, given_axis: Vector | None, where: str) -> Axis:
    """The line that the normals of the inner bond meet, through the bond's middle."""
    t = triangles(points, inner)
    normals = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    if given_axis is None:
        _, spread, rows = np.linalg.svd(normals / np.linalg.norm(normals, axis=1, keepdims=True))
        direction = rows[-1] * np.sign(rows[-1][np.argmax(np.abs(rows[-1]))])
        if spread[-1] > UPRIGHT * spread[0]:
            raise GeometryError(
                where, "the inner bond is not a cylinder: the axis cannot be found", "give geometry.axis"
            )
        if np.abs(direction).max() > 1 - ALONG:
            direction = np.rint(direction)
    else:
        direction = np.array(given_axis, dtype=float)
    direction = direction / np.linalg.norm(direction)
    middle = t.mean(axis=1)
    left = np.vstack([np.cross(normals, direction), direction])
    right = np.append(np.einsum("ij,ij->i", normals, np.cross(direction, middle)), 0.0)
    point, *_ = np.linalg.lstsq(left, right, rcond=None)
    coordinates = points[np.unique(inner)] @ direction
    return Axis(point + 0.5 * (coordinates.min() + coordinates.max()) * direction, direction)


def _read(path: Path) -> Any:
    import meshio

    try:
        with tempfile.TemporaryDirectory() as folder:
            mesh_path = path
            if path.suffix.lower() == ".inp":
                mesh_path = Path(folder) / path.name
                # Gmsh writes facets as plane stress, which meshio does not know with six nodes.
                text = path.read_text(encoding="utf-8", errors="replace")
                # A line of a keyword that ends in a comma is continued on the next one.
                text = _CONTINUED.sub(lambda match: " ".join(match[0].split()), text)
                mesh_path.write_text(re.sub(r"(type\s*=\s*)CP[SE]6", r"\1STRI65", text, flags=re.I))
            return meshio.read(mesh_path)
    except (meshio.ReadError, OSError, ValueError, KeyError, IndexError, AssertionError, SystemExit) as error:
        # meshio calls `exit(1)` where no format fits.
        words = str(error).strip() if isinstance(error, (meshio.ReadError, OSError)) else ""
        if path.stat().st_size == 0:
            words = "it is empty"
        raise GeometryError(str(path), f"cannot be read as a mesh{words and f': {words}'}") from None


def _groups(mesh: Any) -> dict[str, list[Any]]:
    """Return the cell sets by lower-case name: for each block of cells, indices within it."""
    groups = {name.lower(): parts for name, parts in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    numbers = mesh.cell_data.get("gmsh:physical")
    if not groups and numbers is not None:
        # Of files of Gmsh's format 2 meshio makes no sets: each element has the number of its group.
        for name, (number, dimension) in mesh.field_data.items():
            groups[name.lower()] = [
                np.flatnonzero(labels == number) if block.dim == dimension else None
                for labels, block in zip(numbers, mesh.cells, strict=True)
            ]
    return groups


def _regions(mesh: Any, kind: str, where: str) -> dict[str, Ints]:
    """Cells by region; those in no group are rubber, and so are those in a group of rubber and in another one."""
    blocks = [(i, block) for i, block in enumerate(mesh.cells) if block.type == kind]
    count = sum(len(block.data) for _, block in blocks)
    metal: dict[str, list[Ints]] = {}
    taken = {i: np.zeros(len(block.data), dtype=bool) for i, block in blocks}
    groups = {name: parts for name, parts in _groups(mesh).items() if _members(parts, blocks) < count}
    for name, parts in groups.items():
        for i, _ in blocks:
            if "rubber" in name and parts[i] is not None:
                taken[i][np.asarray(parts[i], dtype=np.int64)] = True
    rubber = {i: mask.copy() for i, mask in taken.items()}
    for name, parts in groups.items():
        if name in ("inner", "outer") or "rubber" in name or name.startswith("_") or name == "all":
            continue
        for i, block in blocks:
            inside = np.asarray(parts[i] if parts[i] is not None else [], dtype=np.int64)
            if len(inside) and not taken[i][inside].any():
                taken[i][inside] = True
                metal.setdefault(name, []).append(block.data[inside])
    regions = {RUBBER: [block.data[rubber[i] | ~taken[i]] for i, block in blocks]} | metal
    # meshio has the order of VTK, in which the last two sides of a tetrahedron are exchanged against Gmsh.
    order = [*range(8), 9, 8] if kind == "tetra10" else slice(None)
    cells = {name: np.concatenate(parts).astype(np.int64)[:, order] for name, parts in regions.items()}
    if not len(cells[RUBBER]):
        raise GeometryError(
            where,
            f"all elements are in groups of metal: {', '.join(metal)}",
            "a group of elements named rubber, or rubber in no group",
        )
    return cells


def _members(parts: list[Any], blocks: list[tuple[int, Any]]) -> int:
    """Number of cells of a group."""
    return sum(len(parts[i]) for i, _ in blocks if parts[i] is not None)


def _outer_facets(cells: Ints, kind: str) -> Ints:
    """Facets that belong to one cell only, with all their nodes."""
    tables = _facet_tables(kind)
    all_facets = np.concatenate([cells[:, list(table)] for table in tables])
    corners = 3 if kind.startswith("tetra") else 4
    keys = np.sort(all_facets[:, :corners], axis=1)
    _, indices, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return np.asarray(all_facets[indices[count == 1]], dtype=np.int64)


def _facet_tables(kind: str) -> list[tuple[int, ...]]:
    if kind == "tetra":
        return [table[:3] for table in TETRAHEDRON]
    if kind == "tetra10":
        return list(TETRAHEDRON)
    return list(_HEXAHEDRON)


def _boundaries(mesh: Any, outer: Ints, where: str) -> dict[str, Ints]:
    """Outer facets by name, from groups of facets or of nodes."""
    label = np.full(len(outer), FREE, dtype=object)
    boundaries = {}
    for name in ("inner", "outer"):
        nodes = _nodes_of(mesh, name)
        corners = outer[:, : 3 if outer.shape[1] in (3, 6) else 4]
        on_boundary = np.isin(corners, nodes).all(axis=1) if len(nodes) else np.zeros(len(outer), dtype=bool)
        label[on_boundary] = name
        boundaries[name] = bool(on_boundary.any())
    missing = [name for name, has_facets in boundaries.items() if not has_facets]
    if missing:
        group_names = (
            ", ".join(sorted({*_groups(mesh), *(name.lower() for name in mesh.point_sets)})) or "none"
        )
        raise GeometryError(
            where,
            f'no outer facets are in a group "{missing[0]}": the rubber would not be held',
            f"groups of facets or nodes named inner and outer; there are: {group_names}",
        )
    return {name: outer[label == name] for name in ("inner", "outer", FREE) if np.any(label == name)}


def _nodes_of(mesh: Any, name: str) -> Ints:
    """Nodes of a group, whether it holds nodes or facets."""
    nodes: list[Ints] = []
    for key, members in mesh.point_sets.items():
        if key.lower() == name:
            nodes.append(np.asarray(members).ravel())
    for i, part in enumerate(_groups(mesh).get(name, [])):
        if part is not None and len(part) and mesh.cells[i].dim == 2:
            nodes.append(mesh.cells[i].data[np.asarray(part, dtype=np.int64)].ravel())
    return np.unique(np.concatenate(nodes)).astype(np.int64) if nodes else np.zeros(0, dtype=np.int64)


def _view(points: Array, facets: Mapping[str, Ints]) -> View:
    parts = [triangles(points, nodes) for nodes in facets.values()]
    label = np.concatenate([np.full(len(part), i) for i, part in enumerate(parts)])
    return View(np.concatenate(parts), label, tuple(facets))
