"""What any law could do about a misfit, at most.

A law without memory makes the force a function of the displacement alone. The best of all smooth functions, one for
each channel, is an upper bound of what a richer law can take away: where rubber answers differently on the way out and
on the way back, no law needs to be tried.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from bushcli.diagnosis import weighing
from bushcli.diagnosis.linearised import Linearised
from bushcli.diagnosis.noise_model import Compared

Array = NDArray[np.float64]

# Intervals of the spline over a channel's range: stiffening towards the ends takes no more.
INTERVALS = 8


def most(channels: Sequence[Compared], factors: Sequence[float], fit: Linearised) -> float:
    """By how much the weighed sum of squares falls at most when the force may be any smooth function of displacement.

    What as many free parameters would take away from noise is taken off.

    Parameters
    ----------
    channels
        Compared at the fit's parameters.
    factors
        Standard deviations of the channels' common factors.
    fit
    """
    bases = [_splines(channel.recording.displacement) for channel in channels]
    columns: list[Array] = []
    for i, basis in enumerate(bases):
        blocks = [basis if i == j else np.zeros((len(b), basis.shape[1])) for j, b in enumerate(bases)]
        columns.append(weighing.columns(channels, factors, blocks))
    own = fit.left(np.hstack(columns))
    u, s, _ = np.linalg.svd(own, full_matrices=False)
    u = u[:, s > 1e-8 * max(float(s.max(initial=0.0)), 1e-300)]
    return max(0.0, float(np.sum((u.T @ fit.rest) ** 2)) - u.shape[1])


def _splines(q: Array) -> Array:
    """Cubic B-splines at the displacements q (n,), shape (n, INTERVALS + 3)."""
    low, high = float(q.min()), float(q.max())
    if high <= low:
        return np.ones((len(q), 1))
    knots = np.concatenate([[low] * 3, np.linspace(low, high, INTERVALS + 1), [high] * 3])
    return np.asarray(BSpline.design_matrix(q, knots, 3).toarray())
