"""State of SciPy's trust region between two evaluations: iteration, length of the trial step, radius.

`scipy.optimize.least_squares` reports none of these while it runs. However, it asks for the misfit at every trial, and
the radius follows from the misfits by short, deterministic rules, which are repeated here beside the optimiser. A
test compares the result with SciPy's own radii. Lengths are in the optimiser's units: each parameter times the largest
norm that its column of the Jacobian has had, so that a length of one changes the weighted misfit by about one;
near a bound also divided by the root of the distance to it.

References
----------
Branch, Coleman and Li (1999), SIAM J. Sci. Comput. 21:1-23, doi:10.1137/S1064827595289108 (trf).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.bounds import Bounds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """A trial of the optimiser: iteration (0 is the start), length of the step, and the radius that bounded it."""

    iteration: int
    step: float
    radius: float


class Follower:
    """Computes the trust region of a linear loss from the points and values that the optimiser exchanges.

    Parameters
    ----------
    bounds
    """

    def __init__(self, bounds: Bounds) -> None:
        self.bounds = bounds
        self.iteration = 0
        self.radius: float | None = None
        self.x: Array = np.zeros(0)
        self.misfit: Array = np.zeros(0)
        self._norms: Array = np.zeros(0)
        self._trial: tuple[Array, float] | None = None

    def asks(self, x: Array) -> Trial:
        """Record that the optimiser asks for the misfit at `x`; return the trial."""
        if self.radius is None:
            return Trial(0, 0.0, float("nan"))
        hat = (x - self.x) / self._scale
        length = float(np.linalg.norm(hat))
        self._trial = hat, length
        return Trial(self.iteration + 1, length, self.radius)

    def gets(self, misfit: Array) -> None:
        """Record the misfit at the last trial, and update the radius from it."""
        if self._trial is None or self.radius is None:
            self.misfit = misfit
            return
        hat, length = self._trial
        if not np.isfinite(misfit).all():
            self.radius = 0.25 * length
            return
        fell = 0.5 * float(self.misfit @ self.misfit - misfit @ misfit)
        change = self._slope @ hat
        predicted = -float(self._gradient @ hat + 0.5 * (change @ change + hat @ (self._curvature * hat)))
        ratio = fell / predicted if predicted > 0 else 1.0 if predicted == fell == 0 else 0.0
        if ratio < 0.25:
            self.radius = 0.25 * length
        elif ratio > 0.75 and length > 0.95 * self.radius:
            self.radius *= 2.0
        if fell > 0:
            self.misfit = misfit

    def derives(self, x: Array, jacobian: Array) -> None:
        """Record that the optimiser asks for the derivatives at `x`, which it does after it has moved there."""
        norms = np.linalg.norm(jacobian, axis=0)
        if self.radius is None:
            self._norms = np.where(norms == 0, 1.0, norms)
        else:
            self._norms = np.maximum(self._norms, norms)
            self.iteration += 1
        self.x, gradient = x.copy(), jacobian.T @ self.misfit
        # Coleman and Li's scaling by the distance to the bound that lies in the direction of descent.
        up = (gradient < 0) & np.isfinite(self.bounds.upper)
        down = (gradient > 0) & np.isfinite(self.bounds.lower)
        distance = np.where(up, self.bounds.upper - self.x, np.where(down, self.x - self.bounds.lower, 1.0))
        towards = np.where(up, -1.0, np.where(down, 1.0, 0.0))
        distance = np.where(towards != 0, distance * self._norms, distance)
        self._scale = np.sqrt(distance) / self._norms
        self._slope, self._gradient = jacobian * self._scale, gradient * self._scale
        self._curvature = gradient * towards / self._norms
        if self.radius is None:
            self.radius = float(np.linalg.norm(self.x * self._norms / np.sqrt(distance))) or 1.0
