"""Plates that an outline names but does not draw: the metal between two edges of the same name."""

from __future__ import annotations

import math
from collections.abc import Sequence

from geometry.connections import BONDS
from geometry.errors import GeometryError
from geometry.section.outline import FREE, Loop, OutlineCurve

#: Names of edges that do not name a plate.
KNOWN = ("inner", "outer", FREE)
#: Thinner than this share of its length, a plate cannot be meshed.
THINNEST = 1e-3


def with_plates(loops: Sequence[Loop], where: str) -> tuple[Loop, ...]:
    """Add a loop for every plate that is named by edges only: two chains of edges, joined at their ends.

    Parameters
    ----------
    loops : Sequence[Loop]
        Closed outlines, in mm.
    where : str
        File or key of the case, for messages.

    Raises
    ------
    GeometryError
        A name is given to one chain of edges only, or to more than two; or the plate has no thickness.
    """
    drawn = {loop.body for loop in loops}
    names = dict.fromkeys(
        curve.name
        for loop in loops
        for curve in loop.curves
        if curve.name not in KNOWN and curve.name not in drawn
    )
    return (*loops, *(_plate(name, loops, where) for name in names))


def _plate(name: str, loops: Sequence[Loop], where: str) -> Loop:
    chains = [chain for loop in loops for chain in _chains(loop, name)]
    if len(chains) != 2:
        bond_name = next((bond for bond in BONDS if bond in name.lower()), None)
        raise GeometryError(
            where,
            f'the name "{name}" is given to {len(chains)} row{"s" * (len(chains) > 1)} of edges: a plate is bonded to '
            "rubber on two sides",
            f'did you mean "{bond_name}"?'
            if bond_name
            else f'"inner", "outer", no name for a free edge, or a plate drawn as an outline with body = "{name}"',
        )
    outline_chain, other_chain = chains
    start, end = outline_chain[0].points[0], outline_chain[-1].points[-1]
    if math.dist(end, other_chain[0].points[0]) > math.dist(end, other_chain[-1].points[-1]):
        other_chain = [curve.reverse() for curve in other_chain[::-1]]
    length = sum(math.dist(curve.points[0], curve.points[-1]) for curve in outline_chain)
    first_point, last_point = other_chain[0].points[0], other_chain[-1].points[-1]
    outline = [p for curve in (*outline_chain, *other_chain) for p in curve.points]
    if _area(outline) < THINNEST * length**2:
        raise GeometryError(
            where, f'the plate "{name}" has no thickness', "draw two edges, the thickness of the metal apart"
        )
    joints = [
        OutlineCurve("line", pair)
        for pair in ((end, first_point), (last_point, start))
        if math.dist(*pair) > 0
    ]
    curves = [*outline_chain, joints[0], *other_chain, *joints[1:]]
    return Loop(tuple(curves), name)


def _area(points: Sequence[tuple[float, float]]) -> float:
    """Area of the polygon through the points (shoelace formula), mm^2."""
    return 0.5 * abs(sum(r * points[i - 1][1] - points[i - 1][0] * z for i, (r, z) in enumerate(points)))


def _chains(loop: Loop, name: str) -> list[list[OutlineCurve]]:
    """Rows of neighbouring edges of one name, around a closed loop."""
    curves = list(loop.curves)
    start = next((i for i in range(len(curves)) if curves[i - 1].name != name == curves[i].name), None)
    if start is None:
        return [curves] if curves and curves[0].name == name else []
    chains: list[list[OutlineCurve]] = []
    previous_name = ""
    for curve in curves[start:] + curves[:start]:
        if curve.name == name:
            if previous_name != name:
                chains.append([])
            chains[-1].append(curve)
        previous_name = curve.name
    return chains
