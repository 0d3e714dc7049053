"""A found part -> graded second-order tetrahedra in the bushing's coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from geometry.cad.bonds import FREE
from geometry.cad.cut import cut
from geometry.cad.find_part import CadStatements, FoundPart, find_part
from geometry.cad.frame import vector_text
from geometry.cad.measure import TETRAHEDRON
from geometry.cad.part import open_part
from geometry.cad.roles import RUBBER
from geometry.errors import GeometryError
from geometry.estimate import Fine, tetrahedra
from geometry.grading import Sizes, grade
from geometry.isolated import isolated, seconds_for
from geometry.raw import Ints, RawMesh, add_mirror_image, from_gmsh, straighten_folds, to_gmsh
from geometry.session import convert_errors, model, session
from geometry.shape import Mirrors, Names, Refinement
from geometry.view import View

# Elements from bond to bond in the interior, longest over shortest, growth per distance from a bond's edge, elements on
# a full circle, elements between two faces that are near to each other (benchmarks/README.md).
ACROSS, GRADING, GROWTH, PER_CIRCLE, BETWEEN = 2.4, 4.0, 1.0, 8.0, 1.2


def generate(statements: CadStatements, mirrors: Mirrors, refinement: Refinement) -> Names:
    """Mesh a part into the open session.

    Parameters
    ----------
    statements : CadStatements
        The file and what the case states about it.
    mirrors : Mirrors
        Planes of symmetry at which the solid is cut, by their normals.
    refinement : Refinement
        Number of elements in each direction.

    Raises
    ------
    GeometryError
    """
    part = find_part(statements)
    raw = part_mesh(statements, refinement)
    for component, plane in enumerate("xyz"):
        if plane in part.planes and plane not in mirrors:
            raw = add_mirror_image(raw, component, f"mirror_{plane}")
    refuse_flat(raw, str(statements.path), part.view)
    return to_gmsh(raw)


def refuse_flat(raw: RawMesh, where: str, view: View | None) -> None:
    """Refuse a mesh in which facets of the boundary are not those that belong to one element only.

    Gmsh makes triangles without area where edges are too short for its tolerance. In a plane of symmetry their mirror
    image is the same triangle, and DOLFINx ends the process where it gets such a mesh.

    Parameters
    ----------
    raw : RawMesh
        Mesh of tetrahedra.
    where : str
        The file.
    view : View | None
        Contents of a picture.

    Raises
    ------
    GeometryError
    """
    cells = np.concatenate(list(raw.cells.values()))
    count = len(raw.points)

    def keys(corners: Ints) -> Ints:
        a, b, c = np.sort(corners[:, :3], axis=1).T
        return np.asarray((a * count + b) * count + c)

    sides, times = np.unique(
        np.concatenate([keys(cells[:, list(side[:3])]) for side in TETRAHEDRON]), return_counts=True
    )
    facets = np.concatenate(list(raw.facets.values()))
    facet_keys, twice = np.unique(keys(facets), return_counts=True)
    wrong_keys = np.concatenate([np.setxor1d(sides[times == 1], facet_keys), facet_keys[twice > 1]])
    if len(wrong_keys):
        place = raw.points[
            [wrong_keys[0] // count**2, wrong_keys[0] // count % count, wrong_keys[0] % count]
        ].mean(axis=0)
        raise GeometryError(
            where,
            f"cannot be meshed: an element near {vector_text(place)} mm from the bushing's centre has no volume",
            "another mesh.elements_across, or a part without such short edges",
            view,
        )


def part_cells(part: FoundPart, mirrors: Mirrors, refinement: Refinement) -> float:
    """About how many tetrahedra `generate` will make.

    Parameters
    ----------
    part : FoundPart
        Interpretation of the file.
    mirrors : Mirrors
        Planes of symmetry at which the solid is cut, by their normals.
    refinement : Refinement
        Number of elements in each direction.
    """
    factor = _factor(refinement)
    inside, edge = _lengths(part, factor)
    fine = [Fine(1, part.edges, edge)]
    for face, (area, radius) in part.curved.items():
        around = 2.0 * math.pi * radius / (PER_CIRCLE * math.sqrt(factor))
        between = max(part.narrow.get(face, math.inf) / (BETWEEN * factor), 0.25 * inside)
        # A face has at least one element, whatever its size.
        fine.append(Fine(2, area, max(min(around, between, math.sqrt(area)), 0.2 * edge)))
    volume = sum(part.measures[name] for name in part.regions)
    cut = len(part.planes & mirrors)
    return tetrahedra(volume, inside, GROWTH, fine) / 2**cut


def _factor(refinement: Refinement) -> float:
    return refinement.factor * (1.0 if refinement.across is None else refinement.across / ACROSS)


def _lengths(part: FoundPart, factor: float) -> tuple[float, float]:
    """Length of the elements in the interior, and at the edges of bonds, mm.

    Plates divide the rubber into layers, each of which needs its elements. Edges are not refined with the layers: of an
    error of 1.3 % radially that leaves 0.8 % for twice the time, and edges in proportion 0.4 % for five times the time
    (two layers of 5 mm, benchmarks/README.md).
    """
    inside = part.layer / (ACROSS * factor)
    return inside, min(inside, part.thickness / (ACROSS * GRADING * factor))


def _seconds(statements: CadStatements, refinement: Refinement) -> float:
    return seconds_for(part_cells(find_part(statements), frozenset(), refinement))


@lru_cache(maxsize=4)
@isolated("cannot be meshed", lambda statements, refinement: statements.path, _seconds)
def part_mesh(statements: CadStatements, refinement: Refinement) -> RawMesh:
    """Mesh the part that remains after cutting at all planes of symmetry; once for all modes.

    Parameters
    ----------
    statements : CadStatements
        The file and what the case states about it.
    refinement : Refinement
        Number of elements in each direction.

    Raises
    ------
    GeometryError
    """
    part = find_part(statements)
    with session():
        return _part_mesh(statements, part, refinement)


def _part_mesh(statements: CadStatements, part: FoundPart, refinement: Refinement) -> RawMesh:
    open_part(statements.path, statements.unit)
    regions, boundaries = cut(part)
    factor = _factor(refinement)
    inside, edge = _lengths(part, factor)
    face_sizes = {}
    for face, name in ((f, n) for n, faces in boundaries.items() for f, n in ((f, n) for f in faces)):
        gap = part.narrow.get(boundaries[name][face])
        if gap is not None:
            face_sizes[face] = float(np.clip(gap / (BETWEEN * factor), 0.25 * inside, inside))
    sizes = Sizes(inside, edge, GROWTH, PER_CIRCLE * math.sqrt(factor), face_sizes)
    grade(3, bond_edges(regions, boundaries), sizes)
    with convert_errors(str(statements.path), "cannot be meshed", part.view):
        model().mesh.generate(3)
    model().mesh.setOrder(2)
    raw = straighten_folds(from_gmsh(regions, {name: list(faces) for name, faces in boundaries.items()}))
    return replace(raw, points=_flat(raw, part.frame.local(raw.points)))


def _flat(raw: RawMesh, points: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """Move the nodes of mirror planes exactly into their planes."""
    for component, plane in enumerate("xyz"):
        if f"mirror_{plane}" in raw.facets:
            points[raw.facets[f"mirror_{plane}"].ravel(), component] = 0.0
    return points


def bond_edges(
    regions: Mapping[str, tuple[int, ...]], boundaries: Mapping[str, Mapping[int, int]]
) -> list[int]:
    """Curves where rubber ends on a bond or on metal: the stress is singular there.

    Parameters
    ----------
    regions : Mapping[str, tuple[int, ...]]
        Solids of each region by name.
    boundaries : Mapping[str, Mapping[int, int]]
        Faces of each boundary by name, each with the face of the whole part (`geometry.cad.cut`).
    """
    free = _curves(boundaries.get(FREE, {}))
    bond_curves = {
        c for name, faces in boundaries.items() if name in ("inner", "outer") for c in _curves(faces)
    }
    metal = {
        c
        for name, solids in regions.items()
        if name != RUBBER
        for solid in solids
        for c in _curves([int(t) for _, t in model().getBoundary([(3, solid)], oriented=False)])
    }
    rubber = {
        c
        for solid in regions[RUBBER]
        for c in _curves([int(t) for _, t in model().getBoundary([(3, solid)], oriented=False)])
    }
    return sorted(free & rubber & (bond_curves | metal))


def _curves(faces: Mapping[int, int] | list[int]) -> set[int]:
    return {
        int(tag)
        for face in faces
        for _, tag in model().getBoundary([(2, face)], combined=False, oriented=False)
    }
