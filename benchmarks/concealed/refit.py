"""How closely models without an effect can fit a noise-free curve that has it, by nonlinear fits of their parameters.

To first order an effect may seem visible although the law can imitate it with large changes of its parameters: swaging
beside soft sleeves showed by 6 standard errors to first order, and by one when both were fitted. Indistinguishable
effects are not misses. A fit that stops too early leaves too much, which makes the score stricter, never milder.
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
"""Weighed forces (n,) and their derivatives (n, p) at parameters (p,); raise where they cannot be computed."""

# The fit ends where the sum of squares falls by less than this share, or after this number of evaluations: each
# simulates all channels, and a percent of a strength does not matter.
CHANGE, MOST = 0.03, 10
# Standard errors assigned to a curve that cannot be computed.
FAR = 1e4


def remaining_misfit(curves: Curves, target: Array, start: Array, lower: Array, upper: Array) -> float:
    """Standard errors between the curves and a target (n,) that remain when the parameters (p,) are fitted.

    Parameters
    ----------
    curves
        Points at which they cannot be computed are avoided.
    target : shape (n,)
        Weighed like the curves.
    start, lower, upper : shape (p,)
        The start may lie on a bound.
    """
    known: dict[bytes, tuple[Array, Array]] = {}

    def value_and_slope(x: Array) -> tuple[Array, Array]:
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
    fit = least_squares(
        lambda x: value_and_slope(x)[0],
        inside,
        jac=lambda x: value_and_slope(x)[1],
        bounds=(lower, upper),
        x_scale=unit,
        ftol=CHANGE,
        max_nfev=MOST,
    )
    return float(np.sqrt(2.0 * fit.cost))
