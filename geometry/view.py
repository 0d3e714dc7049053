"""Contents of a picture of a geometry: flat triangles and lines, each with the name of its interpretation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array


@dataclass(frozen=True)
class View:
    """The outside of a part as triangles; or a section, in the plane (r, 0, z), with its boundary as lines.

    Attributes
    ----------
    triangles : shape (n, 3, 3)
        Corners, mm.
    label : shape (n,)
        Index into `names`.
    names : tuple of str
        Interpretation of each part: "inner", "outer", "free", "rubber", a plate's name, "not closed".
    lines : shape (m, 2, 3)
        Ends, mm.
    line_label : shape (m,)
    """

    triangles: Array
    label: NDArray[np.int_]
    names: tuple[str, ...]
    lines: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    line_label: NDArray[np.int_] = field(default_factory=lambda: np.zeros(0, dtype=int))

    @property
    def flat(self) -> bool:
        """Whether the view shows a section."""
        return len(self.lines) > 0
