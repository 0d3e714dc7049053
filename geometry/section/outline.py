"""Edges of a section as the case file or a drawing gives them, and the closed loops that they make."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from geometry.blocks import Array
from geometry.errors import GeometryError

#: Ends nearer to each other than this share of the section's size are one point.
CLOSE = 1e-6
#: Names of edges and bodies that are given none.
FREE, RUBBER = "free", "rubber"


def _pair(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _pairs(value: Any) -> Any:
    return tuple(map(_pair, value)) if isinstance(value, list) else value


Point = Annotated[tuple[float, float], BeforeValidator(_pair)]
Points = Annotated[tuple[Point, ...], BeforeValidator(_pairs)]


class Edge(BaseModel):
    """``[[geometry.outline]]``: a straight edge, an arc through a point or a spline through several."""

    model_config = ConfigDict(
        frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False, populate_by_name=True
    )

    start: Point | None = Field(
        default=None, alias="from", description="[r, z], mm; absent = the end of the previous edge"
    )
    to: Point = Field(description="[r, z], mm")
    arc_through: Point | None = Field(default=None, description="a point of a circular arc, [r, z], mm")
    spline_through: Points | None = Field(
        default=None, description="points of a spline between the ends, [[r, z], ...], mm"
    )
    name: str = Field(default=FREE, description='"inner", "outer", the name of a plate; absent = free')
    body: str | None = Field(
        default=None, description="on the first edge of a loop: the plate or sleeve that it surrounds"
    )


@dataclass(frozen=True)
class OutlineCurve:
    """A piece of an outline.

    Attributes
    ----------
    kind
        "line", "arc" (three points), "spline" (through all points) or "nurbs" (control points).
    points : tuple of (r, z), mm
    name
        Name of the boundary.
    degree, knots, weights
        Degree, knots and weights of a "nurbs".
    """

    kind: Literal["line", "arc", "spline", "nurbs"]
    points: tuple[tuple[float, float], ...]
    name: str = FREE
    degree: int = 0
    knots: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()

    def reverse(self) -> OutlineCurve:
        """The same curve from its end to its start."""
        top = self.knots[-1] + self.knots[0] if self.knots else 0.0
        return OutlineCurve(
            self.kind,
            self.points[::-1],
            self.name,
            self.degree,
            tuple(top - knot for knot in self.knots[::-1]),
            self.weights[::-1],
        )


@dataclass(frozen=True)
class Loop:
    """A closed outline; `body` is what it surrounds: "rubber", a plate's or a sleeve's name."""

    curves: tuple[OutlineCurve, ...]
    body: str = RUBBER


def loops_of(edges: Sequence[Edge], where: str) -> tuple[Loop, ...]:
    """Follow the edges of a case file: a loop ends where it comes back to its first point.

    Parameters
    ----------
    edges : Sequence[Edge]
        Edges of the case file, mm.
    where : str
        File or key of the case, for messages.

    Raises
    ------
    GeometryError
        The outline has a gap.
    """
    size = _size([p for edge in edges for p in (edge.start, edge.to) if p is not None])
    loops: list[Loop] = []
    curves: list[OutlineCurve] = []
    body = RUBBER
    for number, edge in enumerate(edges):
        key = f"{where}[{number}]"
        if not curves:
            body = edge.body or RUBBER
            if edge.start is None:
                raise GeometryError(key, "begins a new outline and has no `from`", "from = [r, z]")
        elif edge.body is not None and edge.body != body:
            raise GeometryError(
                key, f'body = "{edge.body}" is given for an edge that does not begin an outline'
            )
        start = curves[-1].points[-1] if edge.start is None else edge.start
        if curves and _distance(curves[-1].points[-1], start) > CLOSE * size:
            raise GeometryError(
                key,
                f"the outline has a gap of {_distance(curves[-1].points[-1], start):.3g} mm between "
                f"{_point_text(curves[-1].points[-1])} and {_point_text(start)}",
                "each edge begins where the previous one ends",
            )
        if curves:
            start = curves[-1].points[-1]
        end = edge.to
        if curves and _distance(curves[0].points[0], end) <= CLOSE * size:
            end = curves[0].points[0]
        curves.append(_curve(edge, start, end, key, size))
        if len(curves) > 1 and end == curves[0].points[0]:
            loops.append(Loop(tuple(curves), body))
            curves = []
    if curves:
        first_point, last_point = curves[0].points[0], curves[-1].points[-1]
        raise GeometryError(
            where,
            f"the outline is open: it begins at {_point_text(first_point)} and ends at {_point_text(last_point)}, "
            f"{_distance(first_point, last_point):.3g} mm apart",
            "a closed outline",
        )
    return tuple(loops)


def _curve(
    edge: Edge, start: tuple[float, float], end: tuple[float, float], key: str, size: float
) -> OutlineCurve:
    if edge.arc_through is not None and edge.spline_through is not None:
        raise GeometryError(key, "is given as an arc and as a spline", "arc_through or spline_through")
    between = edge.spline_through or (() if edge.arc_through is None else (edge.arc_through,))
    points = (start, *between, end)
    if _distance(start, end) <= CLOSE * size and not between:
        raise GeometryError(key, f"has no length: it begins and ends at {_point_text(start)}")
    if edge.arc_through is not None and is_straight(points, size):
        points = (start, end)
    kind: Literal["line", "arc", "spline"] = (
        "line" if len(points) == 2 else "spline" if edge.spline_through else "arc"
    )
    return OutlineCurve(kind, points, edge.name)


def is_straight(points: Sequence[tuple[float, float]], size: float) -> bool:
    """Whether an arc through three points is a line.

    Parameters
    ----------
    points : sequence of (r, z)
        Three points, mm.
    size : float
        Size of the outline, mm.
    """
    a, b, c = (np.array(p) for p in points)
    return abs(float(np.cross(np.append(b - a, 0), np.append(c - a, 0))[2])) <= CLOSE * size**2


def _distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.hypot(a[0] - b[0], a[1] - b[1])


def _size(points: Sequence[tuple[float, float]]) -> float:
    array: Array = np.array(points, dtype=float).reshape(-1, 2)
    return float(np.ptp(array, axis=0).max(initial=0.0)) if len(array) else 0.0


def _point_text(point: tuple[float, float]) -> str:
    return f"({point[0]:g}, {point[1]:g})"
