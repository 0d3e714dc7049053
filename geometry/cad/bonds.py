"""Bonded faces: known from adjacent solids, rules, names or colours, or found by their position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from geometry.blocks import Array
from geometry.cad.axis import Axis, distance_between, from_axis, is_coaxial, own_line
from geometry.cad.part import Part
from geometry.cad.roles import INNER, OUTER, RUBBER
from geometry.cad.rules import STRAIGHT, Rule, hexadecimal, matching_faces
from geometry.cad.sampling import Sampled
from geometry.cad.triangles import view_of
from geometry.connections import BONDS
from geometry.errors import GeometryError
from geometry.session import model

FREE = "free"
#: Coaxial faces whose radii differ by less than this share belong to the same bond (halves of a cylinder).
SAME_RADIUS = 0.01
#: A coaxial face counts as a bond where its normals have at least this radial part: not an end face, not a chamfer.
RADIAL = 0.8
#: Where bonds are found by position, faces of one radius count if their area is at least this share of the largest.
LARGE = 0.5
#: How a bond was found by colours.
COLOURS = "by the colours of faces in the file"
#: Most radii, names or colours that a message lists.
MOST_SHOWN = 8


@dataclass(frozen=True)
class Bonds:
    """Name of every outer face of the meshed body, and a description of how each bond was found.

    Attributes
    ----------
    labels : dict of int to str
    how : dict of str to str
    unused : tuple of str
        Colours of faces from which no bond was taken, as "#rrggbb".
    """

    labels: dict[int, str]
    how: dict[str, str]
    unused: tuple[str, ...] = ()


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
        A rule selects no face beside others that do, a face belongs to both bonds, or the inner bond is outside.
    """
    labels = {face.tag: FREE for face in faces}
    how: dict[str, str] = {}
    faces_by_bond = {
        bond: _bond(bond, part, roles, meshed, faces, axis, rules.get(bond, ())) for bond in BONDS
    }
    for bond, other_bond in zip(BONDS, reversed(BONDS), strict=True):
        tags, words = faces_by_bond[bond]
        if (
            rules.get(bond)
            and all(rule.is_box for rule in rules[bond])
            and not any(rule.is_box for rule in rules.get(other_bond, ()))
        ):
            # A box around an outer face contains the inner one, too, which the other bond names more precisely.
            tags = [tag for tag in tags if tag not in faces_by_bond[other_bond][0]]
        twice = [tag for tag in tags if labels[tag] != FREE]
        if twice:
            raise GeometryError(
                "geometry.bonds",
                f"the inner and the outer bond have {len(twice)} face{'s' * (len(twice) > 1)} in common",
                "rules for each bond that select none of the other bond's faces",
                view_of({tag: "both" if tag in twice else label for tag, label in labels.items()}),
            )
        if tags:
            labels |= dict.fromkeys(tags, bond)
            how[bond] = words
    _refuse_exchanged(labels, faces, axis)
    by_colour = COLOURS in how.values() or any(
        rule.colour for bond_rules in rules.values() for rule in bond_rules
    )
    colours = {hexadecimal(part.colours[tag]) for tag in labels if tag in part.colours}
    return Bonds(labels, how, () if by_colour else tuple(sorted(colours)))


def _refuse_exchanged(labels: Mapping[int, str], faces: Sequence[Sampled], axis: Axis) -> None:
    radii = {
        bond: [
            d
            for f in faces
            if labels[f.tag] == bond
            for d in np.linalg.norm(from_axis(f.points, axis), axis=1)
        ]
        for bond in BONDS
    }
    if all(radii.values()) and min(radii["inner"]) >= max(radii["outer"]):
        raise GeometryError(
            "geometry.bonds",
            f"all of the inner bond is farther from the axis ({min(radii['inner']):.4g} mm and more) than the "
            "outer one",
            "an inner bond nearer to the axis than the outer one: exchange the two rules",
            view_of(labels),
        )


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
        tags_by_rule = [
            matching_faces([rule], faces, axis, part.size, part.face_names, part.colours) for rule in rules
        ]
        bond_tags = sorted({tag for tags in tags_by_rule for tag in tags})
        if [] in tags_by_rule:
            rule_index = tags_by_rule.index([])
            rule_text = (
                f"rule {rule_index + 1} of {len(tags_by_rule)}" if len(tags_by_rule) > 1 else "the rule"
            )
            raise GeometryError(
                f"geometry.bonds.{bond}",
                f"{rule_text} ({rules[rule_index].text}) selects no face",
                f"rules that each select a face; there are {selectable(faces, axis, part)}",
                view_of({face.tag: bond if face.tag in bond_tags else FREE for face in faces}),
            )
        return bond_tags, "by the case's rules"
    sleeve = INNER if bond == "inner" else OUTER
    solids = [tag for tag, role in roles.items() if role == sleeve]
    if solids:
        if any(tag in meshed for tag in solids):
            sides = [face for face in faces if _owner(face.tag) in solids]
            return (
                _extreme(sides, axis, part.size, bond),
                f"the solid {sleeve}: its face away from the rubber",
            )
        touching = {t for tag in solids for _, t in model().getBoundary([(3, tag)], oriented=False)}
        return [face.tag for face in faces if face.tag in touching], f"where the solid {sleeve} touches"
    named_faces = [face.tag for face in faces if part.face_names.get(face.tag, "").lower().startswith(bond)]
    if named_faces:
        return named_faces, "by the names of faces in the file"
    coloured = _faces_by_colour(bond, part, faces, axis)
    if coloured:
        return coloured, COLOURS
    rubber = [face for face in faces if roles.get(_owner(face.tag)) == RUBBER]
    side = "nearest to" if bond == "inner" else "farthest from"
    coaxial = _extreme(rubber, axis, part.size, bond)
    if coaxial:
        return coaxial, f"found: the large coaxial faces {side} the axis"
    return _only(rubber, axis, part.size, bond), "found: the only cylindrical surface, beside the axis"


