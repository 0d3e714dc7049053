"""Noise of a sampled signal, estimated from the signal itself.

A divided difference of order p annihilates polynomials of degree below p, so that only noise remains of a smooth
signal. Scaled to unit variance it is a sample of the noise for any spacing, and a robust mean over all windows
disregards the few that straddle a kink (a turning point, the start of a hold). Windows that contain a single bad
sample are left out: such a spike is in p + 1 windows, so that 1 % of spikes affects 5 % of the windows of fourth
differences, some of them too little to be recognised alone.

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

# Highest order of differences: of a sine of six samples a cycle the ninth leave 0.5 % of the amplitude.
HIGHEST = 9
# Standard deviations beyond which a sample counts as a spike; of 1e6 samples of normal noise fewer than one lies
# beyond.
_SPIKE = 5.0
# Least number of windows for which the median is certain enough to recognise a spike.
_ENOUGH = 20
# Of a converter's steps: share of the range below which a change is rounding; part of a step by which a change may
# differ from a whole number (decimals of the file, another unit), and least share of changes that do not; least uneven
# changes per move; and least range in steps, as a relaxation on ten levels is no staircase of a converter. Judgement.
_ROUNDING, _OFF_LEVEL, _ON_LEVELS, _UNEVEN, _FEWEST_LEVELS = 1e-7, 0.1, 0.95, 0.01, 15
# Windows that are computed at a time, so that what is needed for them stays in the processor's cache.
_PIECE = 8_192


def noise(values: Array, abscissa: Array, order: int = 3, groups: NDArray[np.int_] | None = None) -> float:
    """Return the standard deviation of the noise in a signal."""
    n = len(values)
    order = min(order, n - 1)
    if order < 2:
        return 0.0
    m, width = n - order, order + 1
    within = np.ones(m, dtype=bool)
    if groups is not None and (same_group := groups[order:] == groups[:-order]).sum() >= n / 2:
        within = same_group
    residuals, height, power = np.empty(m), np.zeros(n), np.zeros(n)
    for start in range(0, m, _PIECE):
        piece = slice(start, min(start + _PIECE, m))
        weights = _weights(abscissa[start : piece.stop + order], order)
        windows = sliding_window_view(values[start : piece.stop + order], width)
        residuals[piece] = np.einsum("ij,ij->i", weights, windows)
        # Least squares for the height of a spike at each sample, from the windows that contain the sample.
        weights[~within[piece]] = 0.0
        for j in range(width):
            height[start + j : piece.stop + j] += weights[:, j] * residuals[piece]
            power[start + j : piece.stop + j] += weights[:, j] ** 2
    if within.sum() < _ENOUGH:
        return _spread(np.abs(residuals[within]))
    # The height of a spike, divided by its standard error for residuals of 1: a few windows, as at the ends, determine
    # it poorly.
    fitted = power > 0.0
    size = np.abs(np.divide(height, np.sqrt(power), out=np.zeros_like(height), where=fitted))
    high = np.flatnonzero(size > _SPIKE * median_deviation(size[fitted]))
    # The neighbours of a spike share its windows and also appear high: the highest among them is the spike.
    beside = sliding_window_view(np.pad(size, width - 1), 2 * width - 1)[high]
    high = high[size[high] == beside.max(axis=1)]
    spiked = np.zeros(n + width - 1, dtype=bool)
    for j in range(width):
        spiked[high + j] = True
    used = within & ~spiked[width - 1 : n]
    # A large share of outliers is not a few bad samples; without them the noise would be underestimated.
    return _spread(np.abs(residuals[used if used.sum() >= 0.7 * within.sum() else within]))


def noise_of_sparse(
    values: Array, abscissa: Array, order: int, groups: NDArray[np.int_] | None = None
) -> float:
    """Return the standard deviation of the noise in a signal that may be sampled sparsely.

    Sines of ten samples a cycle are smooth, but not for third differences, which make noise of a twenty-fifth of their
    amplitude out of them. Higher orders count where they leave less than half: of noise they leave as much.
    """
    sigma = noise(values, abscissa, order, groups)
    for higher in range(order + 2, HIGHEST + 1, 2):
        less = noise(values, abscissa, higher, groups)
        sigma = less if less < 0.5 * sigma else sigma
    return sigma


def converter_step(values: Array) -> float:
    """Return the step of the converter that a moving signal was recorded with; 0 where none shows.

    Between most samples such a signal changes by whole numbers of one step, and not evenly: it rests on a level, or
    jumps by one step more. An exact program on equidistant points changes its rate at corners only.

    Parameters
    ----------
    values : (n,) array
        The signal, in any unit.

    Returns
    -------
    float
        In the unit of the signal.
    """
    span = float(np.ptp(values))
    changes = np.diff(values)
    sizes = np.abs(changes)
    moves = np.sort(sizes[sizes > _ROUNDING * span])
    if len(moves) < _ENOUGH:
        return 0.0
    # One in a hundred may be a bad sample, or a step that was cut.
    least = moves[len(moves) // 100]
    step = float(np.median(moves[(moves >= least) & (moves < 1.5 * least)]))
    whole = changes / step
    multiples = np.abs(whole - np.round(whole)) < _OFF_LEVEL
    # A change that exceeds both of its neighbours, or neither, as at no corner.
    turns = np.diff(np.round(whole))
    uneven = np.count_nonzero(turns[1:] * turns[:-1] < 0.0)
    fine = span > _FEWEST_LEVELS * step and uneven > _UNEVEN * len(moves)
    return step if fine and multiples[sizes > _ROUNDING * span].mean() > _ON_LEVELS else 0.0


def median_deviation(sizes: Array) -> float:
    """Return the standard deviation of normal residuals from the median of their absolute values (m,), m > 0.

    `np.median` does the same, but loads NumPy's masked arrays (4 ms), which nothing else at start needs.
    """
    middle = [(len(sizes) - 1) // 2, len(sizes) // 2]
    return 1.4826 * (0.5 * float(np.partition(sizes, middle)[middle].sum()))


def _spread(sizes: Array) -> float:
    """Return the standard deviation of residuals from their absolute values (m,), outliers left out.

    The median absolute deviation finds the outliers; the root mean square of the rest uses the data better
    (the median alone scatters by 12 % for 250 samples, this by 8 %).
    """
    sigma = median_deviation(sizes)
    for _ in range(3):
        inner = sizes[sizes <= 3.0 * sigma]
        # 0.9733: variance of a standard normal cut off at 3.
        sigma = float(np.sqrt(np.mean(inner**2) / 0.9733))
    return sigma


def _weights(abscissa: Array, order: int) -> Array:
    """Return the weights (n - order, order + 1) of divided differences, scaled to keep the variance of white noise."""
    x = sliding_window_view(abscissa, order + 1)
    x = ((x - x[:, :1]) / (x[:, -1:] - x[:, :1])).T.copy()
    products = np.ones_like(x)
    for j in range(order + 1):
        for k in range(order + 1):
            if j != k:
                products[j] *= x[j] - x[k]
    weights = np.ascontiguousarray(1.0 / products.T)
    return np.asarray(weights / np.linalg.norm(weights, axis=1)[:, None])
