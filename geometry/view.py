"""Contents of a picture of a geometry: flat triangles and lines, each with the name of its interpretation."""

from __future__ import annotations

from collections.abc import Mapping
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
    solids : shape (k, 3, 3)
        Closed surfaces of the bodies of an assembly, mm: a face between two bodies is there twice.
    solid_label : shape (k,)
    captions : mapping of str to str
        Words of the legend for names that need more than the name.
    """

    triangles: Array
    label: NDArray[np.int_]
    names: tuple[str, ...]
    lines: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))
    line_label: NDArray[np.int_] = field(default_factory=lambda: np.zeros(0, dtype=int))
    solids: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    solid_label: NDArray[np.int_] = field(default_factory=lambda: np.zeros(0, dtype=int))
    captions: Mapping[str, str] = field(default_factory=dict)

    @property
    def shows_assembly(self) -> bool:
        """Whether the view shows several bodies in space."""
        return len(self.solids) > 0

    @property
    def flat(self) -> bool:
        """Whether the view shows a section."""
        return len(self.lines) > 0


def caption(name: str, state: str, volume: float, plate: bool) -> str:
    """Return the words of a legend for a body.

    Parameters
    ----------
    name : str
        Name of the body.
    state : str
        "rigid" or "elastic"; empty for rubber.
    volume : float
        Volume, mm^3.
    plate : bool
        Whether it is a plate.
    """
    words = [
        name.replace("_", " ") + " (plate)" * (plate and "plate" not in name),
        state,
        f"{volume:.5g} mm³",
    ]
    return ", ".join(word for word in words if word)
