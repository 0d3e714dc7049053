"""Sentences about the interpretation of a CAD file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from geometry.cad.bonds import Bonds
from geometry.cad.frame import Frame, vector_text
from geometry.cad.part import Part
from geometry.cad.roles import RUBBER
from geometry.session import model

Planes = frozenset[Literal["x", "y", "z"]]
Vector = tuple[float, float, float]


def notes_of(
    part: Part,
    roles: Mapping[int, str],
    meshed: Sequence[int],
    frame: Frame,
    how: str,
    bonds: Bonds,
    areas: Mapping[str, float],
    planes: Planes,
    beside: float,
    given: tuple[Vector | None, Vector | None],
) -> tuple[str, ...]:
    """Return results of the interpretation and how they were found, in sentences.

    Parameters
    ----------
    part, roles, meshed, bonds
        Of the part; roles by solid.
    frame, planes
        The bushing's place in the file and its planes of symmetry.
    how : str
        How the axis was found.
    areas : mapping
        Of each boundary, mm^2.
    beside : float
        Distance of the centre from the axis of most faces, or of a given origin from the inner bond's axis, mm.
    given : tuple
        Origin (mm) and direction of the case.
    """
    origin, direction = given
    notes = []
    for tag, role in roles.items():
        state = "" if role == RUBBER else ", elastic" if tag in meshed else ", rigid"
        volume = float(model().occ.getMass(3, tag))
        notes.append(f'solid "{part.solids[tag] or tag}": {role}{state}, {volume:.5g} mm3')
    notes.append(
        f"axis {how}: direction {vector_text(frame.rows[2])} through {vector_text(frame.centre)} mm, "
        "the bushing's centre" + (", given" if origin is not None else "")
    )
    if beside and origin is None:
        notes.append(
            f"the inner bond has an axis of its own, {beside:.3g} mm from that of most faces: torsion and tilts turn "
            "about it (geometry.origin for another line)"
        )
    elif beside:
        notes.append(
            f"the given origin is {beside:.3g} mm from the inner bond's own axis: torsion and tilts turn about the "
            "line through the origin"
        )
    for bond, words in bonds.how.items():
        count = sum(label == bond for label in bonds.labels.values())
        notes.append(f"{bond} bond ({words}): {count} face{'s' * (count > 1)}, {areas[bond]:.5g} mm2")
    notes.append(f"a radial load acts along {vector_text(frame.rows[0])}" + (", given" if direction else ""))
    notes.append("planes of symmetry through the centre, normal to: " + (", ".join(sorted(planes)) or "none"))
    return tuple(notes)
