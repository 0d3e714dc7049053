"""Sentences about the interpretation of a CAD file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from geometry.cad.bonds import FREE, Bonds
from geometry.cad.frame import Frame, vector_text
from geometry.cad.part import Part
from geometry.cad.roles import IGNORED, INNER, OUTER, RUBBER
from geometry.session import model
from geometry.size import STATES
from geometry.view import caption

Planes = frozenset[Literal["x", "y", "z"]]
Vector = tuple[float, float, float]


def picture_names(
    roles: Mapping[int, str], meshed: Sequence[int], labels: Mapping[int, str]
) -> tuple[dict[int, str], dict[int, str]]:
    """Return the names of faces and of solids in the picture; of one body alone no solids, but its faces only.

    Parameters
    ----------
    roles
        Role of each solid.
    meshed
        Solids that are meshed.
    labels
        Interpretation of the faces on the outside of these.
    """
    bodies = {tag: role for tag, role in roles.items() if role != IGNORED}
    if len(bodies) == 1:
        return dict(labels), {}
    faces: dict[int, str] = {}
    for tag, role in bodies.items():
        for _, face in model().getBoundary([(3, tag)], oriented=False):
            bond = labels.get(int(face), FREE)
            if bond != FREE or role != RUBBER or tag not in meshed:
                faces[int(face)] = bond if bond != FREE else role
            elif int(face) in labels:
                faces[int(face)] = FREE
    return faces, bodies


def captions_of(part: Part, roles: Mapping[int, str], states: Mapping[str, str]) -> dict[str, str]:
    """Return the words of the picture's legend for each role, with the volume of its solids.

    Parameters
    ----------
    part
        Solids of the file.
    roles
        Role of each solid.
    states
        Role -> "rigid" or "elastic".
    """
    volumes: dict[str, float] = {}
    for tag, role in roles.items():
        volumes[role] = volumes.get(role, 0.0) + part.volume(tag)
    return {
        role: caption(role, "" if role == RUBBER else states[role], size, role not in (RUBBER, INNER, OUTER))
        for role, size in volumes.items()
    }


def notes_of(
    part: Part,
    roles: Mapping[int, str],
    states: Mapping[str, str],
    frame: Frame,
    how: str,
    bonds: Bonds,
    areas: Mapping[str, float],
    planes: Planes,
    offset: float,
    placement: tuple[Vector | None, Vector | None],
) -> tuple[str, ...]:
    """Return results of the interpretation and how they were found, in sentences.

    Parameters
    ----------
    part, roles, bonds
        Of the part; roles by solid.
    states : mapping
        Role -> "rigid" or "elastic".
    frame, planes
        The bushing's place in the file and its planes of symmetry.
    how : str
        How the axis was found.
    areas : mapping
        Of each boundary, mm^2.
    offset : float
        Distance of the centre from the axis of most faces, or of a given origin from the inner bond's axis, mm.
    placement : tuple
        Origin (mm) and direction of the case.
    """
    origin, direction = placement
    notes = [STATES.format(part.unit)] if part.unit else []
    for tag, role in roles.items():
        state = "" if role in (RUBBER, IGNORED) else f", {states[role]}"
        notes.append(f'solid "{part.solids[tag] or tag}": {role}{state}, {part.volume(tag):.5g} mm3')
    notes.append(
        f"axis {how}: direction {vector_text(frame.rows[2])} through {vector_text(frame.centre)} mm, "
        "the bushing's centre" + (", given" if origin is not None else "")
    )
    if offset and origin is None:
        notes.append(
            f"the inner bond has an axis of its own, {offset:.3g} mm from that of most faces: torsion and tilts turn "
            "about it (geometry.origin for another line)"
        )
    elif offset:
        notes.append(
            f"the given origin is {offset:.3g} mm from the inner bond's own axis: torsion and tilts turn about the "
            "line through the origin"
        )
    for bond, words in bonds.how.items():
        count = sum(label == bond for label in bonds.labels.values())
        notes.append(f"{bond} bond ({words}): {count} face{'s' * (count > 1)}, {areas[bond]:.5g} mm2")
    notes += _unused_names(part, bonds)
    notes.append(f"a radial load acts along {vector_text(frame.rows[0])}" + (", given" if direction else ""))
    notes.append("planes of symmetry through the centre, normal to: " + (", ".join(sorted(planes)) or "none"))
    return tuple(notes)


def _unused_names(part: Part, bonds: Bonds) -> list[str]:
    """Return sentences about colours and names of faces in the file that defined no bond."""
    sentences = []
    if bonds.unused:
        reason = "the bonds are known without them" if len(bonds.unused) == 2 else "there are not two of them"
        sentences.append(
            f"colours of faces ({', '.join(bonds.unused)}) were not used: {reason}; "
            f'geometry.bonds.inner = {{colour = "{bonds.unused[0]}"}} takes a bond from one'
        )
    if part.lost:
        sentences.append(f"{part.lost} of faces were not used: they are read from files with one solid only")
    return sentences
