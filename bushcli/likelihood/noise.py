"""Model of the noise: its size, its correlation from sample to sample, and how well both are known.

The noise is estimated from the recording itself (`level` refines its size and correlation), not from a model's misfit:
a misfit that is smooth because physics is missing would pass for noise with a long memory and go unnoticed. Size and
correlation are those of a first-order autoregression, found in the residuals of cubics in short windows (`windows`);
their uncertainty is taken into account when the size is refined. An error that drifts over more than some ten samples
cannot be distinguished from the curve by any means, and counts as misfit.

A sample that shares its error with others counts less: n samples with correlation time T are worth n / T independent
ones. `Compared.weights` contains this factor, so that every later sum of squares has one independent sample as its
unit.

References
----------
Bayley and Hammersley (1946), The "effective" number of independent observations in an autocorrelated time series,
Suppl. J. R. Stat. Soc. 8:184-197, doi:10.2307/2983560.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.special import comb

from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.likelihood.windows import (
    CORRELATIONS,
    PRIOR,
    WINDOW,
    Correlations,
    SignalNoise,
    noise_in_windows,
)
from bushcli.recording import Recording, branches, force_noise
from bushcli.recording.dynamic.rows import RecordedTable

Array = NDArray[np.float64]

# Order of the differences of `force_noise`, which follow any curve and contain little of correlated noise. Hall, Kay
# and Titterington 1990.
_ORDER = 3
# Largest ratio of the noise found by cubics to that found by differences; with a larger one, the cubics miss the curve:
# 0.7 to 1.3 on the 96 channels of the development deck, 6 to 20 on coarsely sampled curves without noise.
_AGREED = 2.0
# Degrees of freedom of their size per sample: for 250 samples it scatters by 8 % (`bushcli.curve.noise`).
_PER_SAMPLE = 0.5 / 0.08**2 / 250
# Standard deviations below the floor from which on the noise is the floor, without uncertainty. Judgement.
_FAR = 2.0
# Largest degree of the polynomial that smooths a branch, and fewest samples per coefficient, so that it averages
# noise. Other values change probabilities by up to 0.002 (`benchmarks/constants.md`).
_DEGREE, _PER_COEFFICIENT = 5, 3


@dataclass(frozen=True)
class NoiseModel:
    """Noise of a recorded force, as first-order autoregression.

    Attributes
    ----------
    sigma : float
        Standard deviation, N, N mm or MPa, including the displacement's noise times the stiffness. More than 0.
    correlation : float
        Between neighbouring samples, 0 for white noise; less than 1.
    freedom : float
        Degrees of freedom with which the variance of an independent sample is known; inf if it is known exactly.
    least : float
        Smallest standard deviation of an independent sample, in the unit of `sigma`.
    correlations : Correlations, optional
        Other correlations that are possible; None where there is nothing more to be learnt of it.
    """

    sigma: float
    correlation: float = 0.0
    freedom: float = float("inf")
    least: float = 0.0
    correlations: Correlations | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not (self.sigma > 0.0 and 0.0 <= self.correlation < 1.0 and self.freedom > 0.0):
            raise ValueError(f"noise model: {self} has impossible values")

    @property
    def correlation_time(self) -> float:
        """How many samples count as one: (1 + r) / (1 - r)."""
        return (1.0 + self.correlation) / (1.0 - self.correlation)


@dataclass(frozen=True)
class Compared:
    """A channel: recorded force, simulated force at the same samples, and noise.

    Attributes
    ----------
    recording : Recording
        n samples.
    simulated : (n,) array
        Force, N, N mm or MPa; nan where it is unknown or the sample does not count.
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
        """Weights of misfit and derivatives (n,): 1 / (sigma sqrt(correlation time)), 0 where not known."""
        unit = self.noise.sigma * np.sqrt(self.noise.correlation_time)
        return np.where(self.known, 1.0 / unit, 0.0)

    @cached_property
    def smoothed_force(self) -> Array:
        """The recorded force (n,) without its noise."""
        return smooth_force(self.recording)

    @property
    def effective_samples(self) -> float:
        """Number of independent samples."""
        return float(self.known.sum()) / self.noise.correlation_time


