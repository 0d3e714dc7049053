"""Odd curves: the force at -q is minus that at q, so that only one side of rest is solved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def both_halves(q: Array, values: Array, mirrored: Array | None = None) -> tuple[Array, Array]:
    """Return an odd curve on both sides of rest, in the order of its displacement.

    Parameters
    ----------
    q : (n,) array
        Displacement on one side, mm or rad; rest may be among it.
    values : (n, ...) array
        Force, or several odd quantities.
    mirrored : (n, ...) array, optional
        Values at -q, where they are not -values.
    """
    both, first = np.unique(np.concatenate([q, -q]), return_index=True)
    return both, np.concatenate([values, -values if mirrored is None else mirrored])[first]


def swept_range(q: Array, odd: bool) -> tuple[float, float]:
    """Return the displacements, mm or rad, between which a curve has to be solved to be known along a path q, (n,).

    Parameters
    ----------
    q : (n,) array
        mm or rad; rest is added.
    odd : bool
        Whether one side of rest is enough: the positive one.
    """
    low, high = min(0.0, float(q.min())), max(0.0, float(q.max()))
    return (0.0, max(high, -low)) if odd else (low, high)
