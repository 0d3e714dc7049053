"""Channels that were logged more slowly than the others: rows that only repeat the last value are left out.

That is safe only where the pattern is regular: the channel changes every k-th row, by steps far beyond the resolution
of its converter, while the other channel keeps changing. A coarse converter, a hold, or single lost telegrams look
different; `bushcli.faults` detects these.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Least number of runs of equal samples in a pattern; least share of runs that last k rows, and a multiple of k rows.
_FEWEST, _MOST_K, _MULTIPLE = 10, 0.7, 0.97
#: Least change of the channel in steps of the converter, and share of the runs in which the other channel changes.
_STEPS, _GOES_ON = 3.0, 0.8


def updates(values: Array, other: Array) -> Mask | None:
    """Return whether each row (n,) has a new value of a channel that is updated every k-th row; None for others."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    runs = np.diff(changes)
    if len(changes) < _FEWEST:
        return None
    stride = int(np.bincount(runs).argmax())
    regular = stride > 1 and np.mean(runs == stride) >= _MOST_K and np.mean(runs % stride == 0) >= _MULTIPLE
    steps = np.median(np.abs(np.diff(values)[changes - 1])) >= _STEPS * np.diff(np.unique(values)).min()
    kept = np.arange(len(values)) % stride == np.bincount(changes % stride).argmax()
    found = (
        regular and steps and np.mean([np.ptp(other[a:b]) > 0.0 for a, b in pairwise(changes)]) >= _GOES_ON
    )
    return kept if found else None
