"""Checks that all bodies of a part are held, that rubber joins the two bonds, and that the bonds do not touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from geometry.errors import GeometryError
from geometry.session import model
from geometry.view import View

BONDS = ("inner", "outer")


def refuse_loose(
    bodies: Mapping[int, str],
    bonds: Mapping[str, Sequence[int]],
    dimension: int,
    where: str,
    view: View | None = None,
) -> None:
    """Refuse a body that is held by no bond, and bonds that no chain of bodies joins.

    Parameters
    ----------
    bodies
        Face (of a section) or solid of the open session -> its region.
    bonds
        "inner" and "outer" -> their curves or faces.
    dimension
        2 for a section, 3 for a solid part.
    where
        File or key of the case, for messages.
    view
        Contents of a picture.

    Raises
    ------
    GeometryError
    """
    groups = _groups(list(bodies), dimension)
    held_sides = [
        {name for name in BONDS if any(_bodies_at(tag, dimension) & group for tag in bonds[name])}
        for group in groups
    ]
    for group, sides in zip(groups, held_sides, strict=True):
        if not sides:
            names = " and ".join(f'"{name}"' for name in sorted({bodies[tag] for tag in group}))
            other_bodies = [tag for tag in bodies if tag not in group]
            raise GeometryError(
                where,
                f"a body of {names} is held by no bond: it touches neither bonded rubber nor metal that is held"
                f"{_gap(group, other_bodies, dimension)}",
                "bodies that share an edge or a face with what holds them",
                view,
            )
    if not any(sides == set(BONDS) for sides in held_sides):
        inner, outer = (
            [tag for group, sides in zip(groups, held_sides, strict=True) if name in sides for tag in group]
            for name in BONDS
        )
        raise GeometryError(
            where,
            f"nothing joins the inner bond to the outer one{_gap(inner, outer, dimension)}",
            "rubber from one bond to the other, and plates that share edges or faces with it",
            view,
        )


def refuse_touching(
    bonds: Mapping[str, Sequence[int]],
    dimension: int,
    where: str,
    view: View | None = None,
) -> None:
    """Refuse bonds that share a point.

    Parameters
    ----------
    bonds
        "inner" and "outer" -> their curves or faces.
    dimension
        2 for a section, 3 for a solid part.
    where
        File or key of the case, for messages.
    view
        Contents of a picture.

    Raises
    ------
    GeometryError
    """
    inner, outer = (
        {
            (dim, int(tag))
            for side in bonds[name]
            for recursive in (False, True)
            for dim, tag in model().getBoundary([(dimension - 1, side)], False, False, recursive)
        }
        for name in BONDS
    )
    common = sorted(inner & outer, reverse=True)
    if common:
        # A common curve comes before its ends.
        dim, tag = common[0]
        low, high = model().getParametrizationBounds(dim, tag)
        parameters = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
        raise bonds_touch_error(np.array(model().getValue(dim, tag, parameters))[:dimension], where, view)


def bonds_touch_error(place: NDArray[np.float64], where: str, view: View | None) -> GeometryError:
    """Return the error of bonds that share a point.

    Parameters
    ----------
    place : Array
        The point, mm, shape (d,).
    where : str
        File or key of the case.
    view : View | None
        Contents of a picture.
    """
    return GeometryError(
        where,
        f"the inner and the outer bond touch each other at {_point_text(place)}: rubber that is moved and held at one "
        "point has no finite stiffness",
        "bonds with a free surface between them; a name or a rule may give a bond an edge or a face too many",
        view,
    )


def _groups(tags: Sequence[int], dimension: int) -> list[set[int]]:
    """Bodies that are connected through common boundaries."""
    groups = [{tag} for tag in tags]
    for _, side in model().getEntities(dimension - 1):
        bodies = _bodies_at(int(side), dimension)
        touched = [group for group in groups if group & bodies]
        if len(touched) > 1:
            groups = [group for group in groups if not group & bodies] + [set().union(*touched)]
    return groups


def _bodies_at(side: int, dimension: int) -> set[int]:
    return {int(tag) for tag in model().getAdjacencies(dimension - 1, side)[0]}


def _gap(tags: Sequence[int] | set[int], other_tags: Sequence[int], dimension: int) -> str:
    """Words about the narrowest gap between bodies; none where there are no others."""
    distances = [model().occ.getDistance(dimension, a, dimension, b) for a in tags for b in other_tags]
    if not distances:
        return ""
    distance, *place = min(distances, key=lambda gap: gap[0])
    middle = 0.5 * (np.array(place[:3]) + np.array(place[3:]))
    return f"; the narrowest gap is {distance:.3g} mm, at {_point_text(middle[:dimension])}"


def _point_text(place: NDArray[np.float64]) -> str:
    return f"({', '.join(f'{round(float(x), 3) + 0.0:g}' for x in place)})"
