"""A structured parameter domain: intervals along its axes, and the chart that maps it to space."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Interval:
    """One block along a parameter axis, and the vertices of its elements.

    `grading` is the length of the longest element over that of the shortest; the short ones lie at the `fine` end(s).
    """

    start: float
    stop: float
    elements: int
    grading: float = 1.0
    fine: Literal["start", "stop", "both"] = "both"

    def vertices(self) -> Array:
        """The elements' end points, shape (elements + 1,), from start to stop."""
        k = np.arange(self.elements)
        n = max(self.elements - 1, 1)
        depth = {"start": n - k, "stop": k, "both": np.abs(2 * k - n)}[self.fine] / n
        lengths = self.grading**-depth
        return self.start + (self.stop - self.start) * np.concatenate(
            [[0.0], np.cumsum(lengths) / lengths.sum()]
        )


@dataclass(frozen=True)
class Blocks:
    """A structured parameter domain: the product of the axes' intervals, without blocks that have no region.

    Attributes
    ----------
    axes
        The intervals of each parameter axis, in order; 2 or 3 axes.
    region
        Midpoint of a block in parameters -> name of its region, or None where there is nothing.
    face
        Axis normal to a bounding face and the face's midpoint in parameters -> its name. It is also called for faces
        toward a missing block.
    chart
        Parameters (n, d) -> coordinates (n, d) in mm.
    closed
        True when the chart glues the ends of the second axis (a full circumference).
    """

    axes: tuple[tuple[Interval, ...], ...]
    region: Callable[[Array], str | None]
    face: Callable[[int, Array], str | None]
    chart: Callable[[Array], Array]
    closed: bool = False
