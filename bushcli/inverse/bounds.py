"""Bounds of a search's parameters, and its coordinates: differences, logarithms, shares of the stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Smallest ratio of a parameter that is searched in its logarithm to where its search begins.
LEAST = 1e-9


@dataclass(frozen=True)
class Bounds:
    """Bounds of the parameters, and which of them are searched in their logarithm.

    Attributes
    ----------
    lower, upper : shape (parameters,)
        Each in its parameter's unit; infinite where there is none.
    logarithmic : shape (parameters,)
        Positive parameters whose size is not known, such as a relaxation time.
    """

    lower: Array
    upper: Array
    logarithmic: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((), dtype=bool))

    def clip(self, x: Array) -> Array:
        """Return the nearest point within the bounds."""
        return np.clip(x, self.lower, self.upper)

    def inside(self, x: Array) -> Array:
        """Return the nearest point slightly off the bounds, on which interior methods cannot start."""
        margin = 1e-9 * np.minimum(self.upper - self.lower, 1.0 + np.abs(x))
        return np.clip(x, self.lower + margin, self.upper - margin)

    def of(self, free: NDArray[np.bool_]) -> Bounds:
        """Return the bounds of some of the parameters, chosen by a mask, shape (parameters,)."""
        logarithmic = np.broadcast_to(self.logarithmic, free.shape)
        return Bounds(self.lower[free], self.upper[free], logarithmic[free])

    def about(
        self, origin: Array, shares: Callable[[Array], tuple[Array, Array]]
    ) -> tuple[Bounds, Callable[[Array], Array], Callable[[Array], Array]]:
        """Return the bounds of a search's coordinates (p,), the way back to x (p,), and its derivative (p, p).

        They are zero at the origin, which is within the bounds. A coordinate is the difference from the origin, or the
        logarithm of the ratio. What may be zero is searched down to a billionth of its origin: the curves know nothing
        of it there. A parameter with a share of the stiffness follows the others so that it keeps that share, which the
        curves show best: in mu and alpha of Ogden's law a search would follow the curved valley mu alpha = constant in
        short steps (21 evaluations in place of 7 from mu = 0.04 MPa, alpha = 8 to 0.4, 1.2), and not pass alpha = 0.

        Parameters
        ----------
        origin : shape (p,)
        shares : callable
            x -> derivatives of the initial shear modulus by parameters, shape (p,), and theirs, shape (p, p)
            (`LeastSquaresProblem.stiffness_shares`).
        """
        lower = np.where(self.logarithmic, np.maximum(self.lower, LEAST * origin), self.lower)
        at_origin, _ = shares(origin)
        follows = at_origin != 0.0

        def along(y: Array) -> Array:
            ratio = np.exp(np.where(self.logarithmic, y, 0.0))
            return self.clip(np.where(self.logarithmic, origin * ratio, origin + y))

        def factors(x: Array) -> tuple[Array, Array]:
            values, slopes = shares(x)
            values = np.where(follows & (values != 0.0), values, 1.0)
            factor = np.where(follows, at_origin, 1.0) / values
            return factor, -np.where(follows, factor / values, 0.0)[:, None] * slopes

        def point(y: Array) -> Array:
            x = along(y)
            return self.clip(x * factors(x)[0])

        def derivative(y: Array) -> Array:
            x = along(y)
            factor, slopes = factors(x)
            return np.asarray((np.diag(factor) + x[:, None] * slopes) * np.where(self.logarithmic, x, 1.0))

        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [
                np.where(self.logarithmic, np.log(end / origin), end - origin) for end in (lower, self.upper)
            ]
        return Bounds(*ends), point, derivative
