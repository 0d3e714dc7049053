"""What a picture of a geometry shows: flat triangles, each with the name of what it was taken for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry.blocks import Array


@dataclass(frozen=True)
class View:
    """Triangles of the outside of a part, or of a section.

    Attributes
    ----------
    triangles : shape (n, 3, 3)
        Corners, mm.
    label : shape (n,)
        Index into `names`.
    names : tuple of str
        What faces were taken for: "inner", "outer", "free", a plate's name, "not closed".
    """

    triangles: Array
    label: NDArray[np.int_]
    names: tuple[str, ...]
