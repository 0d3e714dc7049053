"""A found section -> mesh: one block of quadrilaterals where possible, else graded triangles; or either revolved."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from geometry.blocks import Array
from geometry.errors import GeometryError
from geometry.estimate import Fine, triangles
from geometry.grading import Sizes, grade
from geometry.isolated import isolated, seconds_for
from geometry.raw import RawMesh, add_mirror_image, from_gmsh, revolve, to_gmsh
from geometry.section.block import block
from geometry.section.draw import Drawn, draw
from geometry.section.find_section import FoundSection
from geometry.section.outline import RUBBER
from geometry.session import convert_errors, model, options, session
from geometry.shape import Mirrors, Names, Refinement

# Elements from bond to bond in the interior, longest over shortest, growth per distance from a bond's edge, elements on
# a full circle of the outline; with these, sections of the references are within 1 % (benchmarks/README.md).
ACROSS, GRADING, GROWTH, PER_CIRCLE = 4.0, 6.0, 0.35, 10.0
# The same where the section is revolved, and elements around a full circle.
SOLID_ACROSS, SOLID_GRADING, SOLID_GROWTH, AROUND = 3.0, 4.0, 0.6, 12


def generate(
    section: FoundSection, where: str, dimension: int, mirrors: Mirrors, refinement: Refinement
) -> Names:
    """Mesh a section, or the solid that it sweeps, into the open session.

    Parameters
    ----------
    section : FoundSection
        Interpretation of the file.
    where : str
        File or key of the case, for messages.
    dimension : int
        2 for the half-plane, 3 for the solid.
    mirrors : Mirrors
        Planes of symmetry at which the solid is cut, by their normals.
    refinement : Refinement
        Number of elements in each direction.

    Raises
    ------
    GeometryError
    """
    if dimension == 3 and section.smallest_radius == 0.0:
        raise GeometryError(
            where,
            "touches the axis: its solid is not a ring, and only axial and torsional loads can be computed",
            "a section with r > 0, or the part as CAD",
        )
    raw = section_mesh(section, where, refinement, quadrilaterals=dimension == 3)
    if section.symmetric and "z" not in mirrors:
        raw = add_mirror_image(raw, 1, "mirror_z")
    if dimension == 3:
        raw = revolve(raw, _angles(mirrors, refinement))
    return to_gmsh(raw)


def _angles(mirrors: Mirrors, refinement: Refinement) -> Array:
    """Angles of corners and mid-side nodes around the modelled part, rad."""
    share = 0.25 if {"x", "y"} <= mirrors else 0.5 if mirrors & {"x", "y"} else 1.0
    around = max(2, math.ceil(share * refinement.elements(refinement.around, AROUND)))
    start_angle = -0.5 * math.pi if "x" in mirrors and "y" not in mirrors else 0.0
    return start_angle + np.linspace(0.0, share * 2 * math.pi, 2 * around + 1)


def section_cells(section: FoundSection, dimension: int, mirrors: Mirrors, refinement: Refinement) -> float:
    """About how many triangles, or hexahedra of the revolved solid, `generate` will make.

    Parameters
    ----------
    section : FoundSection
        Interpretation of the file.
    dimension : int
        2 for the half-plane, 3 for the solid.
    mirrors : Mirrors
        Planes of symmetry at which the solid is cut, by their normals.
    refinement : Refinement
        Number of elements in each direction.
    """
    solid = dimension == 3
    across, grading, growth = (
        (SOLID_ACROSS, SOLID_GRADING, SOLID_GROWTH) if solid else (ACROSS, GRADING, GROWTH)
    )
    factor = refinement.factor * (1.0 if refinement.across is None else refinement.across / across)
    inside = section.thickness / (across * factor)
    per_circle = PER_CIRCLE * math.sqrt(factor)
    # Four ends of bonds: the finer elements at further ends, those of plates, are not counted.
    fine = [Fine(0, 4.0, inside / grading)]
    for length, radius in section.curved:
        size = min(2.0 * math.pi * radius / per_circle, length)
        fine.append(Fine(1, length, max(size, 0.2 * inside / grading)))
    total = triangles(section.areas[RUBBER], inside, growth, fine)
    # Elements of plates have other sizes, between these (`_narrow`).
    total += sum(
        triangles(area, 0.5 * inside, growth, ()) for name, area in section.areas.items() if name != RUBBER
    )
    if section.symmetric and "z" in mirrors:
        total /= 2.0
    return 0.5 * total * 0.5 * (len(_angles(mirrors, refinement)) - 1) if solid else total


def _seconds(
    section: FoundSection, where: str, refinement: Refinement, quadrilaterals: bool = False
) -> float:
    return seconds_for(section_cells(section, 2, frozenset(), refinement))


@isolated("the section cannot be meshed", lambda section, where, *_, **__: where, _seconds)
def section_mesh(
    section: FoundSection, where: str, refinement: Refinement, quadrilaterals: bool = False
) -> RawMesh:
    """Mesh the section, or its upper half where it is symmetric; second order, in the half-plane (r, z).

    Parameters
    ----------
    section : FoundSection
        Interpretation of the file.
    where : str
        File or key of the case, for messages.
    refinement : Refinement
        Number of elements in each direction.
    quadrilaterals : bool
        Mesh with quadrilaterals instead of triangles.
    """
    with session():
        return _section_mesh(section, where, refinement, quadrilaterals)


def _section_mesh(section: FoundSection, where: str, refinement: Refinement, quadrilaterals: bool) -> RawMesh:
    drawn = draw(section.loops, where, half=section.symmetric)
    across = SOLID_ACROSS if quadrilaterals else ACROSS
    factor = refinement.factor * (1.0 if refinement.across is None else refinement.across / across)
    structured = block(drawn, refinement, solid=quadrilaterals)
    if structured is not None:
        return structured
    inside = section.thickness / (across * factor)
    grading, growth = (SOLID_GRADING, SOLID_GROWTH) if quadrilaterals else (GRADING, GROWTH)
    sizes = Sizes(inside, inside / grading, growth, PER_CIRCLE * math.sqrt(factor), _narrow(drawn, inside))
    grade(2, bond_ends(drawn), sizes)
    if quadrilaterals:
        # Blossom recombination leaves some triangles, from which a subdivision makes quadrilaterals: it halves all
        # sizes.
        options().setNumber("Mesh.RecombineAll", 1)
        options().setNumber("Mesh.RecombinationAlgorithm", 1)
        options().setNumber("Mesh.SubdivisionAlgorithm", 1)
        options().setNumber("Mesh.MeshSizeFactor", 2.0)
        options().setNumber("Mesh.Algorithm", 8)
    with convert_errors(where, "the section cannot be meshed", section.view):
        model().mesh.generate(2)
    model().mesh.setOrder(2)
    return from_gmsh(drawn.regions, drawn.boundaries)


def bond_ends(drawn: Drawn) -> list[int]:
    """Points where rubber ends on a bond or on metal: the stress is singular there."""
    free = _points([t for name, tags in drawn.boundaries.items() if not _is_held(name) for t in tags])
    bonded = _points([t for name, tags in drawn.boundaries.items() if _is_held(name) for t in tags])
    metal = _points(
        [c for name, tags in drawn.regions.items() if name != RUBBER for t in tags for c in _sides(t)]
    )
    rubber = _points([c for tag in drawn.regions[RUBBER] for c in _sides(tag)])
    return sorted(free & rubber & (bonded | metal))


def _is_held(name: str) -> bool:
    return name in ("inner", "outer")


def _sides(face: int) -> list[int]:
    return [int(tag) for _, tag in model().getBoundary([(2, face)], oriented=False)]


def _points(curves: Sequence[int]) -> set[int]:
    return {
        int(tag)
        for curve in curves
        if not _is_mirror(curve)
        for _, tag in model().getBoundary([(1, curve)], oriented=False)
    }


def _is_mirror(curve: int) -> bool:
    box = model().getBoundingBox(1, curve)
    return bool(max(abs(box[1]), abs(box[4])) < 1e-6 and len(model().getAdjacencies(1, curve)[0]) == 1)


def _narrow(drawn: Drawn, inside: float) -> dict[int, float]:
    """Return element sizes on the curves around thin plates, so that some elements fit across them."""
    sizes: dict[int, float] = {}
    for name, faces in drawn.regions.items():
        if name == RUBBER:
            continue
        for face in faces:
            around = sum(model().occ.getMass(1, c) for c in _sides(face))
            thick = 2.0 * model().occ.getMass(2, face) / around
            if thick < inside:
                sizes |= dict.fromkeys(_sides(face), max(thick, 0.2 * inside))
    return sizes