def noise_model(
    recording: Recording, used: NDArray[np.bool_] | None = None, floor: float = NOISE_FLOOR
) -> NoiseModel:
    """Return the noise of a recording, estimated from itself.

    Parameters
    ----------
    recording : Recording
        n samples.
    used : (n,) array of bool, optional
        Samples that count; all when None.
    floor : float
        Smallest ``sigma``, as share of the recorded force range.

    Returns
    -------
    NoiseModel
        If branches are too short to show the correlation of the noise, it is that of the prior (`windows`). With
        coarse sampling, ``sigma`` is an upper bound, see `bushcli.curve.noise`.
    """
    if isinstance(recording, RecordedTable):
        # Its rows are in units of their errors.
        return NoiseModel(1.0, freedom=recording.freedom)
    used = np.ones(len(recording.force), dtype=bool) if used is None else used
    signal_noise, sound = _signal_noise(recording, used), recording.with_gaps_interpolated(used)
    sigma = float(np.hypot(signal_noise.sigma, sound.noise_of_motion))
    least = floor * float(np.ptp(sound.force))
    freedom = max(signal_noise.freedom, 1.0)
    unit = sigma * float(np.sqrt((1.0 + signal_noise.correlation) / (1.0 - signal_noise.correlation)))
    if unit > least:
        share = sigma / signal_noise.sigma
        others = replace(signal_noise.correlations, sizes=share * signal_noise.correlations.sizes)
        return NoiseModel(sigma, signal_noise.correlation, freedom, least, others)
    # The logarithm of the unit has the standard deviation sqrt(1 / (2 f)).
    is_far = unit * float(np.exp(_FAR * np.sqrt(0.5 / freedom))) <= least
    return NoiseModel(least, 0.0, float("inf") if is_far else freedom, least)


def _signal_noise(recording: Recording, used: NDArray[np.bool_]) -> SignalNoise:
    """Return the noise from cubics in windows, in half as long ones if those miss the curve, else from differences."""
    differences = force_noise(recording)
    for size in (WINDOW, WINDOW // 2):
        signal_noise = noise_in_windows(recording, used, size)
        if (
            signal_noise is not None
            and signal_noise.sigma * np.sqrt(_share_passed(signal_noise.correlation)) <= _AGREED * differences
        ):
            return signal_noise
    return _by_differences(differences, len(recording.force))


def _by_differences(differences: float, count: int) -> SignalNoise:
    """Return the noise from such differences, averaged over the prior of its correlation, which they do not show."""
    weight = np.exp(PRIOR) / np.exp(PRIOR).sum()
    inflation = np.log((1.0 + CORRELATIONS) / (1.0 - CORRELATIONS))
    variance = -np.log([_share_passed(float(r)) for r in CORRELATIONS])
    mean, memory = float(weight @ (variance + inflation)), float(np.exp(weight @ inflation))
    spread = float(weight @ (variance + inflation - mean) ** 2)
    sigma = differences * float(np.exp(0.5 * (weight @ variance)))
    correlations = Correlations(weight, differences * np.exp(0.5 * variance), _PER_SAMPLE * count)
    return SignalNoise(sigma, (memory - 1.0) / (memory + 1.0), 2.0 / spread, correlations)


def _share_passed(correlation: float) -> float:
    """Share of the variance of an autoregression that divided differences of evenly spaced samples show."""
    weights = comb(_ORDER, np.arange(_ORDER + 1)) * (-1.0) ** np.arange(_ORDER + 1)
    gap = np.abs(np.subtract.outer(np.arange(_ORDER + 1), np.arange(_ORDER + 1)))
    return float(weights @ correlation**gap @ weights / (weights @ weights))


def smooth_force(recording: Recording) -> Array:
    """Recorded force (n,) without most of its noise: each sample as the other samples of its branch predict it.

    A polynomial is fitted to each branch without the sample; the force of short branches is not changed.
    """
    if isinstance(recording, RecordedTable):
        return recording.force
    fitted, leverage = _polynomials(recording)
    left = (recording.force - fitted) / (1.0 - leverage)
    return np.where(np.isfinite(left), recording.force - left, recording.force)


def _polynomials(recording: Recording) -> tuple[Array, Array]:
    """Return a polynomial fit of each branch at its samples (n,), and the leverage of each sample (n,).

    Both are nan in branches too short for a polynomial.
    """
    x = np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time
    fitted, leverage = np.full(len(x), np.nan), np.full(len(x), np.nan)
    for branch in branches(recording):
        samples = slice(branch.start, branch.stop)
        degree = min(_DEGREE, (branch.stop - branch.start) // _PER_COEFFICIENT - 1)
        if degree < 1:
            continue
        position = x[samples] - x[branch.start]
        if branch.kind == "hold":
            # Relaxation is fast at first.
            position = np.log1p(position / max(float(position[1]), 1e-12))
        basis, _ = np.linalg.qr(legvander(2.0 * position / float(position[-1]) - 1.0, degree))
        fitted[samples] = basis @ (basis.T @ recording.force[samples])
        leverage[samples] = np.sum(basis**2, axis=1)
    return fitted, leverage
