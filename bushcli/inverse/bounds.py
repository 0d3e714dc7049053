"""Lower and upper bounds of the parameters that are identified."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bounds:
    """Bounds of the parameters.

    Attributes
    ----------
    lower, upper : shape (parameters,)
        Each in its parameter's unit; infinite where there is none.
    """

    lower: Array
    upper: Array

    def clip(self, x: Array) -> Array:
        """Return the nearest point within the bounds."""
        return np.clip(x, self.lower, self.upper)

    def inside(self, x: Array) -> Array:
        """Return the nearest point slightly off the bounds, on which interior methods cannot start."""
        off = 1e-9 * np.minimum(self.upper - self.lower, 1.0 + np.abs(x))
        return np.clip(x, self.lower + off, self.upper - off)

    def of(self, free: NDArray[np.bool_]) -> Bounds:
        """Return the bounds of some of the parameters, chosen by a mask, shape (parameters,)."""
        return Bounds(self.lower[free], self.upper[free])
