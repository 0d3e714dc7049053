"""State of SciPy's trust region between two evaluations: iteration, length of the trial step, radius.

`scipy.optimize.least_squares` reports none of these while it runs. However, it asks for the misfit at every trial, and
the radius follows from the misfits by short, deterministic rules, which are repeated here beside the optimiser. A
test compares the result with SciPy's own radii. Lengths are in the optimiser's units: each parameter times the largest
norm that its column of the Jacobian has had, so that a length of one changes the weighted misfit by about one; in trf,
near a bound, also divided by the root of the distance to it.

References
----------
Branch, Coleman and Li (1999), SIAM J. Sci. Comput. 21:1-23, doi:10.1137/S1064827595289108 (trf).
Voglis and Lagaris (2004), WSEAS Int. Conf. on Applied Mathematics, Corfu (dogbox).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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
    method
        "trf" or "dogbox".
    lower, upper : shape (parameters,)
    """

    def __init__(self, method: Literal["trf", "dogbox"], lower: Array, upper: Array) -> None:
        self.method, self.lower, self.upper = method, lower, upper
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
        moved = x - self.x
        if self.method == "trf":
            hat = moved / self._scale
            length = float(np.linalg.norm(hat))
        else:
            hat, length = moved, float(np.abs(moved * self._norms).max())
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
        hit = length > 0.95 * self.radius if self.method == "trf" else length >= self.radius * (1 - 1e-9)
        if ratio < 0.25:
            self.radius = 0.25 * length
        elif ratio > 0.75 and hit:
            self.radius *= 2.0
        if fell > 0:
            self.misfit = misfit

    def derives(self, x: Array, jacobian: Array) -> None:
        """Record that the optimiser asks for the derivatives at `x`, which it does after it has moved there.

        Parameters
        ----------
        x : Array
            Parameters, shape (parameters,), in the units of the law.
        jacobian : Array
            Derivatives of the weighted misfit, shape (samples, parameters).
        """
        norms = np.linalg.norm(jacobian, axis=0)
        if self.radius is None:
            self._norms = np.where(norms == 0, 1.0, norms)
        else:
            self._norms = np.maximum(self._norms, norms)
            self.iteration += 1
        self.x, gradient = x.copy(), jacobian.T @ self.misfit
        if self.method == "trf":
            self._follow_trf(jacobian, gradient)
        else:
            stuck = ((x == self.lower) & (gradient > 0)) | ((x == self.upper) & (gradient < 0))
            self._slope, self._gradient = jacobian, np.where(stuck, 0.0, gradient)
            self._curvature = np.zeros(len(x))
            if self.radius is None:
                self.radius = float(np.abs(x * self._norms).max()) or 1.0

    def _follow_trf(self, jacobian: Array, gradient: Array) -> None:
        """Apply Coleman and Li's scaling by the distance to the bound that lies in the direction of descent."""
        up = (gradient < 0) & np.isfinite(self.upper)
        down = (gradient > 0) & np.isfinite(self.lower)
        distance = np.where(up, self.upper - self.x, np.where(down, self.x - self.lower, 1.0))
        towards = np.where(up, -1.0, np.where(down, 1.0, 0.0))
        distance = np.where(towards != 0, distance * self._norms, distance)
        self._scale = np.sqrt(distance) / self._norms
        self._slope, self._gradient = jacobian * self._scale, gradient * self._scale
        self._curvature = gradient * towards / self._norms
        if self.radius is None:
            self.radius = float(np.linalg.norm(self.x * self._norms / np.sqrt(distance))) or 1.0
