"""Bonded faces: known from adjacent solids, rules, names or colours, or found by their position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from geometry.cad.axis import Axis, from_axis, is_coaxial
from geometry.cad.part import Part
from geometry.cad.roles import INNER, OUTER, RUBBER
from geometry.cad.rules import Rule, hexadecimal, selected
from geometry.cad.sampling import Sampled
from geometry.cad.triangles import view_of
from geometry.errors import GeometryError
from geometry.joined import BONDS
from geometry.session import model

FREE = "free"
#: Coaxial faces whose radii differ by less than this share belong to the same bond (halves of a cylinder).
SAME_RADIUS = 0.01
#: A coaxial face counts as a bond where its normals have at least this radial part: not an end face, not a chamfer.
RADIAL = 0.8
#: Where bonds are found by position, faces of one radius count if their area is at least this share of the largest.
LARGE = 0.5
#: Most radii, names or colours that a message lists.
MOST_SHOWN = 8


@dataclass(frozen=True)
class Bonds:
    """Name of every outer face of the meshed body, and a description of how each bond was found."""

    labels: dict[int, str]
    how: dict[str, str]


def find_bonds(
    part: Part,
    roles: Mapping[int, str],
    meshed: Sequence[int],
    faces: Sequence[Sampled],
    axis: Axis,
    rules: Mapping[str, Sequence[Rule]],
) -> Bonds:
    """Name the faces.

    Parameters
    ----------
    part, roles
        Solids of the file, and the role of each.
    meshed
        Solids that are meshed: the others are rigid.
    faces
        Sampled faces on the outside of the meshed solids.
    axis
        Axis of the bushing.
    rules
        Rules of the case, by bond.

    Raises
    ------
    GeometryError
        A rule selects no face beside others that do, or a face belongs to both bonds.
    """
    labels = {face.tag: FREE for face in faces}
    how: dict[str, str] = {}
    for bond in BONDS:
        found, words = _bond(bond, part, roles, meshed, faces, axis, rules.get(bond, ()))
        twice = [tag for tag in found if labels[tag] != FREE]
        if twice:
            raise GeometryError(
                "geometry.bonds",
                f"the inner and the outer bond have {len(twice)} face{'s' * (len(twice) > 1)} in common",
                "rules of which each selects the faces of one bond",
                view_of({tag: "both" if tag in twice else label for tag, label in labels.items()}),
            )
        if found:
            labels |= dict.fromkeys(found, bond)
            how[bond] = words
    return Bonds(labels, how)


def _bond(
    bond: str,
    part: Part,
    roles: Mapping[int, str],
    meshed: Sequence[int],
    faces: Sequence[Sampled],
    axis: Axis,
    rules: Sequence[Rule],
) -> tuple[list[int], str]:
    """Faces of a bond, and how they were found."""
    if rules:
        each = [selected([rule], faces, axis, part.size, part.face_names, part.colours) for rule in rules]
        found = sorted({tag for tags in each for tag in tags})
        if [] in each:
            wrong = each.index([])
            which = f"rule {wrong + 1} of {len(each)}" if len(each) > 1 else "the rule"
            raise GeometryError(
                f"geometry.bonds.{bond}",
                f"{which} ({rules[wrong].text}) selects no face",
                f"rules that each select a face; there are {selectable(faces, axis, part)}",
                view_of({face.tag: bond if face.tag in found else FREE for face in faces}),
            )
        return found, "by the case's rules"
    sleeve = INNER if bond == "inner" else OUTER
    solids = [tag for tag, role in roles.items() if role == sleeve]
    if solids:
        if any(tag in meshed for tag in solids):
            own = [face for face in faces if _owner(face.tag) in solids]
            return _extreme(own, axis, part.size, bond), f"the solid {sleeve}: its face away from the rubber"
        beside = {t for tag in solids for _, t in model().getBoundary([(3, tag)], oriented=False)}
        return [face.tag for face in faces if face.tag in beside], f"where the solid {sleeve} touches"
    named = [face.tag for face in faces if part.face_names.get(face.tag, "").lower().startswith(bond)]
    if named:
        return named, "by the names of faces in the file"
    coloured = _coloured(bond, part, faces, axis)
    if coloured:
        return coloured, "by the colours of faces in the file"
    rubber = [face for face in faces if roles.get(_owner(face.tag)) == RUBBER]
    side = "nearest to" if bond == "inner" else "farthest from"
    return _extreme(rubber, axis, part.size, bond), f"found: the large coaxial faces {side} the axis"


def selectable(faces: Sequence[Sampled], axis: Axis, part: Part) -> str:
    """Return what rules can select: radii of cylinders about the axis, names and colours of faces.

    Parameters
    ----------
    faces : sequence of Sampled
        Faces on the outside of the meshed solids.
    axis : Axis
    part : Part
    """
    radii = sorted(
        {
            float(f"{np.linalg.norm(from_axis(face.points, axis), axis=1).mean():.4g}")
            for face in faces
            if face.kind == "Cylinder" and is_coaxial(face, axis, part.size)
        }
    )
    names = sorted({name for face in faces if (name := part.face_names.get(face.tag, ""))})
    colours = sorted({hexadecimal(part.colours[face.tag]) for face in faces if face.tag in part.colours})
    shown = [
        ("cylinders about the axis of radius {} mm", [f"{radius:g}" for radius in radii]),
        ("faces named {}", names),
        ("faces in {}", colours),
    ]
    said = [text.format(", ".join(found[:MOST_SHOWN])) for text, found in shown if found]
    return "; ".join(said) or "no cylinders about the axis, names or colours"


def _owner(face: int) -> int:
    return int(model().getAdjacencies(2, face)[0][0])


def _coloured(bond: str, part: Part, faces: Sequence[Sampled], axis: Axis) -> list[int]:
    """Return, of two colours on the faces, the one nearer to the axis or farther from it."""
    groups: dict[tuple[int, int, int], list[Sampled]] = {}
    for face in faces:
        if face.tag in part.colours:
            groups.setdefault(part.colours[face.tag], []).append(face)
    if len(groups) != 2:
        return []
    ordered = sorted(groups.values(), key=lambda group: float(np.mean([_radius(f, axis) for f in group])))
    return [face.tag for face in ordered[0 if bond == "inner" else 1]]


def _radius(face: Sampled, axis: Axis) -> float:
    return float(np.linalg.norm(from_axis(face.points, axis), axis=1).mean())


def _extreme(faces: Sequence[Sampled], axis: Axis, size: float, bond: str) -> list[int]:
    """Return the coaxial faces that face the axis and are nearest to it, or face away and are farthest."""
    toward = -1.0 if bond == "inner" else 1.0
    radii: dict[int, float] = {}
    for face in faces:
        if not is_coaxial(face, axis, size):
            continue
        radial = from_axis(face.points, axis)
        radial /= np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-12 * size)
        if float(np.mean(toward * np.einsum("ij,ij->i", radial, face.normals))) > RADIAL:
            radii[face.tag] = _radius(face, axis)
    if not radii:
        return []
    areas = {face.tag: face.area for face in faces}
    groups = {
        tag: [other for other, r in radii.items() if abs(r - radius) <= SAME_RADIUS * radius]
        for tag, radius in radii.items()
    }
    sizes = {tag: sum(areas[other] for other in group) for tag, group in groups.items()}
    # The rim of a collar is farther from the axis than the bond: small faces are ignored.
    large = [tag for tag, own in sizes.items() if own >= LARGE * max(sizes.values())]
    return groups[max(large, key=lambda tag: toward * radii[tag])]
