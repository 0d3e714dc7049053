"""Loops -> faces of the open Gmsh session, with the names of regions and boundaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from geometry.blocks import Array
from geometry.errors import GeometryError
from geometry.section.crossing import polyline
from geometry.section.outline import CLOSE, FREE, RUBBER, Loop, OutlineCurve
from geometry.session import convert_errors, model


@dataclass(frozen=True)
class Drawn:
    """Entities of a section: faces by region, curves by boundary; names in the order of the outlines."""

    regions: Mapping[str, tuple[int, ...]]
    boundaries: Mapping[str, tuple[int, ...]]


def draw(loops: Sequence[Loop], where: str, half: bool = False) -> Drawn:
    """Draw a section, or the half of it above z = 0, whose cut is then the boundary "mirror_z".

    Parameters
    ----------
    loops : Sequence[Loop]
        Closed outlines, in mm.
    where : str
        File or key of the case, for messages.
    half : bool
        Draw the part above z = 0 only.

    Raises
    ------
    GeometryError
        Gmsh cannot make faces of the loops.
    """
    occ = model().occ
    faces, names = _faces(loops, where)
    tools = []
    if half:
        half_length = 4.0 * max(abs(x) for loop in loops for c in loop.curves for p in c.points for x in p)
        ends = [occ.addPoint(-half_length, 0, 0), occ.addPoint(half_length, 0, 0)]
        tools.append((1, occ.addLine(*ends)))
    fragments = [[(2, tag)] for tag in faces]
    if len(faces) + len(tools) > 1:
        _, fragments = occ.fragment([(2, tag) for tag in faces], tools)
    occ.synchronize()
    if half:
        below = [t for _, t in model().getEntities(2) if occ.getCenterOfMass(2, t)[1] < 0]
        occ.remove([(2, t) for t in below], recursive=True)
        occ.synchronize()
    return Drawn(_regions(fragments, names), _boundaries(loops, half))


def refuse_overlaps(loops: Sequence[Loop], where: str) -> None:
    """Refuse bodies of rubber that cover each other in part, and likewise plates.

    Parameters
    ----------
    loops : Sequence[Loop]
        Closed outlines as they were drawn, in mm.
    where : str
        File or key of the case, for messages.

    Raises
    ------
    GeometryError
        Two outlines overlap; a hole crosses or touches the outline around it.
    """
    occ = model().occ
    faces, names = _faces(loops, where)
    if len(faces) < 2:
        return
    _, fragments = occ.fragment([(2, tag) for tag in faces], [])
    owners: dict[int, str] = {}
    for name, pieces in zip(names, fragments, strict=True):
        for _, piece in pieces:
            owner = owners.setdefault(piece, "")
            owners[piece] = name
            # A plate that is drawn into the rubber takes its place (`_regions`).
            if owner and (owner == RUBBER) == (name == RUBBER):
                r, z, _ = occ.getCenterOfMass(2, piece)
                pair = f'"{name}"' if owner == name else f'"{owner}" and "{name}"'
                raise GeometryError(
                    where,
                    f"two outlines of {pair} overlap near ({r:.4g}, {round(z, 6) + 0.0:.4g})",
                    "a hole inside the outline around it, without touching it; bodies side by side share edges only",
                )


def _faces(loops: Sequence[Loop], where: str) -> tuple[list[int], list[str]]:
    """Return the faces with their regions, before they are cut where they overlap."""
    occ = model().occ
    points: dict[tuple[float, float], int] = {}
    wires = [occ.addCurveLoop([_add(curve, points) for curve in loop.curves]) for loop in loops]
    holes = _holes(loops)
    faces: list[int] = []
    names: list[str] = []
    for number, loop in enumerate(loops):
        if number in holes:
            continue
        inside = [wires[hole] for hole, owner in holes.items() if owner == number]
        with convert_errors(where, "an outline encloses no area"):
            face, *cut = [(2, occ.addPlaneSurface([wire])) for wire in (wires[number], *inside)]
            # Wires of holes in one face would have to run the other way round: OpenCASCADE does not turn all of them.
            faces.extend(tag for _, tag in (occ.cut([face], cut)[0] if cut else [face]))
        names += [loop.body] * (len(faces) - len(names))
    return faces, names


def _add(curve: OutlineCurve, points: dict[tuple[float, float], int]) -> int:
    occ = model().occ

    def point(p: tuple[float, float], shared: bool) -> int:
        if not shared:
            return int(occ.addPoint(*p, 0.0))
        if p not in points:
            points[p] = occ.addPoint(*p, 0.0)
        return points[p]

    last = len(curve.points) - 1
    tags = [point(p, i in (0, last)) for i, p in enumerate(curve.points)]
    if curve.kind == "line":
        return int(occ.addLine(*tags))
    if curve.kind == "arc":
        return int(occ.addCircleArc(*tags, center=False))
    if curve.kind == "spline":
        return int(occ.addSpline(tags))
    knots, counts = np.unique(curve.knots, return_counts=True)
    return int(
        occ.addBSpline(
            tags,
            degree=curve.degree,
            weights=curve.weights,
            knots=knots.tolist(),
            multiplicities=counts.tolist(),
        )
    )


def _holes(loops: Sequence[Loop]) -> dict[int, int]:
    """Loops of rubber that are holes, with the loop that they are in: those inside an odd number of loops of rubber."""
    polygons = [np.array([p for c in loop.curves for p in c.points[:-1]]) for loop in loops]
    rubber = [number for number, loop in enumerate(loops) if loop.body == RUBBER]
    enclosing = {
        inner: [
            outer
            for outer in rubber
            if outer != inner and all(_is_inside(p, polygons[outer]) for p in polygons[inner])
        ]
        for inner in rubber
    }
    # The innermost of the loops around it is itself inside the most loops.
    return {
        inner: max(outside, key=lambda outer: len(enclosing[outer]))
        for inner, outside in enclosing.items()
        if len(outside) % 2
    }


def _is_inside(point: Any, polygon: Any) -> bool:
    """Whether a ray to the right crosses the polygon an odd number of times."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    crosses = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[:, 0] + (point[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return bool(np.count_nonzero(crosses & (x > point[0])) % 2)


