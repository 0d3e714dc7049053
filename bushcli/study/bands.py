"""Curves of all designs as a band: quantiles of the force at the same displacements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.study.rows import Rows

Array = NDArray[np.float64]

# Most curves that are read (evenly chosen), and number of points at which curves with different displacements are
# compared.
MOST_CURVES, POINTS = 2000, 61
LEVELS = (0.0, 0.05, 0.5, 0.95, 1.0)


@dataclass(frozen=True)
class Band:
    """Quantiles of the curves of a channel.

    Attributes
    ----------
    displacement : shape (n,)
        mm or degrees.
    force : shape (5, n)
        N or N mm: smallest, 5 %, 50 %, 95 %, largest.
    count : int
        Number of curves.
    """

    channel: str
    displacement: Array
    force: Array
    count: int


def band(rows: Rows, channel: str) -> Band | None:
    """Return the band of a channel; None where the curves share no range, or are loops of different programs."""
    names = [f"{channel}.displacement", f"{channel}.force"]
    stride = max(1, -(-rows.count // MOST_CURVES))
    pairs: list[tuple[Array, Array]] = []
    seen = 0
    for table in rows.tables(["status", *names]):
        status = table["status"].to_pylist()
        chosen = [i for i in range(len(status)) if status[i] == "ok" and (seen + i) % stride == 0]
        seen += len(status)
        if not chosen:
            continue  # Arrow cannot select rows by an empty list, which has no type
        for q, force in zip(*(table[name].take(chosen).to_pylist() for name in names), strict=True):
            if q and len(q) == len(force):
                pairs.append((np.array(q), np.array(force)))
    if len(pairs) < 2:
        return None
    reference = pairs[0][0]
    if all(len(q) == len(reference) and np.allclose(q, reference, rtol=1e-9, atol=1e-12) for q, _ in pairs):
        return Band(
            channel, reference, np.quantile([force for _, force in pairs], LEVELS, axis=0), len(pairs)
        )
    # By growing displacement; a curve that turns has no band with others.
    curves = [(q, force) if q[-1] > q[0] else (q[::-1], force[::-1]) for q, force in pairs]
    if any((np.diff(q) <= 0).any() for q, _ in curves):
        return None
    low, high = max(q[0] for q, _ in curves), min(q[-1] for q, _ in curves)
    if not low < high:
        return None
    at = np.linspace(low, high, POINTS)
    return Band(
        channel, at, np.quantile([np.interp(at, q, f) for q, f in curves], LEVELS, axis=0), len(curves)
    )
