"""Area at which metal holds the rubber, and how far drawn rigid sleeves continue beyond their bonds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from geometry.cad.axis import Axis, from_axis
from geometry.cad.frame import Frame
from geometry.cad.part import Part
from geometry.cad.roles import INNER, OUTER, RUBBER
from geometry.cad.sampling import sample
from geometry.joined import BONDS
from geometry.session import model

#: A sleeve's face continues a bond if both are cylinders about the axis, whose radii differ by less than this share.
SAME_RADIUS = 1e-3
#: Lengths of a sleeve below and above its bond are the same if they differ by less than this share of the thickness.
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
    rubber, others = (
        Counter(face for solid in meshed if (roles[solid] == RUBBER) == wanted for face in _sides(3, solid))
        for wanted in (True, False)
    )
    held = [f for f, times in rubber.items() if times == 1 and (f in others or labels.get(f) in BONDS)]
    return sum(part.areas[f] if f in part.areas else float(model().occ.getMass(2, f)) for f in held)


def beyond_bonds(
    part: Part,
    roles: Mapping[int, str],
    meshed: Sequence[int],
    labels: Mapping[int, str],
    frame: Frame,
    axis: Axis,
) -> dict[str, tuple[float, float]]:
    """Return by how much rigid sleeves continue as cylinders below and above their bonds, mm, by bond.

    Parameters
    ----------
    part, roles
        Solids of the file, and the role of each.
    meshed
        Solids that are meshed: the others are rigid.
    labels
        Face on the outside of the meshed solids -> name of its boundary.
    frame
        The bushing's coordinates.
    axis
        Axis of the bushing.
    """
    found = {}
    for bond, role in zip(BONDS, (INNER, OUTER), strict=True):
        solids = [tag for tag, own in roles.items() if own == role and tag not in meshed]
        bonded = {face for face, name in labels.items() if name == bond}
        radii = np.concatenate([_radii(face, part.size, axis) for face in bonded])
        radius = float(radii.mean())
        if not solids or np.ptp(radii) > SAME_RADIUS * radius:
            continue
        rest = {f for solid in solids for f in _sides(3, solid)} - bonded
        alike = {f for f in rest if _is_cylinder(f, part.size, axis, radius)}
        reached, curves = set[int](), {c for face in bonded for c in _sides(2, face)}
        while fresh := {f for f in alike - reached if curves & set(_sides(2, f))}:
            reached |= fresh
            curves |= {c for face in fresh for c in _sides(2, face)}
        ends = _ends(bonded, frame)
        low, high = _ends(bonded | reached, frame)
        if reached:
            found[bond] = (ends[0] - low, high - ends[1])
    return found


def is_even(beyond: Mapping[str, tuple[float, float]], thickness: float) -> bool:
    """Whether sleeves continue alike below and above their bonds, as far as rubber that bulges can reach.

    Parameters
    ----------
    beyond
        Lengths below and above each bond, mm, as `beyond_bonds` returned them.
    thickness
        Size of the rubber across the bonds, mm: it bulges no farther than this.
    """
    reach = [[min(length, thickness) for length in lengths] for lengths in beyond.values()]
    return all(abs(above - below) < EVEN * thickness for below, above in reach)


def _sides(dimension: int, tag: int) -> list[int]:
    """Faces of a solid, or curves of a face."""
    return [int(side) for _, side in model().getBoundary([(dimension, tag)], oriented=False)]


def _radii(face: int, size: float, axis: Axis) -> np.ndarray:  # type: ignore[type-arg]
    return np.asarray(np.linalg.norm(from_axis(sample(face, size, 0.0).points, axis), axis=1))


def _is_cylinder(face: int, size: float, axis: Axis, radius: float) -> bool:
    """Whether a face lies on the cylinder of this radius about the axis."""
    if model().getType(2, face) != "Cylinder":
        return False
    radii = _radii(face, size, axis)
    return bool(len(radii) and np.abs(radii - radius).max() < SAME_RADIUS * radius)


def _ends(faces: set[int], frame: Frame) -> tuple[float, float]:
    """Return the least and largest coordinate along the axis of the corners of faces, mm."""
    corners = model().getBoundary(
        [(2, face) for face in faces], combined=False, oriented=False, recursive=True
    )
    points = np.array([model().getValue(0, tag, []) for dimension, tag in corners if dimension == 0])
    z = frame.local(points.reshape(-1, 3))[:, 2]
    return float(z.min()), float(z.max())