def _regions(fragments: Sequence[Any], names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Return the faces by region; `fragments` are the pieces into which each drawn face was cut."""
    surfaces = {tag for _, tag in model().getEntities(2)}
    regions: dict[str, tuple[int, ...]] = {RUBBER: ()}
    taken: set[int] = set()
    # A plate drawn into the rubber takes its place: the area that both cover belongs to the plate.
    for number in sorted(range(len(names)), key=lambda i: names[i] == RUBBER):
        tags = [int(tag) for _, tag in fragments[number] if tag in surfaces and tag not in taken]
        taken |= set(tags)
        regions[names[number]] = (*regions.get(names[number], ()), *tags)
    return {name: faces for name, faces in regions.items() if faces}


def _boundaries(loops: Sequence[Loop], half: bool) -> dict[str, tuple[int, ...]]:
    """Curves on the outside by the names of the edges that they lie on.

    They are found by position, because cutting faces at each other gives edges other numbers.
    """
    lines = [(curve.name, polyline(curve)) for loop in loops for curve in loop.curves]
    size = max(float(np.ptp(line, axis=0).max()) for _, line in lines)
    lowest = np.array([line.min(axis=0) for _, line in lines])
    highest = np.array([line.max(axis=0) for _, line in lines])
    boundaries: dict[str, tuple[int, ...]] = {}
    for _, tag in model().getEntities(1):
        if len(model().getAdjacencies(1, tag)[0]) != 1:
            continue
        low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, tag))
        parameters = [low + share * (high - low) for share in (0.25, 0.5, 0.75)]
        points = np.array(model().getValue(1, tag, parameters)).reshape(-1, 3)[:, :2]
        if half and np.abs(points[:, 1]).max() < CLOSE * size:
            name = "mirror_z"
        else:
            # Only edges whose boxes are as near as one of the edges can be nearest.
            beyond = np.maximum(np.maximum(lowest - points[:, None], points[:, None] - highest), 0.0)
            boxes = np.linalg.norm(beyond, axis=2).max(axis=0)
            limit = _distance(points, lines[int(np.argmin(boxes))][1]) + 1e-5 * size
            gaps = {i: _distance(points, lines[i][1]) for i in map(int, np.flatnonzero(boxes <= limit))}
            # Among edges that lie on each other, the named one is used.
            name = lines[min(gaps, key=lambda i: (round(gaps[i] / size, 6), lines[i][0] == FREE))][0]
        boundaries[name] = (*boundaries.get(name, ()), int(tag))
    return boundaries


def _distance(points: Array, line: Array) -> float:
    """Largest distance of points from a polyline."""
    a, d = line[:-1], np.diff(line, axis=0)
    share = np.einsum("pij,ij->pi", points[:, None] - a, d) / np.maximum(np.einsum("ij,ij->i", d, d), 1e-300)
    foot = a + np.clip(share, 0.0, 1.0)[..., None] * d
    return float(np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1).max())
