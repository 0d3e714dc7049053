"""Interpretation of a section: regions, boundaries, measures, centre and symmetry."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array
from geometry.connections import refuse_loose, refuse_touching
from geometry.errors import GeometryError
from geometry.isolated import isolated
from geometry.section.crossing import refuse_crossings
from geometry.section.draw import Drawn, draw, refuse_overlaps
from geometry.section.outline import RUBBER, Loop
from geometry.section.plates import with_plates
from geometry.session import model, options, session
from geometry.size import refuse_size
from geometry.symmetry import is_symmetric
from geometry.view import View
from geometry.wall import Wall, wall_of


@dataclass(frozen=True)
class FoundSection:
    """A section that can be meshed.

    Attributes
    ----------
    loops
        The outlines, with z counted from the centre.
    centre
        z of the centre in the user's coordinates, mm.
    regions : tuple of str
        "rubber", then plates and sleeves.
    measures : mapping
        Volume of each region (mm^3) and area of each boundary (mm^2), of the whole ring; bonds as "inner_bond".
    symmetric
        Whether the half below z = 0 is the mirror image of the half above.
    thickness, length
        Size of the rubber across and along the bonds, mm: twice its volume over the bonds' area, and the longer bond.
    smallest_radius
        mm; 0 where the section touches the axis.
    areas : mapping
        Area of each region in the half-plane, mm^2.
    curved : tuple of (float, float)
        Length and least radius of curvature of every edge, mm.
    view
        Contents of a picture, in the plane (r, 0, z).
    wall
        The rubber between two coaxial sleeves; None where the section has no such rubber.
    """

    loops: tuple[Loop, ...]
    centre: float
    regions: tuple[str, ...]
    measures: Mapping[str, float]
    symmetric: bool
    thickness: float
    length: float
    smallest_radius: float
    areas: Mapping[str, float]
    curved: tuple[tuple[float, float], ...]
    view: View
    wall: Wall | None


@lru_cache(maxsize=64)
@isolated("is not a section that can be drawn", lambda loops, where, centre: where)
def find_section(loops: tuple[Loop, ...], where: str, centre: float | None) -> FoundSection:
    """Draw and measure a section once.

    Parameters
    ----------
    loops : tuple[Loop, ...]
        Closed outlines in the user's coordinates, mm.
    where : str
        Words for messages: the file, or the key of the case.
    centre : float | None
        z of the centre, mm; None for the middle of the inner bond.

    Raises
    ------
    GeometryError
    """
    drawn_loops, loops = loops, with_plates(loops, where)
    refuse_crossings(loops, where)
    ends = np.array([point for loop in loops for curve in loop.curves for point in curve.points])
    extents = (float(ends[:, 0].max()), float(np.ptp(ends[:, 1])))
    remedy = "dimensions in mm; of a drawing, in the unit that it states ($INSUNITS), or geometry.unit"
    refuse_size(max(extents), where, remedy)
    with session():
        refuse_overlaps(drawn_loops, where)
        model().add("section")
        drawn = draw(loops, where)
        _require(drawn, where)
        if centre is None:
            boxes = np.array([model().getBoundingBox(1, tag) for tag in drawn.boundaries["inner"]])
            centre = float(round(0.5 * (boxes[:, 1].min() + boxes[:, 4].max()), 9))
        model().add("centred")
        shifted_loops = tuple(_shift(loop, -centre) for loop in loops)
        drawn = draw(shifted_loops, where)
        return _found_section(shifted_loops, centre, drawn)


def _require(drawn: Drawn, where: str) -> None:
    if RUBBER not in drawn.regions:
        raise GeometryError(
            where,
            "there is no rubber: every outline has the name of a plate",
            'no name, or "free", for the free edges of the rubber; in a drawing, the layer "0" or "free"',
        )
    edge_names = ", ".join(sorted(drawn.boundaries))
    for bond in ("inner", "outer"):
        if bond not in drawn.boundaries:
            raise GeometryError(
                where,
                f'no edge on the outside is named "{bond}": the rubber would not be held',
                f"edges are named {edge_names}",
            )
    bodies = {tag: name for name, tags in drawn.regions.items() for tag in tags}
    refuse_loose(bodies, drawn.boundaries, 2, where)
    refuse_touching(drawn.boundaries, 2, where)


def _shift(loop: Loop, by: float) -> Loop:
    curves = tuple(replace(c, points=tuple((r, z + by) for r, z in c.points)) for c in loop.curves)
    return replace(loop, curves=curves)


def _found_section(loops: tuple[Loop, ...], centre: float, drawn: Drawn) -> FoundSection:
    volumes = {name: _swept_measure(2, tags) for name, tags in drawn.regions.items()}
    areas = {name: _swept_measure(1, tags) for name, tags in drawn.boundaries.items()}
    boxes = np.array([model().getBoundingBox(2, tag) for _, tag in model().getEntities(2)])
    size = float(max(boxes[:, 3].max(), np.ptp(boxes[:, [1, 4]])))
    parts = {f"region {k}": [(2, t) for t in v] for k, v in drawn.regions.items()}
    parts |= {f"boundary {k}": [(1, t) for t in v] for k, v in drawn.boundaries.items()}
    bonded = sum(areas[name] for name in ("inner", "outer"))
    lengths = [
        sum(model().occ.getMass(1, tag) for tag in drawn.boundaries[name]) for name in ("inner", "outer")
    ]
    # In a drawing the edges of a plate have the name of its layer, which is the plate's.
    edges = {f"{k}_bond" if k in ("inner", "outer") else k: v for k, v in areas.items() if k not in volumes}
    return FoundSection(
        loops=loops,
        centre=centre,
        regions=tuple(drawn.regions),
        measures=volumes | edges,
        symmetric=is_symmetric(parts, np.zeros(3), np.eye(3), 1, size) and _same_outline(drawn, size),
        thickness=2.0 * volumes[RUBBER] / bonded,
        length=max(lengths),
        smallest_radius=max(0.0, float(boxes[:, 0].min()) if boxes[:, 0].min() > 1e-5 * size else 0.0),
        areas={name: sum(model().occ.getMass(2, t) for t in tags) for name, tags in drawn.regions.items()},
        curved=tuple(_length_and_radius(tag) for _, tag in model().getEntities(1)),
        view=_view(drawn),
        wall=wall_of({name: _along(drawn.boundaries[name]) for name in ("inner", "outer")}),
    )


def _length_and_radius(curve: int) -> tuple[float, float]:
    """Length and least radius of curvature of a curve, mm; inf where it is straight."""
    low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, curve))
    sharpest = float(np.max(model().getCurvature(1, curve, np.linspace(low, high, 9).tolist())))
    return float(model().occ.getMass(1, curve)), 1.0 / sharpest if sharpest > 0.0 else math.inf


def _along(curves: Sequence[int]) -> Array:
    """Points (r, z) of curves, their ends among them, mm."""
    points = []
    for tag in curves:
        low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, tag))
        points.append(np.array(model().getValue(1, tag, np.linspace(low, high, 65).tolist())).reshape(-1, 3))
    return np.concatenate(points)[:, :2]


def _swept_measure(dimension: int, tags: Sequence[int]) -> float:
    """Measure of what faces or curves sweep about the axis (Pappus)."""
    occ = model().occ
    return float(
        sum(2 * math.pi * occ.getCenterOfMass(dimension, t)[0] * occ.getMass(dimension, t) for t in tags)
    )


def _same_outline(drawn: Drawn, size: float) -> bool:
    """Whether the mirror images of points of every boundary lie on a curve of the same name."""
    occ = model().occ
    for tags in drawn.boundaries.values():
        for tag in tags:
            low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, tag))
            points = np.array(model().getValue(1, tag, np.linspace(low, high, 9).tolist())).reshape(-1, 3)
            for r, z, _ in points:
                point = occ.addPoint(r, -z, 0.0)
                distance = min(occ.getDistance(0, point, 1, curve)[0] for curve in tags)
                occ.remove([(0, point)])
                if distance > 1e-5 * size:
                    return False
    return True


def _view(drawn: Drawn) -> View:
    """Fine triangles of all faces, by region, and the boundary by names."""
    boxes = np.array([model().getBoundingBox(2, tag) for _, tag in model().getEntities(2)])
    height = float(np.ptp(boxes[:, [1, 4]]))
    options().setNumber("Mesh.MeshSizeMax", height / 30)
    # A pixel of a picture: the tip of a zigzag curve has any curvature, and a mesh as fine as that takes minutes.
    options().setNumber("Mesh.MeshSizeMin", height / 1000)
    options().setNumber("Mesh.LcIntegrationPrecision", 1e-3)
    options().setNumber("Mesh.MeshSizeFromCurvature", 36)
    model().mesh.generate(2)
    tags, coordinates, _ = model().mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=int)
    number[tags] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[:, [0, 2, 1]]
    names = (*drawn.regions, *drawn.boundaries)

    def elements(kind: int, size: int, parts: Mapping[str, Sequence[int]]) -> tuple[Array, NDArray[np.int_]]:
        corners, label = [np.zeros((0, size, 3))], [np.zeros(0, dtype=int)]
        for name, entities in parts.items():
            for entity in entities:
                nodes = model().mesh.getElementsByType(kind, entity)[1].reshape(-1, size)
                corners.append(points[number[nodes]])
                label.append(np.full(len(nodes), names.index(name)))
        return np.concatenate(corners), np.concatenate(label)

    return View(*elements(2, 3, drawn.regions), names, *elements(1, 2, drawn.boundaries))
