"""Noise of a sampled signal, estimated from the signal itself.

A divided difference of order p annihilates polynomials of degree below p: what it leaves of a smooth signal
is noise. Scaled to unit variance it is a sample of the noise whatever the spacing, and a robust mean over
all windows disregards the few that straddle a kink (a turning point, the start of a hold).

References
----------
Hall, Kay, Titterington (1990), Asymptotically optimal difference-based estimation of variance in
nonparametric regression, Biometrika 77:521-528, doi:10.1093/biomet/77.3.521 (difference-based estimators).
Rousseeuw, Croux (1993), Alternatives to the median absolute deviation, J. Am. Stat. Assoc. 88:1273-1283,
doi:10.1080/01621459.1993.10476408 (the median absolute deviation and its factor 1.4826).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]


def noise(values: Array, abscissa: Array, order: int = 3, groups: NDArray[np.int_] | None = None) -> float:
    """Return the standard deviation of the noise in a signal.

    Parameters
    ----------
    values : (n,) array
    abscissa : (n,) array
        Strictly monotonic; what the noise-free signal is a smooth function of (time, sample number,
        displacement).
    order : int
        Of the differences; lowered when there are too few samples.
    groups : (n,) array of int, optional
        Only windows within one group count, so that kinks between groups do no harm. Ignored where the groups
        are too short to give half as many windows as there are samples.

    Returns
    -------
    float
        In the unit of ``values``; 0 for fewer than 3 samples. Where the sampling is coarse the curvature of
        the signal is counted as noise: an upper bound.
    """
    n = len(values)
    order = min(order, n - 1)
    if order < 2:
        return 0.0
    residuals = _differences(values, abscissa, order)
    if groups is not None:
        within = groups[order:] == groups[:-order]
        if within.sum() >= n / 2:
            residuals = residuals[within]
    return _spread(np.abs(residuals))


def _spread(sizes: Array) -> float:
    """Return the standard deviation behind the sizes (m,) of residuals, outliers left out.

    The median absolute deviation finds the outliers; the root mean square of the rest uses the data better
    (the median alone scatters by 12 % for 250 samples, this by 8 %).
    """
    sigma = 1.4826 * float(np.median(sizes))
    for _ in range(3):
        kept = sizes[sizes <= 3.0 * sigma]
        # 0.9733: variance of a standard normal cut off at 3.
        sigma = float(np.sqrt(np.mean(kept**2) / 0.9733))
    return sigma


def _differences(values: Array, abscissa: Array, order: int) -> Array:
    """Return divided differences (n - order,), scaled so that white noise keeps its variance."""
    x = sliding_window_view(abscissa, order + 1)
    x = (x - x[:, :1]) / (x[:, -1:] - x[:, :1])
    gaps = x[:, :, None] - x[:, None, :]
    gaps[:, range(order + 1), range(order + 1)] = 1.0
    weights = 1.0 / gaps.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    return np.asarray(np.einsum("ij,ij->i", weights, sliding_window_view(values, order + 1)))
