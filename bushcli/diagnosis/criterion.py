"""When another effect pays, and when nothing is left to explain.

The misfit is compared in units of the noise and in independent samples (`noise_model`): n samples with correlation
time T bring n / T of each to sums of squares.

References
----------
Schwarz (1978), Estimating the dimension of a model, Ann. Stat. 6:461-464, doi:10.1214/aos/1176344136.
Wald and Wolfowitz (1940), On a test whether two samples are from the same population, Ann. Math. Stat. 11:147-162,
doi:10.1214/aoms/1177731909 (number of runs).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f, norm

from bushcli.diagnosis.noise_model import Compared, autoregression

Array = NDArray[np.float64]

# Probability of noise below which a misfit is not taken for noise.
LEVEL = 0.01
# A misfit of this share of the noise it is said to have is not that noise: chance takes off a tenth, not a half.
_FLOORED = 0.5
# Fewer innovations say nothing about their order.
_FEWEST = 20


@dataclass(frozen=True)
class NoiseTest:
    """Whether a misfit can be noise.

    Attributes
    ----------
    size : float
        Root mean square misfit over the noise, freedom of the fitted parameters allowed for.
    p_size : float
        Probability of a misfit of that size or more by noise.
    p_neighbours : float
        Probability that noise makes neighbouring samples that much alike (correlation at lag 1, one-sided).
    p_runs : float
        Probability of as few changes of sign.
    """

    size: float
    p_size: float
    p_neighbours: float
    p_runs: float

    @property
    def p(self) -> float:
        """Probability that noise fails one of the tests like this (Bonferroni)."""
        return min(1.0, 3.0 * min(self.p_size, self.p_neighbours, self.p_runs))

    @property
    def is_noise(self) -> bool:
        """Whether nothing speaks against it."""
        return self.p > LEVEL


def chi_square(channels: Sequence[Compared]) -> float:
    """Sum of squares of the misfit in units of the noise and in independent samples."""
    return float(sum(np.sum((np.where(c.known, c.misfit, 0.0) * c.weights) ** 2) for c in channels))


def effective_samples(channels: Sequence[Compared]) -> float:
    """Number of independent samples of all channels."""
    return sum(channel.effective_samples for channel in channels)


def bic_change(drop: float, parameters: int, samples: float) -> float:
    """Change of BIC when chi square falls by `drop` at the price of further parameters."""
    return parameters * float(np.log(max(samples, 2.0))) - drop


def least_chi_square(channels: Sequence[Compared], parameters: int) -> float:
    """The least sum of squares that noise leaves, allowing for how well it is known: with probability `LEVEL` less."""
    freedom = max(effective_samples(channels) - parameters, 1.0)
    known = min(channel.noise.freedom for channel in channels)
    return freedom * float(f.ppf(LEVEL, freedom, min(known, 1e9)))


def noise_test(channels: Sequence[Compared], parameters: int) -> NoiseTest:
    """Test whether the misfit that is left can be noise: by its size, and by the order of its samples.

    The order is tested on the innovations, which noise with memory has in no order either. The sign of neighbours is
    robust, their product is sensitive; both see a misfit that is small but smooth, long before its size tells. A misfit
    that is clearly less than the noise has been given a floor that noise need not reach, and its order does not matter.

    Parameters
    ----------
    channels : sequence of Compared
    parameters : int
        That were fitted to them.
    """
    samples = effective_samples(channels)
    freedom = max(samples - parameters, 1.0)
    size = chi_square(channels) / freedom
    known = min(channel.noise.freedom for channel in channels)
    floored = np.sqrt(size) < _FLOORED
    innovations = [] if floored else [_innovations(channel) for channel in channels]
    ordered = [e for e in innovations if len(e) >= _FEWEST]
    return NoiseTest(
        size=float(np.sqrt(size)),
        p_size=float(f.sf(size, freedom, min(known, 1e9))),
        p_neighbours=_neighbours(ordered),
        p_runs=_runs(ordered),
    )


def _innovations(channel: Compared) -> Array:
    """Innovations of the misfit; gaps where the simulation has no answer are closed up."""
    misfit = _in_noise(channel)
    return autoregression(channel.noise, misfit) if len(misfit) > 1 else misfit


def _in_noise(channel: Compared) -> Array:
    return np.asarray(channel.misfit[channel.known] / channel.noise.sigma, dtype=np.float64)


def _neighbours(innovations: Sequence[Array]) -> float:
    """One-sided probability of the correlation at lag 1, which has the variance 1 / n in noise."""
    if not innovations:
        return 1.0
    sums = [float(e[1:] @ e[:-1]) / (float(e @ e) / len(e)) for e in innovations if e.any()]
    n = sum(len(e) - 1 for e in innovations)
    return float(norm.sf(sum(sums) / np.sqrt(n)))


def _runs(innovations: Sequence[Array]) -> float:
    """Probability of as few runs of one sign, about the median of each channel being zero."""
    changes = sum(int(np.count_nonzero(np.diff(np.sign(e)) != 0)) for e in innovations)
    n = sum(len(e) - 1 for e in innovations)
    if n == 0:
        return 1.0
    # Each neighbour has the other sign with probability 1/2; half a change for continuity.
    return float(norm.cdf((changes + 0.5 - 0.5 * n) / np.sqrt(0.25 * n)))
