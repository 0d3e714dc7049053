"""Results of locating a misfit: the unknown effect by cycle, branch, rate and time, and the map of the bushing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MissingProfile:
    """The smooth part of the misfit that a model leaves, along one quantity.

    Attributes
    ----------
    along : {"displacement", "time", "cycle", "rate"}
    branch : str
        "loading", "unloading", "hold", or empty for all.
    x : shape (n,)
        mm or rad, s, number of the cycle, mm/s or rad/s.
    mean, std : shape (n,)
        Posterior of recorded less simulated force, percent of the recorded force range.
    """

    channel: str
    along: Literal["displacement", "time", "cycle", "rate"]
    branch: str
    x: Array
    mean: Array
    std: Array


@dataclass(frozen=True)
class Missing:
    """What the unknown effect looks like.

    Attributes
    ----------
    probability : float
        Of the unknown effect: physics is missing that is not in the catalogue.
    share : float
        Share of the plain law's squared misfit above the noise that the most probable model leaves.
    force : mapping of str to array
        By channel, the posterior mean (n,) of recorded less simulated force at the samples, in the recording's unit.
    text : tuple of str
        Sentences, the most telling first: "the force falls with time, whatever the displacement".
    """

    probability: float
    share: float
    force: Mapping[str, Array]
    profiles: tuple[MissingProfile, ...]
    text: tuple[str, ...]


@dataclass(frozen=True)
class LocalMap:
    """Where in the rubber a change of stiffness would reduce the misfit of some channels together.

    Attributes
    ----------
    points : shape (n, 2) or (n, 3)
        Corners of the cells, mm: (R, Z) of the half-plane, or x, y, z.
    cells : shape (m, 3), (m, 4) or (m, 8)
        Indices of each cell's corners: triangles; tetrahedra or quadrilaterals; hexahedra.
    factor : shape (m,)
        Regularised change of stiffness that reduces the misfit: 0.1 is 10 % stiffer.
    local_gain, uniform_gain : float
        Share of the misfit's sum of squares that the map, and the best uniform factor, would remove, after the fitted
        parameters have been adapted.
    helps_locally : bool
        Whether a local change helps significantly more than a uniform one.
    """

    channels: tuple[str, ...]
    points: Array
    cells: NDArray[np.int64]
    factor: Array
    local_gain: float
    uniform_gain: float
    helps_locally: bool
    text: str

    @property
    def name(self) -> str:
        """Names of the channels: "axial + radial"."""
        return " + ".join(self.channels)
