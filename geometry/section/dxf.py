"""A section from a DXF file: x is the radius, y the axis, layers are names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from geometry.connections import BONDS
from geometry.errors import GeometryError
from geometry.isolated import isolated
from geometry.section.outline import FREE, RUBBER, Loop, OutlineCurve, is_straight
from geometry.section.spline import pieces
from geometry.size import MILLIMETRES, Unit

#: $INSUNITS -> unit; 0 is "no unit", which in drawings of parts means mm.
STATED: dict[int, Unit] = {1: "inch", 4: "mm", 5: "cm", 6: "m"}
#: Layers that name no boundary.
UNNAMED = ("0", "free", "rubber", "outline", "void", "defpoints")
#: Largest gap that drawings leave between the ends of two entities, as a share of their size.
GAP = 1e-4
#: Largest numbers of curves that are chained, and of parts of blocks that are looked at: 1 s each.
MOST_CURVES, MOST_PARTS = 2000, 20_000


@dataclass(frozen=True)
class Drawing:
    """Contents of a drawing.

    Attributes
    ----------
    loops
        Closed outlines, mm.
    unit
        Unit of its numbers; None where neither the drawing nor the case states one, and they are taken as mm.
    stated
        Unit that the drawing states, if it does, whatever the case says.
    """

    loops: tuple[Loop, ...]
    unit: Unit | None
    stated: Unit | None


@cache
@isolated("is not a readable DXF file", lambda path, *_: path)
def read_dxf(path: Path, changed: float, unit: Unit | None = None) -> Drawing:
    """Read the closed loops of a drawing.

    Parameters
    ----------
    path : Path
        The file.
    changed : float
        Time of the file's last change, s since 1970: a file that was changed is read again.
    unit : Unit or None
        Unit of its numbers; None for the one that it states.

    Raises
    ------
    GeometryError
        It cannot be read, it contains no curves, or an outline is open.
    """
    import ezdxf

    try:
        drawing = ezdxf.readfile(path)
    except OSError as error:
        raise GeometryError(
            str(path), f"cannot be read: {error.strerror or 'it is not a DXF file'}"
        ) from None
    number = drawing.header.get("$INSUNITS", 0)
    if unit is None and number != 0:
        if number not in STATED:
            raise GeometryError(
                str(path),
                f"has unit number {number} ($INSUNITS)",
                f"geometry.unit, one of {list(MILLIMETRES)}",
            )
        unit = STATED[number]
    stated = STATED.get(number)
    hidden_layers = {
        layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or layer.is_frozen()
    }
    curves = _all_curves(drawing.modelspace(), MILLIMETRES[unit or "mm"], hidden_layers, str(path))
    if not curves:
        raise GeometryError(
            str(path),
            "contains no lines, arcs, polylines or splines"
            + (" on a visible layer" if hidden_layers else ""),
        )
    off = sorted(layer.dxf.name for layer in drawing.layers if layer.dxf.name.lower() in hidden_layers)
    return Drawing(_loops(curves, str(path), off), unit, stated)


def _all_curves(
    entities: Iterable[Any], scale: float, hidden_layers: Set[str], where: str
) -> list[OutlineCurve]:
    """The curves of a drawing, at most `MOST_CURVES`; blocks in blocks may have any number."""
    left = iter(range(MOST_PARTS))
    curves: list[OutlineCurve] = []
    for entity in entities:
        try:
            for curve in islice(_curves(entity, scale, left, hidden_layers), MOST_CURVES + 1 - len(curves)):
                curves.append(_with_size(curve))
        except RecursionError:
            raise GeometryError(where, "has a block that contains itself") from None
        except Exception as error:  # noqa: BLE001 - ezdxf and SciPy raise anything for impossible values
            what = f"{_entity_text(entity)} cannot be drawn: {' '.join(str(error).split()) or type(error).__name__}"
            raise GeometryError(where, what, "delete it or draw it again") from None
    if len(curves) > MOST_CURVES or next(left, None) is None:
        what = f"has more than {MOST_CURVES} curves, or blocks with more than {MOST_PARTS} parts"
        raise GeometryError(
            where, what, "a drawing of the section only, with lines and arcs or fewer splines"
        )
    return curves


def _entity_text(entity: Any) -> str:
    """Return how messages name an entity: by its type, its number in the file, and its layer."""
    return f'{entity.dxftype()} {entity.dxf.get("handle", "")} on layer "{entity.dxf.get("layer", "0")}"'


def _with_size(curve: OutlineCurve) -> OutlineCurve:
    """Return the curve, an arc without curvature as a line; ValueError where it has no size."""
    size = float(np.ptp(np.array(curve.points), axis=0).max())
    # OpenCASCADE takes points within 1e-7 mm as one.
    if not 1e-7 < size < np.inf:
        place = ", ".join(f"{x:g}" for x in curve.points[0])
        raise ValueError(f"it has no size, at ({place}) mm" if size <= 1e-7 else "its points are not finite")
    if curve.kind == "arc" and is_straight(curve.points, size):
        return replace(curve, kind="line", points=(curve.points[0], curve.points[-1]))
    return curve


def _curves(
    entity: Any, scale: float, left: Iterator[int], hidden_layers: Set[str] = frozenset(), block: str = "0"
) -> Iterator[OutlineCurve]:
    """Yield the curves of an entity; no more once as many parts of blocks as `left` has have been visited.

    What a block draws on layer 0 takes the layer of the block, `block`.
    """
    kind, layer = entity.dxftype(), str(entity.dxf.layer)
    layer = block if layer == "0" else layer
    name = FREE if layer.lower() in UNNAMED else layer.lower() if layer.lower() in BONDS else layer
    if layer.lower() in hidden_layers:
        return
    if kind == "INSERT":
        for single in entity.multi_insert():
            if next(left, None) is None:
                return
            for part in single.virtual_entities():
                if next(left, None) is None:
                    return
                yield from _curves(part, scale, left, hidden_layers, layer)
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        for part in entity.virtual_entities():
            # A corner that is drawn twice makes a side without length.
            if part.dxftype() != "LINE" or not part.dxf.start.isclose(part.dxf.end):
                yield from _curves(part, scale, left, block=layer)
    elif kind == "LINE":
        yield OutlineCurve("line", _points([entity.dxf.start, entity.dxf.end], scale), name)
    elif kind == "ARC":
        start = entity.dxf.start_angle
        angle = (entity.dxf.end_angle - start) % 360.0
        yield _arc(entity, start, angle or 180.0, scale, name)
        if angle == 0.0:
            yield _arc(entity, start + 180.0, 180.0, scale, name)
    elif kind == "CIRCLE":
        yield _arc(entity, 0.0, 180.0, scale, name)
        yield _arc(entity, 180.0, 180.0, scale, name)
    elif kind in ("SPLINE", "ELLIPSE"):
        yield from _spline(entity, kind, scale, name)


def _arc(entity: Any, start: float, angle: float, scale: float, name: str) -> OutlineCurve:
    turns = np.radians(start + angle * np.array([0.0, 0.5, 1.0]))
    centre, radius = entity.dxf.center, entity.dxf.radius
    # In drawings made from the other side the axis is reversed.
    sign = -1.0 if entity.dxf.extrusion.z < 0 else 1.0
    points = [(sign * (centre.x + radius * np.cos(a)), centre.y + radius * np.sin(a)) for a in turns]
    return OutlineCurve("arc", tuple((float(x) * scale, float(y) * scale) for x, y in points), name)


def _spline(entity: Any, kind: str, scale: float, name: str) -> list[OutlineCurve]:
    from ezdxf.math import rational_bspline_from_ellipse

    tool = entity.construction_tool()
    if kind == "ELLIPSE":
        tool = rational_bspline_from_ellipse(tool)
    weights = tuple(map(float, tool.weights())) or (1.0,) * len(tool.control_points)
    knots = np.array(tool.knots(), dtype=float)
    # OpenCASCADE's largest degree is 25.
    if not 1 <= tool.degree <= 25 or len(knots) != len(tool.control_points) + tool.degree + 1:
        raise ValueError(
            f"its degree is {tool.degree}, with {len(tool.control_points)} control points and {len(knots)} knots"
        )
    if np.any(np.diff(knots) < 0.0) or knots[tool.degree] >= knots[-1 - tool.degree] or min(weights) <= 0.0:
        raise ValueError("its knots do not increase, or a weight is not positive")
    points = _points(tool.control_points, scale)
    return pieces(OutlineCurve("nurbs", points, name, tool.degree, tuple(map(float, tool.knots())), weights))


def _points(points: Sequence[Any], scale: float) -> tuple[tuple[float, float], ...]:
    return tuple((float(p.x) * scale, float(p.y) * scale) for p in points)


def _loops(curves: Sequence[OutlineCurve], where: str, off: Sequence[str]) -> tuple[Loop, ...]:
    """Chain the curves: first those of one layer that close by themselves, then the rest."""
    end_points = np.array([p for curve in curves for p in (curve.points[0], curve.points[-1])])
    gap = GAP * float(np.ptp(end_points, axis=0).max())
    loops, open_curves = [], []
    for layer in dict.fromkeys(curve.name for curve in curves):
        layer_curves = [curve for curve in curves if curve.name == layer]
        closed, left = _closed_chains(layer_curves, gap)
        body = RUBBER if layer in (FREE, *BONDS) else layer
        loops += [Loop(loop, body) for loop in closed]
        open_curves += left
    # Where corners of a sleeve and of the rubber coincide, an outline continues on the layer that it began on.
    closed, left = _closed_chains(sorted(open_curves, key=lambda curve: curve.name in BONDS), gap)
    if left:
        ends = [p for curve in left for p in (curve.points[0], curve.points[-1])]
        end_points = np.array(ends)
        distances = (np.hypot(*(end_points - p).T) for p in ends)
        open_end = next((p for p, d in zip(ends, distances, strict=True) if np.sum(d <= gap) == 1), ends[0])
        layers = " and ".join(f'"{name}"' for name in sorted({curve.name for curve in left}))
        gaps = [float(np.hypot(open_end[0] - q[0], open_end[1] - q[1])) for q in ends]
        width, place = min(
            ((d, q) for d, q in zip(gaps, ends, strict=True) if d > gap), default=(0.0, open_end)
        )
        nearest = f", {width:.3g} mm from the next open end at ({place[0]:g}, {place[1]:g})" if width else ""
        layers_off = f"; layers that are off or frozen are left out: {', '.join(off)}" if off else ""
        raise GeometryError(
            where,
            f"an outline is open at ({open_end[0]:g}, {open_end[1]:g}){nearest}; "
            f"{len(left)} {'curves' if len(left) > 1 else 'curve'} of {layers} in no closed outline{layers_off}",
            f"closed outlines only: no gaps above {gap:.2g} mm, no centre lines, no duplicate lines",
        )
    return (*(Loop(loop, _body(loop)) for loop in closed), *loops)


def _body(loop: Sequence[OutlineCurve]) -> str:
    """The body of an outline on several layers: a sleeve if they are one bond and one other name, else rubber."""
    names = {curve.name for curve in loop}
    body_names = names - {*BONDS}
    return body_names.pop() if len(names) == 2 and len(body_names) == 1 and FREE not in body_names else RUBBER


def _closed_chains(
    curves: Sequence[OutlineCurve], gap: float
) -> tuple[list[tuple[OutlineCurve, ...]], list[OutlineCurve]]:
    """Closed chains of curves, and the curves that are left."""
    ends = np.array([(curve.points[0], curve.points[-1]) for curve in curves]).reshape(-1, 2, 2)
    unused = np.ones(len(curves), dtype=bool)
    closed, left = [], []
    for start, curve in enumerate(curves):
        if not unused[start]:
            continue
        unused[start] = False
        chain = [curve]
        while not _meet(chain[0].points[0], chain[-1].points[-1], gap) or len(chain[0].points) < 2:
            end = chain[-1].points[-1]
            within_gap = np.hypot(ends[..., 0] - end[0], ends[..., 1] - end[1]) <= gap
            number = int(np.argmax(unused & within_gap.any(axis=1)))
            if not (unused[number] and within_gap[number].any()):
                break
            unused[number] = False
            following = curves[number] if within_gap[number, 0] else curves[number].reverse()
            chain.append(_start_at(following, end))
        if _meet(chain[0].points[0], chain[-1].points[-1], gap):
            chain[0] = _start_at(chain[0], chain[-1].points[-1])
            closed.append(tuple(chain))
        else:
            left += chain
    return closed, left


def _meet(a: tuple[float, float], b: tuple[float, float], gap: float) -> bool:
    return float(np.hypot(a[0] - b[0], a[1] - b[1])) <= gap


def _start_at(curve: OutlineCurve, start: tuple[float, float]) -> OutlineCurve:
    """The curve with its first point where the last one ended."""
    return OutlineCurve(
        curve.kind, (start, *curve.points[1:]), curve.name, curve.degree, curve.knots, curve.weights
    )
