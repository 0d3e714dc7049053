"""What a misfit of noise alone looks like: its size, its memory from sample to sample, and how well both are known.

The noise comes from the recording itself, never from the misfit: a misfit that is smooth because physics is missing
would pass for noise with a long memory, and hide itself. Memory is that of a first-order autoregression, which shows
in how the noise grows when only every second sample is taken. An error that drifts over more than some ten samples
cannot be told from the curve by any means, and counts as misfit.

A sample that shares its error with others counts less: n samples with correlation time T are worth n / T independent
ones. `Compared.weights` puts this into the weights once, so that every sum of squares further on has one independent
sample as its unit.

References
----------
Hall and Van Keilegom (2003), Using difference-based methods for inference in nonparametric regression with time
series errors, J. R. Stat. Soc. B 65:443-456, doi:10.1111/1467-9868.00395.
Bayley and Hammersley (1946), The "effective" number of independent observations in an autocorrelated time series,
Suppl. J. R. Stat. Soc. 8:184-197, doi:10.2307/2983560.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.special import comb

from bushcli.recording import Recording, branches, displacement_noise, force_noise
from bushcli.recording.noise import noise

Array = NDArray[np.float64]

# No recording is trusted to better than this share of its force range, as in the identification: models are not.
FLOOR = 1e-3

_ORDER = 4
# Of the variance that differences of order 4 leave, in units of n, and standard deviation of the logarithm of its ratio
# at half the sampling rate, in units of 1 / sqrt(n): both simulated, 400 series of white noise of 60 to 1,000 samples.
_FREEDOM = 0.33
_RATIO_STD = 3.2
# Standard deviations, one-sided, by which noise has to differ from white noise.
_SURE = 3.0
# Memory of noise is looked for in branches of so many samples, and where there are so many in such branches: of fewer,
# every second one is too coarse for the curve, whose own curvature then looks like noise with a memory.
_LONG, _ENOUGH = 40, 120
# Polynomials that a branch is taken for, and samples per coefficient that it takes to leave noise.
_DEGREE, _PER_COEFFICIENT = 5, 3
# What polynomials leave may be larger than what differences leave by so many standard deviations of either: else they
# do not describe the branches.
_ALIKE = 2.0
# Beyond, differences of order 4 see next to nothing of the noise; the ratio tends to 2.
_LARGEST = 0.9
_LARGEST_RATIO = 2.0
# A coloured noise is known that much worse: the estimate scatters by 40 % in 400 samples (simulated).
_COLOURED_FREEDOM = 0.02


@dataclass(frozen=True)
class NoiseModel:
    """Noise of a recorded force, as first-order autoregression.

    Attributes
    ----------
    sigma : float
        Standard deviation, N, N mm or MPa; the displacement's noise included by way of the stiffness. More than 0.
    correlation : float
        Between neighbouring samples, 0 for white noise; less than 1.
    freedom : float
        Degrees of freedom behind ``sigma**2``; inf where it is known.
    """

    sigma: float
    correlation: float = 0.0
    freedom: float = float("inf")

    def __post_init__(self) -> None:
        if not (self.sigma > 0.0 and 0.0 <= self.correlation < 1.0 and self.freedom > 0.0):
            raise ValueError(f"noise model: {self} has values that no noise has")

    @property
    def correlation_time(self) -> float:
        """How many samples count as one: (1 + r) / (1 - r)."""
        return (1.0 + self.correlation) / (1.0 - self.correlation)


@dataclass(frozen=True)
class Compared:
    """A channel: what was recorded, what is simulated at the same samples, and the noise.

    Attributes
    ----------
    recording : Recording
        n samples.
    simulated : (n,) array
        Force, N, N mm or MPa; nan where the simulation has none.
    noise : NoiseModel
    """

    recording: Recording
    simulated: Array
    noise: NoiseModel

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.recording.name or self.recording.mode

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which samples (n,) can be compared."""
        return np.isfinite(self.simulated)

    @property
    def misfit(self) -> Array:
        """Simulated minus recorded force (n,), nan where it is not known."""
        return np.asarray(self.simulated - self.recording.force)

    @property
    def weights(self) -> Array:
        """What to multiply misfit and derivatives (n,) with: 1 / (sigma sqrt(correlation time)), 0 where not known."""
        unit = self.noise.sigma * np.sqrt(self.noise.correlation_time)
        return np.where(self.known, 1.0 / unit, 0.0)

    @property
    def effective_samples(self) -> float:
        """Number of independent samples."""
        return float(self.known.sum()) / self.noise.correlation_time


