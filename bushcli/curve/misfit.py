"""Measures of a difference between two forces: root mean square, largest value, correlation between neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: No recording is trusted to better than this share of its force range, because models and rigs are no more accurate.
NOISE_FLOOR = 1e-3


def rms_percent(difference: Array, force: Array) -> float:
    """Return the root mean square of a difference in percent of the range of the force.

    Parameters
    ----------
    difference : (n,) array
        In the unit of the force.
    force : (m,) array
        The force that has the range.
    """
    return 100.0 * float(np.sqrt(np.mean(difference**2))) / float(np.ptp(force))


def peak_percent(difference: Array, force: Array) -> float:
    """Return the largest difference in percent of the range of the force.

    Parameters
    ----------
    difference : (n,) array
        In the unit of the force.
    force : (m,) array
        The force that has the range.
    """
    return 100.0 * float(np.max(np.abs(difference))) / float(np.ptp(force))


def correlation_time(misfit: Array) -> float:
    """How many neighbouring samples of a misfit (n,) count as one: 1 for white noise.

    Sum of the autocorrelation up to the first window that is five times the sum so far (Sokal's rule). The mean is
    not subtracted: a misfit with a mean is not noise.

    References
    ----------
    Sokal (1997), Monte Carlo methods in statistical mechanics, doi:10.1007/978-1-4899-0319-8_6.
    """
    n, power = len(misfit), float(misfit @ misfit)
    if n < 8 or power == 0.0:
        return 1.0
    spectrum = np.fft.rfft(misfit, 2 * n)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum))[: n // 2] / power
    sums = 1.0 + 2.0 * np.cumsum(correlation[1:])
    enough = np.flatnonzero(np.arange(1, len(sums) + 1) >= 5.0 * sums)
    return float(np.clip(sums[enough[0]] if len(enough) else sums[-1], 1.0, n / 4))
