"""Properties of a signal for the searches for bad samples: smallest step, repetitions, abscissa."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.recording import Recording

Array = NDArray[np.float64]

# Values that differ by a smaller share of the range count as the same number: a conversion of units may round them.
SAME = 1e-9


def quantum(values: Array) -> float:
    """Return the smallest step between two different values (n,), such as that of an analogue-digital converter."""
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps > SAME * float(np.ptp(values))]
    return float(gaps.min()) if len(gaps) else 0.0


def repetitions(values: Array) -> list[tuple[int, int]]:
    """Return the runs (start, stop) of two or more equal neighbours among values (n,)."""
    equal = np.abs(np.diff(values)) <= SAME * float(np.ptp(values))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(int), [0]])))
    return [(int(a), int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def abscissa(recording: Recording) -> Array:
    """Return the abscissa (n,) over which the signals are smooth: time in s, or the sample number."""
    return np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time


def slope(x: Array, y: Array) -> float:
    """Return the slope of a straight line through points (n,); 0 where x does not change."""
    x = x - x.mean()
    power = float(x @ x)
    return float(x @ (y - y.mean())) / power if power > 0 else 0.0


def moving_samples(recording: Recording) -> NDArray[np.bool_]:
    """Return which samples (n,) belong to a motion, the first sample of a hold included.

    In a hold the force relaxes while the displacement rests: it tells nothing of stiffness or sign.
    """
    mask = np.zeros(len(recording.force), dtype=bool)
    for branch in recording.branches:
        if branch.kind != "hold":
            mask[branch.start : branch.stop + 1] = True
    return mask
