"""Waves in a missing force: a period along the displacement or in time that describes most of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.recording import Recording
from cases.mode import modes

Array = NDArray[np.float64]

# Waves over the range of the displacement or the duration: fewer are a trend, as another law or a slow drift gives;
# more are sampled too coarsely by recordings of some hundred samples.
FEWEST, MOST, STEP = 3.0, 30.0, 0.1


def waves(recording: Recording, mean: Array) -> list[tuple[float, str]]:
    """Describe a missing force as one wave along the displacement, or in time.

    Parameters
    ----------
    recording : Recording
        n samples.
    mean : (n,) array
        Missing force, N, N mm or MPa; not zero everywhere.

    Returns
    -------
    list of (float, str)
        Share of the force's square that the best wave describes, with a sentence; in time only if that was recorded.
    """
    span = float(np.ptp(recording.force))
    mode = modes()[recording.mode]
    unit, factor = (" degrees", 180.0 / np.pi) if mode.rotational else (" mm", 1.0)
    if mode.specimen == "coupon":
        unit = " of strain"
    sentences = []
    for x, along, by, unit_of_x in (
        (recording.displacement, "along the displacement", factor, unit),
        (recording.time, "with time", 1.0, " s"),
    ):
        if x is not None and np.ptp(x) > 0.0:  # in a hold alone nothing moves
            share, period, amplitude = _best(x, mean)
            size = f"by {100 * amplitude / span:.1f} % of the range to either side"
            sentences.append(
                (share, f"the force rises and falls {along} every {by * period:.2g}{unit_of_x}, {size}")
            )
    return sentences


def _best(x: Array, mean: Array) -> tuple[float, float, float]:
    """Return share, period and amplitude of the wave along x (n,) that describes most."""
    reach = float(np.ptp(x))
    best = (-np.inf, reach, 0.0)
    for count in np.arange(FEWEST, MOST, STEP):
        phase = 2.0 * np.pi * count * (x - x[0]) / reach
        basis = np.column_stack([np.ones_like(x), np.cos(phase), np.sin(phase)])
        a = np.linalg.lstsq(basis, mean, rcond=None)[0]
        rest = mean - basis @ a
        share = 1.0 - float(rest @ rest) / float(mean @ mean)
        best = max(best, (share, reach / float(count), float(np.hypot(a[1], a[2]))))
    return best
