"""Area at which metal holds the rubber, and how far drawn rigid sleeves continue beyond their bonds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from geometry.cad.axis import Axis, from_axis
from geometry.cad.bonds import SAME_RADIUS, radius_of
from geometry.cad.part import Part
from geometry.cad.roles import INNER, OUTER, RUBBER
from geometry.cad.sampling import Sampled, extent, sample
from geometry.connections import BONDS
from geometry.session import model

#: Lengths of a sleeve below and above its bond are the same if they differ by less than this share of the thickness
#: (judgement: an edge that bulges so far is pressed against the sleeve's very end).
EVEN = 0.01


def held_area(
    part: Part, roles: Mapping[int, str], meshed: Sequence[int], labels: Mapping[int, str]
) -> float:
    """Area of the rubber's faces that are bonded, to a rigid body or to a solid of metal, mm^2.

    Parameters
    ----------
    part, roles
        Solids of the file, and the role of each.
    meshed
        Solids that are meshed: the others are rigid.
    labels
        Face on the outside of the meshed solids -> name of its boundary.
    """
    rubber, other_faces = (
        Counter(
            face for solid in meshed if (roles[solid] == RUBBER) == is_rubber for face in _sides(3, solid)
        )
        for is_rubber in (True, False)
    )
    held_faces = [
        f for f, times in rubber.items() if times == 1 and (f in other_faces or labels.get(f) in BONDS)
    ]
    return sum(part.areas[f] if f in part.areas else float(model().occ.getMass(2, f)) for f in held_faces)


def beyond_bonds(
    part: Part,
    roles: Mapping[int, str],
    meshed: Sequence[int],
    bonds: Mapping[str, Sequence[Sampled]],
    axis: Axis,
) -> dict[str, tuple[float, float]]:
    """Return by how much rigid sleeves continue as cylinders below and above their bonds, mm, by bond.

    Parameters
    ----------
    part, roles
        Solids of the file, and the role of each.
    meshed
        Solids that are meshed: the others are rigid.
    bonds
        Sampled faces of each bond, mm.
    axis
        Axis of the bushing.
    """
    lengths = {}
    for bond, role in zip(BONDS, (INNER, OUTER), strict=True):
        solids = [tag for tag, solid_role in roles.items() if solid_role == role and tag not in meshed]
        faces = list(bonds[bond])
        bonded = {face.tag for face in faces}
        other_faces = {f for solid in solids for f in _sides(3, solid)} - bonded
        radius = float(np.mean([radius_of(face, axis) for face in faces]))
        coaxial = {
            face.tag: face
            for face in (sample(tag, part.size, 0.0) for tag in other_faces)
            if _is_cylinder(face, axis, radius)
        }
        if not coaxial or not all(_is_cylinder(face, axis, radius) for face in faces):
            continue
        continued, curves = set[int](), {c for face in bonded for c in _sides(2, face)}
        while neighbours := {tag for tag in coaxial.keys() - continued if curves & set(_sides(2, tag))}:
            continued |= neighbours
            curves |= {c for tag in neighbours for c in _sides(2, tag)}
        if continued:
            ends = extent(faces, axis.direction)
            low, high = extent([*faces, *(coaxial[tag] for tag in continued)], axis.direction)
            lengths[bond] = (ends[0] - low, high - ends[1])
    return lengths


def is_even(beyond: Mapping[str, tuple[float, float]], thickness: float) -> bool:
    """Whether sleeves continue alike below and above their bonds, as far as rubber that bulges can reach.

    Parameters
    ----------
    beyond
        Lengths below and above each bond, mm, as `beyond_bonds` returned them.
    thickness
        Size of the rubber across the bonds, mm: it bulges no farther than this.
    """
    ends = [[min(length, thickness) for length in lengths] for lengths in beyond.values()]
    return all(abs(above - below) < EVEN * thickness for below, above in ends)


def _sides(dimension: int, tag: int) -> list[int]:
    """Faces of a solid, or curves of a face."""
    return [int(side) for _, side in model().getBoundary([(dimension, tag)], oriented=False)]


def _is_cylinder(face: Sampled, axis: Axis, radius: float) -> bool:
    """Whether a face lies on the cylinder of this radius about the axis."""
    if face.kind != "Cylinder" or not len(face.points):
        return False
    radii = np.linalg.norm(from_axis(face.points, axis), axis=1)
    return bool(np.abs(radii - radius).max() < SAME_RADIUS * radius)