def selectable(faces: Sequence[Sampled], axis: Axis, part: Part) -> str:
    """Return what rules can select: radii, normals, names and colours of faces, and where other faces lie.

    Parameters
    ----------
    faces : sequence of Sampled
        Faces on the outside of the meshed solids.
    axis : Axis
    part : Part
    """
    lines = {face.tag: own_line(face, axis, part.size) for face in faces}
    axis_radii, other_radii = (
        {
            float(f"{radius_of(face, line):.4g}")
            for face in faces
            if face.kind == "Cylinder" and (line := lines[face.tag]) is not None and (line is axis) == on_axis
        }
        for on_axis in (True, False)
    )
    sides = [
        face.normals[0]
        for face in faces
        if face.kind == "Plane"
        and len(face.normals)
        and abs(face.normals[0] @ axis.direction) < 1.0 - STRAIGHT
    ]
    other_faces = [
        face for face in faces if face.kind != "Plane" and len(face.points) and lines[face.tag] is None
    ]
    names = sorted({name for face in faces if (name := part.face_names.get(face.tag, ""))})
    colours = sorted({hexadecimal(part.colours[face.tag]) for face in faces if face.tag in part.colours})
    shown = [
        ("cylinders about the axis of radius {} mm", [f"{r:g}" for r in sorted(axis_radii)]),
        ("cylinders about other lines of radius {} mm", [f"{r:g}" for r in sorted(other_radii)]),
        ("plane faces with normal {}", sorted({_list_text(normal) for normal in sides})),
        ("other faces in the boxes {}", sorted(map(_box, other_faces))),
        ("faces named {}", names),
        ("faces in {}", colours),
    ]
    sentences = [text.format(", ".join(items[:MOST_SHOWN])) for text, items in shown if items]
    return "; ".join(sentences) or "no cylinders about the axis, names or colours"


def _list_text(vector: Array) -> str:
    """Write a vector as in the case file."""
    return "[" + ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in vector) + "]"


def _box(face: Sampled) -> str:
    """Write the box around a face's samples as in the case file, a millimetre wider."""
    return (
        "[" + ", ".join(map(_list_text, (face.points.min(axis=0) - 1.0, face.points.max(axis=0) + 1.0))) + "]"
    )


def _owner(face: int) -> int:
    return int(model().getAdjacencies(2, face)[0][0])


def _faces_by_colour(bond: str, part: Part, faces: Sequence[Sampled], axis: Axis) -> list[int]:
    """Return which of the two colours of the faces lies nearer to the axis, or farther from it."""
    groups: dict[tuple[int, int, int], list[Sampled]] = {}
    for face in faces:
        if face.tag in part.colours:
            groups.setdefault(part.colours[face.tag], []).append(face)
    if len(groups) != 2:
        return []
    ordered = sorted(groups.values(), key=lambda group: float(np.mean([radius_of(f, axis) for f in group])))
    return [face.tag for face in ordered[0 if bond == "inner" else 1]]


def _only(faces: Sequence[Sampled], axis: Axis, size: float, bond: str) -> list[int]:
    """Return the faces about one line parallel to the axis, as of an eccentric bore; none if there are several lines.

    Several holes may be voids.
    """
    toward = -1.0 if bond == "inner" else 1.0
    cylinders: list[tuple[int, Axis]] = []
    for face in faces:
        line = own_line(face, axis, size)
        if line is not None and _looks_along(face, line, toward, size):
            cylinders.append((face.tag, line))
    distances = [
        distance_between(cylinders[0][1].point, line.point, axis.direction, size) for _, line in cylinders
    ]
    return [tag for tag, _ in cylinders] if not any(distances) else []


def _looks_along(face: Sampled, line: Axis, toward: float, size: float) -> bool:
    """Whether the normals of a face point at a line (`toward` -1) or away from it (1)."""
    radial = from_axis(face.points, line)
    radial /= np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-12 * size)
    return float(np.mean(toward * np.einsum("ij,ij->i", radial, face.normals))) > RADIAL


def radius_of(face: Sampled, axis: Axis) -> float:
    """Return the mean distance of a face from the axis, mm.

    Parameters
    ----------
    face : Sampled
        Sampled face, mm.
    axis : Axis
        Axis of the bushing.
    """
    return float(np.linalg.norm(from_axis(face.points, axis), axis=1).mean())


def _extreme(faces: Sequence[Sampled], axis: Axis, size: float, bond: str) -> list[int]:
    """Return the coaxial faces nearest to the axis that face it, or the farthest ones that face away from it."""
    toward = -1.0 if bond == "inner" else 1.0
    radii: dict[int, float] = {}
    for face in faces:
        if not is_coaxial(face, axis, size):
            continue
        if _looks_along(face, axis, toward, size):
            radii[face.tag] = radius_of(face, axis)
    if not radii:
        return []
    areas = {face.tag: face.area for face in faces}
    groups = {
        tag: [other_tag for other_tag, r in radii.items() if abs(r - radius) <= SAME_RADIUS * radius]
        for tag, radius in radii.items()
    }
    sizes = {tag: sum(areas[other_tag] for other_tag in group) for tag, group in groups.items()}
    # The rim of a collar is farther from the axis than the bond: small faces are ignored.
    large = [tag for tag, area in sizes.items() if area >= LARGE * max(sizes.values())]
    return groups[max(large, key=lambda tag: toward * radii[tag])]
