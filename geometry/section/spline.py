"""NURBS curves as Gmsh takes them: clamped, and not closed by themselves.

References
----------
Piegl and Tiller (1997), The NURBS Book, Springer, doi:10.1007/978-3-642-59223-2, section 5.2: knot insertion.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geometry.section.outline import CLOSE, OutlineCurve


def pieces(curve: OutlineCurve) -> list[OutlineCurve]:
    """Return a NURBS curve with its ends at its first and last control points; a closed one in two halves.

    Parameters
    ----------
    curve
        Of kind "nurbs", with any knots.
    """
    from scipy.interpolate import BSpline, insert  # 0.1 s: only where it is needed

    degree, knots = curve.degree, np.array(curve.knots)
    weights = np.array(curve.weights)
    # In homogeneous coordinates a rational spline is an ordinary one.
    spline = BSpline(knots, np.column_stack([np.array(curve.points) * weights[:, None], weights]), degree)
    low, high = float(knots[degree]), float(knots[-1 - degree])
    ends = np.array([point[:2] / point[2] for point in (spline(low), spline(high))])
    size = float(np.ptp(np.array(curve.points), axis=0).max())
    closed = float(np.linalg.norm(ends[1] - ends[0])) <= CLOSE * size
    cuts = [low, 0.5 * (low + high), high] if closed else [low, high]
    tolerance = 1e-12 * (high - low)

    def equal(cut: float) -> int:
        """Number of knots at a cut."""
        return int(np.count_nonzero(np.abs(spline.t - cut) <= tolerance))

    for cut in cuts:
        if equal(cut) < degree:
            spline = insert(cut, spline, m=degree - equal(cut))
    # Each cut has as many equal knots as the degree: the curve passes through the control point before them.
    knot_indices = [int(np.searchsorted(spline.t, cut - tolerance)) for cut in cuts]
    knot_indices[0] += equal(low) - degree
    curves = []
    for (first_knot, last_knot), (start, stop) in zip(pairwise(knot_indices), pairwise(cuts), strict=True):
        control = np.asarray(spline.c)[first_knot - 1 : last_knot]
        inner = spline.t[first_knot + degree : last_knot]
        t = [start] * (degree + 1) + [float(knot) for knot in inner] + [stop] * (degree + 1)
        points = control[:, :2] / control[:, 2:]
        curves.append(
            OutlineCurve(
                "nurbs",
                tuple((float(r), float(z)) for r, z in points),
                curve.name,
                degree,
                tuple(t),
                tuple(float(w) for w in control[:, 2]),
            )
        )
    return curves
