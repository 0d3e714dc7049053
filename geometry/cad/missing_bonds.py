"""Refusal of a part in which faces for a bond are missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from geometry.cad.axis import Axis, find_axis, is_coaxial
from geometry.cad.bonds import Bonds, selectable
from geometry.cad.frame import vector_text
from geometry.cad.part import Part
from geometry.cad.sampling import Sampled
from geometry.cad.triangles import view_of
from geometry.connections import BONDS
from geometry.errors import GeometryError


def require_bonds(
    bonds: Bonds,
    roles: Mapping[int, str],
    part: Part,
    faces: Sequence[Sampled],
    axis: Axis,
    given_axis: Sequence[float] | None,
    where: str,
) -> None:
    """Refuse a part without faces for one of the bonds.

    Parameters
    ----------
    bonds, roles, part
        Interpretation of the file.
    faces
        Sampled faces on the outside of the meshed solids.
    axis
        Axis of the bushing.
    given_axis
        Direction of the axis in the case, shape (3,); None where it was found.
    where
        The file.

    Raises
    ------
    GeometryError
    """
    missing = [bond for bond in BONDS if bond not in bonds.labels.values()]
    own_axis = _own_axis(part, faces, axis) if missing and given_axis is not None else None
    if own_axis is not None:
        raise GeometryError(
            where,
            "no face is a surface of revolution about the given axis; most curved faces are about "
            f"{vector_text(own_axis.direction)} through {vector_text(own_axis.point)} mm",
            "geometry.axis and geometry.origin of the bonds, or none: it is then found",
            view_of(bonds.labels),
        )
    if missing:
        choices = selectable(faces, axis, part)
        bond_names = " and ".join(f'"{bond}"' for bond in missing)
        solids = ", ".join(f'"{part.solids[tag] or tag}" {role}' for tag, role in roles.items())
        taken = (
            f"; the solids were taken for: {solids} (geometry.solids to change that)"
            if len(roles) > 1
            else ""
        )
        raise GeometryError(
            where,
            f"no face was found for the bond {bond_names}: the rubber would not be held",
            f"geometry.bonds with radius, normal, box, face or colour; there are {choices}{taken}",
            view_of(bonds.labels),
        )


def _own_axis(part: Part, faces: Sequence[Sampled], axis: Axis) -> Axis | None:
    """Return the axis of most curved faces if no face is coaxial with the given one; otherwise None."""
    if any(face.kind != "Plane" and is_coaxial(face, axis, part.size) for face in faces):
        return None
    return find_axis(faces, part.size, axis.point)
