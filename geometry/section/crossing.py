"""Detection of outlines that cross themselves or the axis, on polylines before anything is drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geometry.blocks import Array
from geometry.errors import GeometryError
from geometry.section.outline import CLOSE, Loop, OutlineCurve

#: Pieces of a curved edge, and of a span between two knots at the least: a spline of 200 points may turn in each.
PIECES, SPAN = 24, 6
#: Largest number of points along an outline, curves in `PIECES`: their pairs are then examined in some 5 s.
MOST_POINTS = 25_000
#: Sides whose pairs with all others are examined together.
ROWS = 100


def refuse_crossings(loops: Sequence[Loop], where: str) -> None:
    """Refuse an outline that crosses itself or the axis.

    Parameters
    ----------
    loops : Sequence[Loop]
        Closed outlines, in mm.
    where : str
        File or key of the case, for messages.

    Raises
    ------
    GeometryError
        A radius is negative, an edge lies on the axis from both sides, or an outline crosses itself or has too many
        points.
    """
    if not loops:
        raise GeometryError(where, "has no outline", "[[geometry.outline]] or file")
    for loop in loops:
        lines = [polyline(curve) for curve in loop.curves]
        outline = np.concatenate([line[:-1] for line in lines])
        if len(outline) > MOST_POINTS:
            what = f"an outline has {len(outline)} points, each curve counted as {PIECES} of them"
            raise GeometryError(where, what, f"at most {MOST_POINTS}: draw it with fewer lines and arcs")
        size = float(np.ptp(outline, axis=0).max())
        if outline[:, 0].min() < -CLOSE * size:
            r, z = outline[np.argmin(outline[:, 0])]
            what = f"the outline has a negative radius at ({r:.4g}, {z:.4g})"
            raise GeometryError(
                where, what, "x is the radius and y the axis: draw the half of the section with x >= 0"
            )
        crossing = _crossing(outline)
        if crossing is not None:
            r, z = crossing
            raise GeometryError(where, f"the outline crosses itself at ({r:.4g}, {z:.4g})")


def polyline(curve: OutlineCurve) -> Array:
    """Points along a curve, ends included, shape (n, 2)."""
    points = np.array(curve.points, dtype=float)
    if curve.kind == "line":
        return points
    from scipy.interpolate import BSpline, CubicSpline  # 0.1 s: only where it is needed

    t: Array = np.linspace(0.0, 1.0, PIECES + 1, dtype=np.float64)
    if curve.kind == "arc":
        return _arc(points, t)
    if curve.kind == "nurbs":
        low, high = curve.knots[curve.degree], curve.knots[-1 - curve.degree]
        weighted = np.column_stack([points * np.array(curve.weights)[:, None], curve.weights])
        spans = len(curve.points) - curve.degree
        t = np.linspace(0.0, 1.0, max(PIECES, SPAN * spans) + 1, dtype=np.float64)
        values = BSpline(np.array(curve.knots), weighted, curve.degree)(low + (high - low) * t)
        return np.asarray(values[:, :2] / values[:, 2:])
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.asarray(CubicSpline(chord, points)(np.linspace(0.0, chord[-1], PIECES * (len(points) - 1) + 1)))


def _arc(points: Array, t: Array) -> Array:
    a, m, b = points
    # Centre: at the same distance from all three.
    matrix, right = 2 * np.array([m - a, b - a]), np.array([m @ m - a @ a, b @ b - a @ a])
    centre = np.linalg.solve(matrix, right)
    angles = [np.arctan2(*(p - centre)[::-1]) for p in points]
    turn = 2 * np.pi
    through, whole = (angles[1] - angles[0]) % turn, (angles[2] - angles[0]) % turn or turn
    if through > whole:
        whole -= turn
    sweep = angles[0] + whole * t
    return centre + np.linalg.norm(a - centre) * np.column_stack([np.cos(sweep), np.sin(sweep)])


def _crossing(outline: Array) -> Array | None:
    """Return the point where two sides of a closed polygon cross, or None."""
    a, b = outline, np.roll(outline, -1, axis=0)
    low, high, d = np.minimum(a, b), np.maximum(a, b), b - a
    n = len(a)
    # The sides in groups: all pairs of a fine outline would need gigabytes.
    for first_row in range(0, n, ROWS):
        rows = np.arange(first_row, min(first_row + ROWS, n))
        overlapping = np.arange(n) >= rows[:, None] + 2
        for k in range(2):
            overlapping &= (low[rows, None, k] <= high[:, k]) & (low[:, k] <= high[rows, None, k])
        i, j = np.nonzero(overlapping)
        i = rows[i]
        keep = (i != 0) | (j != n - 1)
        i, j = i[keep], j[keep]
        between = a[j] - a[i]
        det = d[i, 0] * d[j, 1] - d[i, 1] * d[j, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (between[:, 0] * d[j, 1] - between[:, 1] * d[j, 0]) / det
            t = (between[:, 0] * d[i, 1] - between[:, 1] * d[i, 0]) / det
        # Open intervals: what merely touches is left to Gmsh.
        crossings = np.flatnonzero((s > 1e-9) & (s < 1 - 1e-9) & (t > 1e-9) & (t < 1 - 1e-9))
        if len(crossings):
            return np.asarray(a[i[crossings[0]]] + s[crossings[0]] * d[i[crossings[0]]])
    return None
