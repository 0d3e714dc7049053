"""How near models without an effect come to a noise-free curve that has it, their parameters fitted in earnest.

To first order in the law an effect may seem to show that the law, moved a long way, can imitate: swaging beside soft
sleeves showed by 6 standard errors to first order, and by one when both were fitted. What cannot be told is no miss.
A fit that stops too early leaves too much: then the score is stricter than it need be, never milder.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bushcli.effects.rig import NoEquilibrium
from cases.march import NotConverged

Array = NDArray[np.float64]
Curves = Callable[[Array], tuple[Array, Array]]
"""Weighed forces (n,) and their derivatives (n, p) at parameters (p,); raises where they cannot be computed."""

# The fit ends where the sum of squares falls by less than this share, or after so many evaluations: each is a
# simulation of all channels, and a percent of a strength is of no importance.
CHANGE, MOST = 0.03, 10
# Standard errors that stand for a curve that cannot be computed.
FAR = 1e4


def left(curves: Curves, target: Array, start: Array, lower: Array, upper: Array) -> float:
    """Standard errors that are left between the curves and a target (n,) when the parameters (p,) are fitted.

    Parameters
    ----------
    curves
        A point where they cannot be computed is no way to go.
    target : shape (n,)
        Weighed as the curves are.
    start, lower, upper : shape (p,)
        The start may lie on a bound.
    """
    known: dict[bytes, tuple[Array, Array]] = {}

    def both(x: Array) -> tuple[Array, Array]:
        key = x.tobytes()
        if key not in known:
            try:
                value, slope = curves(x)
            except (NotConverged, NoEquilibrium):
                value, slope = np.full(len(target), FAR) + target, np.zeros((len(target), len(x)))
            known[key] = value - target, slope
        return known[key]

    unit = np.where(start != 0.0, np.abs(start), 1.0)
    inside = np.clip(start, np.nextafter(lower, np.inf), np.nextafter(upper, -np.inf))
    found = least_squares(
        lambda x: both(x)[0],
        inside,
        jac=lambda x: both(x)[1],
        bounds=(lower, upper),
        x_scale=unit,
        ftol=CHANGE,
        max_nfev=MOST,
    )
    return float(np.sqrt(2.0 * found.cost))
