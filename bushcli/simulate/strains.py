"""Largest strains of a march, the share of states in which the law is unstable, and distorted elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cases.march import History
from cases.model import FiniteElementModel
from cases.simulate import Rubber
from cases.stability import stable
from cases.stretches import stretch_points, stretches_at

Array = NDArray[np.float64]

# States of the march that are checked, evenly chosen.
CHECKED_STATES = 6


# Volume ratio at a point of an element beyond which the element no longer describes the rubber there, which hardly
# changes its volume. Elements keep it only in the mean. On default meshes the ratio stays between 0.6 and 1.5 up to the
# displacement at which the rubber folds around the edge of a bond, and leaves 0.5 to 2 at once there (a plain 12/22/40
# bushing radially, on meshes of 2,600 and 9,700 unknowns: 0.69 to 1.34 at 4 mm, 0.002 to 2.1 at 4.5 mm; 2.4 % between
# their forces).
DISTORTED = 2.0


@dataclass(frozen=True)
class Strains:
    """Strains of the rubber over a march.

    Attributes
    ----------
    range : tuple of float
        Smallest and largest principal stretch.
    unstable : float
        Share of the states in which the law violates Drucker's postulate.
    volumes : tuple of float
        Smallest and largest volume ratio at a point of an element.
    distorted : float or None
        Displacement (mm, rad; s on a path of six motions) of the first checked state with a volume ratio beyond
        `DISTORTED` or below its reciprocal.
    """

    range: tuple[float, float] = (1.0, 1.0)
    unstable: float = 0.0
    volumes: tuple[float, float] = (1.0, 1.0)
    distorted: float | None = None


def strains_over_march(model: FiniteElementModel, history: History, rubber: Rubber) -> Strains:
    """Return the strains of the rubber over a march."""
    assert history.states is not None
    low, high, unstable, total = np.array([1.0, 1.0]), np.array([1.0, 1.0]), 0, 0
    distorted: float | None = None
    count = len(history.states)
    points = stretch_points(model)
    for i in np.unique(np.linspace(0, count - 1, min(CHECKED_STATES, count)).round().astype(int)):
        values = stretches_at(points, history.states[i]).reshape(-1, 3)
        volumes = values.prod(axis=1)
        unstable += int(np.count_nonzero(~stable(rubber.law, rubber.parameters, values)))
        total += len(values)
        low = np.minimum(low, _everywhere(model, [values, volumes], np.min, MPI.MIN))
        high = np.maximum(high, _everywhere(model, [values, volumes], np.max, MPI.MAX))
        if distorted is None and (low[1] < 1.0 / DISTORTED or high[1] > DISTORTED):
            distorted = float(history.displacement[i])
    unstable, total = model.comm.allreduce(unstable), model.comm.allreduce(total)
    stretches, ratios = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return Strains(stretches, unstable / max(total, 1), ratios, distorted)


def _everywhere(
    model: FiniteElementModel, values: Sequence[Array], extreme: Callable[..., float], operation: MPI.Op
) -> Array:
    """Return an extreme of each array over all ranks; 1 where there are no values."""
    extremes = [float(extreme(value)) if value.size else 1.0 for value in values]
    return np.array([model.comm.allreduce(value, operation) for value in extremes])