def noise_model(recording: Recording, floor: float = FLOOR) -> NoiseModel:
    """Return the noise of a recording, estimated from itself.

    Parameters
    ----------
    recording : Recording
    floor : float
        Smallest ``sigma``, as share of the recorded force range.

    Returns
    -------
    NoiseModel
        White unless the recording says otherwise at the level of three standard deviations. Coarse sampling makes
        ``sigma`` an upper bound, see `bushcli.recording.noise`.
    """
    n = len(recording.force)
    full, freedom = force_noise(recording), _FREEDOM * n
    size = full
    smooth = _beside_polynomials(recording)
    # Differences of order 4 use a third of what the samples know, polynomials most of it, where they fit.
    if smooth is not None and 0.0 < smooth[0] <= full * (1.0 + _ALIKE / np.sqrt(2.0 * freedom)):
        size, freedom = smooth
    correlation = 0.0
    sparse = _at_half_rate(recording)
    if sparse is not None and sparse[1] > 0:
        ratio, doubt = (sparse[0] / sparse[1]) ** 2, _SURE * _RATIO_STD / np.sqrt(n)
        # A larger ratio than any noise has is the curvature of a curve with few samples and little noise.
        if doubt < np.log(ratio) < np.log(_LARGEST_RATIO) + doubt:
            correlation, freedom = _correlation(ratio), _COLOURED_FREEDOM * n
            size = full / np.sqrt(_passed(correlation, 1))
    sigma = float(np.hypot(size, abs(recording.secant_stiffness()) * displacement_noise(recording)))
    least = floor * float(np.ptp(recording.force))
    if sigma <= least:
        return NoiseModel(least)
    return NoiseModel(sigma, correlation, max(freedom, 3.0))


def autoregression(noise: NoiseModel, values: Array) -> Array:
    """Return innovations (n - 1, ...): what each of the samples (n, ...) has that its predecessor does not foretell."""
    r = noise.correlation
    return np.asarray((values[1:] - r * values[:-1]) / np.sqrt(1.0 - r**2))


def correlation_time(misfit: Array) -> float:
    """How many neighbouring samples of a misfit (n,) count as one: 1 for white noise.

    Sum of the autocorrelation up to the first window that is five times the sum so far (Sokal's rule). The mean is
    not taken off: a misfit that has one is not noise.

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


def smoothed(recording: Recording) -> Array:
    """Recorded force (n,) without most of its noise, and none of a sample's own: what its branch foretells of it.

    A polynomial is fitted to each branch, without the sample; the force of short branches stays as it is.
    """
    fitted, leverage, _ = _polynomials(recording)
    left = (recording.force - fitted) / (1.0 - leverage)
    return np.where(np.isfinite(left), recording.force - left, recording.force)


def _beside_polynomials(recording: Recording) -> tuple[float, float] | None:
    """Standard deviation of the force beside a polynomial in each branch, and its degrees of freedom."""
    fitted, _, freedom = _polynomials(recording)
    squares = float(np.nansum((recording.force - fitted) ** 2))
    return (float(np.sqrt(squares / freedom)), float(freedom)) if freedom >= 20 else None


def _polynomials(recording: Recording) -> tuple[Array, Array, int]:
    """A polynomial in each branch at its samples (n,), by how much each sample draws it to itself (n,), freedom left.

    Both are nan in branches too short for a polynomial.
    """
    x = np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time
    fitted, leverage, freedom = np.full(len(x), np.nan), np.full(len(x), np.nan), 0
    for branch in branches(recording):
        here = slice(branch.start, branch.stop)
        degree = min(_DEGREE, (branch.stop - branch.start) // _PER_COEFFICIENT - 1)
        if degree < 1:
            continue
        position = x[here] - x[branch.start]
        if branch.kind == "hold":
            # Relaxation is fast at first.
            position = np.log1p(position / max(float(position[1]), 1e-12))
        basis, _ = np.linalg.qr(legvander(2.0 * position / float(position[-1]) - 1.0, degree))
        fitted[here] = basis @ (basis.T @ recording.force[here])
        leverage[here] = np.sum(basis**2, axis=1)
        freedom += branch.stop - branch.start - degree - 1
    return fitted, leverage, freedom


def _at_half_rate(recording: Recording) -> tuple[float, float] | None:
    """Standard deviations that differences find in every second sample and in all, of long branches; None without."""
    found = branches(recording)
    chosen = [i for i, b in enumerate(found) if b.stop - b.start >= _LONG]
    if sum(found[i].stop - found[i].start for i in chosen) < _ENOUGH:
        return None
    kept = np.concatenate([np.arange(found[i].start, found[i].stop) for i in chosen])
    groups = np.concatenate([np.full(found[i].stop - found[i].start, i) for i in chosen])
    x = (np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time)[kept]
    force = recording.force[kept]
    half = [noise(force[i::2], x[i::2], order=_ORDER, groups=groups[i::2]) for i in (0, 1)]
    return float(np.sqrt(np.mean(np.square(half)))), noise(force, x, order=_ORDER, groups=groups)


def _passed(correlation: float, stride: int) -> float:
    """Share of the variance of an autoregression that differences of order 4 of every stride-th sample find."""
    weights = comb(_ORDER, np.arange(_ORDER + 1)) * (-1.0) ** np.arange(_ORDER + 1)
    gap = np.abs(np.subtract.outer(np.arange(_ORDER + 1), np.arange(_ORDER + 1)))
    return float(weights @ correlation ** (stride * gap) @ weights / (weights @ weights))


def _correlation(ratio: float) -> float:
    """Correlation of neighbours for which the variances at half and full rate have a ratio."""
    trials = np.linspace(0.0, _LARGEST, 181)
    ratios = np.array([_passed(r, 2) / _passed(r, 1) for r in trials])
    # The ratio grows with the correlation.
    return float(np.interp(ratio, ratios, trials))
