"""Extrapolation along a path, of equilibria or of their rates: the polynomial through the last ones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Two points nearer to each other than this share of the step ahead count as one.
CLOSEST = 0.2
# Parabola through the last three: a cubic overshoots where the free surface folds.
PREDICTOR_STATES = 3


@dataclass
class Known:
    """The last `most` points of a march, the newest last: displacements (mm or rad) and this rank's unknowns there."""

    most: int = PREDICTOR_STATES
    q: list[float] = field(default_factory=list)
    x: list[Array] = field(default_factory=list)

    def add(self, q: float, x: Array) -> None:
        """Add a point.

        Parameters
        ----------
        q
            Displacement, mm or rad.
        x
            This rank's unknowns, shape (n,).
        """
        # One state per displacement: an elastic body has one, and the extrapolation needs distinct points.
        keep = [i for i, known in enumerate(self.q) if abs(known - q) > 1e-12 * max(1.0, abs(q))]
        self.q = [*[self.q[i] for i in keep][1 - self.most :], q]
        self.x = [*[self.x[i] for i in keep][1 - self.most :], x]

    def forget(self) -> None:
        """Discard all points but the newest."""
        self.q, self.x = self.q[-1:], self.x[-1:]

    def extrapolate(self, q: float) -> Array:
        """Lagrange polynomial through the points, at q.

        Points that nearly coincide, as where a path returns, would make wild polynomials: only the newer of them is
        used.
        """
        apart = CLOSEST * abs(q - self.q[-1])
        chosen: list[int] = []
        for i in reversed(range(len(self.q))):
            if all(abs(self.q[i] - self.q[j]) > apart for j in chosen):
                chosen.append(i)
        nodes = [self.q[i] for i in chosen]
        weights = [np.prod([(q - m) / (n - m) for m in nodes if m != n]) for n in nodes]
        return np.asarray(sum(w * self.x[i] for w, i in zip(weights, chosen, strict=True)))
