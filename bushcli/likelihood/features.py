"""Features: the smooth part of a misfit, as polynomials along each branch of the path, in units of the noise.

Physics acts along branches: a loop opens on loading and closes on unloading, a force relaxes in a hold. The weighted
misfit of a channel is projected on Legendre polynomials of each branch (of the logarithm of time in a hold). Noise
contributes one unit to each feature, a hum or a quantisation contributes next to nothing, however large it is, and
errors of a formula appear in the first few features. The share of noise with a memory is smaller in high degrees of
short branches, by a factor that follows from its correlation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from bushcli.likelihood.noise import NoiseModel, smooth_force
from bushcli.recording import Recording
from bushcli.recording.dynamic.rows import RecordedTable

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Degree of the polynomials, and fewest samples per coefficient, so that they average over noise: as in the noise model.
DEGREE, PER_COEFFICIENT = 5, 3
# The same along a curve of a table, whose rows are few and each the mean of many cycles: a relaxation time and a
# resonance within two decades of frequency are followed to a tenth of what they change.
TABLE_DEGREE = 6
# Error of form in a table, over that in recordings along a path, which is a share of 0.14 of what the law leaves. Small
# vibrations are linear, and branches describe any relaxation but for their number: three leave a share of 0.035
# (median; standard deviation of the logarithm 0.45) of what a law leaves of fractional Kelvin-Voigt, Cole-Cole and
# Havriliak-Negami elements over two to three decades (`benchmarks/branches.py`). A relaxation that amplitude thins
# leaves 0.05 to 0.1 on measured strain sweeps (`benchmarks/payne.md`).
BRANCHES, AMPLITUDES = 0.25, 0.5
# Share of the features of a curve that such a misfit changes: their participation ratio (`benchmarks/branches.py`).
INDEPENDENT = 0.4
# Error of the noise's estimate along a path over the uncertainty stated with it: 1.5 without missing physics and 1.9
# with it, on programs of the development deck (`benchmarks/noise.py`).
UNDERSTATED = 1.7


@dataclass(frozen=True)
class Features:
    """The features of one channel.

    Attributes
    ----------
    basis : shape (n, K)
        Orthonormal; zero at samples that do not count.
    weights : shape (n,)
        Reciprocal standard deviation of the noise of an independent sample; zero at samples that do not count.
    along : shape (K,)
        Unit vector of the features of the force, which a common factor changes.
    calibration : float
        Variance of the component along it by the uncertainty of calibration.
    signal : float
        Sum of squares of the weighted force about its mean, with which a misfit is compared.
    degrees : shape (K,)
        Degree of each polynomial in its branch.
    spread : shape (K,)
        Standard deviation of each component of the noise along `basis`, over that of independent samples.
    doubt : float
        Standard deviation of the logarithm of the noise over its estimate.
    form : float
        Error of form over that in recordings along a path.
    independent : float
        Share of the features that an error of form of a table changes independently; 0 for a path.
    most_noise : float
        Largest factor on the noise's estimate.
    """

    basis: Array
    weights: Array
    along: Array
    calibration: float
    signal: float
    degrees: NDArray[np.int_]
    spread: Array
    doubt: float
    form: float = 1.0
    independent: float = 0.0
    most_noise: float = float("inf")

    @property
    def count(self) -> int:
        """Number of features K."""
        return self.basis.shape[1]

    def of(self, rows: Array) -> Array:
        """Return the features (K,) or (K, k) of a misfit (n,) or of derivatives (n, k)."""
        weights, spread = self.weights, self.spread
        if rows.ndim > 1:
            weights, spread = weights[:, None], spread[:, None]
        return np.asarray(self.basis.T @ np.where(weights > 0.0, rows * weights, 0.0) / spread)

    def whiten(self, z: Array, variance: float) -> Array:
        """Return features (K,) or (K, k) in units of their standard deviation.

        Parameters
        ----------
        z : (K,) or (K, k) array
        variance : float
            Of every feature, dimensionless, from noise and error of form; along the force, that of calibration is
            added to it.
        """
        return self._scale_along(z, 1.0 / np.sqrt(variance), 1.0 / np.sqrt(variance + self.calibration))

    def colour(self, rows: Array, variance: float) -> Array:
        """Return the inverse of `whiten`.

        Parameters
        ----------
        rows : (K,) or (K, k) array
            In units of their standard deviation.
        variance : float
            Variance of every feature, in units of that of noise.
        """
        return self._scale_along(rows, np.sqrt(variance), np.sqrt(variance + self.calibration))

    def _scale_along(self, z: Array, across: float, along: float) -> Array:
        part = (along - across) * (self.along @ z)
        return np.asarray(across * z + (self.along * part if z.ndim == 1 else np.outer(self.along, part)))

    def shrink(self, rows: Array) -> Array:
        """Return the smooth part (n,) of a misfit (n,), in its own unit, without the contribution of noise.

        A feature z of unit noise is multiplied by 1 - 1/z^2, or by zero if that is negative.
        """
        weighted = np.where(self.weights > 0.0, rows * self.weights, 0.0)
        unit = np.where(self.weights > 0.0, self.weights, np.inf)
        z = self.basis.T @ weighted / self.spread
        signal = z * np.maximum(0.0, 1.0 - 1.0 / np.maximum(z**2, 1e-300))
        return np.asarray(self.basis @ (self.spread * signal) / unit)

    def rest(self, rows: Array) -> Array:
        """Return what the features do not show of a misfit (n,), in its own unit: what is faster along a branch."""
        weighted = np.where(self.weights > 0.0, rows * self.weights, 0.0)
        unit = np.where(self.weights > 0.0, self.weights, np.inf)
        return np.asarray((weighted - self.basis @ (self.basis.T @ weighted)) / unit)


def features(recording: Recording, noise: NoiseModel, used: Mask, factor: float) -> Features:
    """Return the features of a channel.

    Parameters
    ----------
    recording : Recording
        n samples.
    noise : NoiseModel
    used : (n,) array of bool
        Samples that count; data faults do not.
    factor : float
        Standard deviation of the common factor of the forces (`calibration`).
    """
    unit = noise.sigma * np.sqrt(noise.correlation_time)
    weights = np.where(used, 1.0 / unit, 0.0)
    basis, degrees = _basis(recording, used)
    variances = noise_variances(basis, np.array([noise.correlation]))[0]
    spread = np.sqrt(variances / noise.correlation_time)
    place = np.arange(len(used), dtype=float)
    # Samples that do not count are interpolated, because a spike would bend the polynomial of its branch.
    bridged = replace(recording, force=np.interp(place, place[used], recording.force[used]))
    force = basis.T @ (smooth_force(bridged) * weights) / spread
    size = float(np.linalg.norm(force))
    # What a law predicts of a table is the stiffness itself.
    middle = 0.0 if recording.kind == "dynamic" else float(np.mean(recording.force[used]))
    centred = (recording.force - middle) * weights
    stated = float(np.sqrt(0.5 / noise.freedom))
    on_path = Features(
        basis,
        weights,
        force / max(size, 1e-300),
        (factor * size) ** 2,
        float(centred @ centred),
        degrees,
        spread,
        UNDERSTATED * stated,
    )
    if not isinstance(recording, RecordedTable):
        return on_path
    return replace(
        on_path,
        doubt=stated,
        form=AMPLITUDES if recording.has_amplitudes else BRANCHES,
        independent=INDEPENDENT,
        most_noise=recording.most_noise,
    )


def noise_variances(basis: Array, correlations: Array) -> Array:
    """Return the variance of the components of noise along a basis, shape (m, K).

    Parameters
    ----------
    basis : shape (n, K)
        Columns over the samples.
    correlations : shape (m,)
        Of first-order autoregressions with unit variance.
    """
    n = len(basis)
    power = np.abs(np.fft.rfft(basis, 2 * n, axis=0)) ** 2
    products = np.fft.irfft(power, 2 * n, axis=0)[:n]
    lags = 2.0 * correlations[:, None] ** np.arange(n)
    lags[:, 0] = 1.0
    return np.asarray(lags @ products)


def _basis(recording: Recording, used: Mask) -> tuple[Array, NDArray[np.int_]]:
    """Orthonormal polynomials (n, K) of each branch, and their degrees (K,)."""
    columns: list[Array] = []
    degrees: list[NDArray[np.int_]] = []
    for rows, position, degree in _pieces(recording, used):
        own, _ = np.linalg.qr(legvander(position, degree))
        block = np.zeros((len(used), own.shape[1]))
        block[rows] = own
        columns.append(block)
        degrees.append(np.arange(own.shape[1]))
    return np.hstack(columns), np.concatenate(degrees)


def _pieces(recording: Recording, used: Mask) -> Iterator[tuple[NDArray[np.intp], Array, int]]:
    """Yield the samples of each branch, or of each curve of a table, their places in it, -1 to 1, and the degree."""
    if isinstance(recording, RecordedTable):
        count = len(recording.table)
        for rows, place in recording.curves():
            counted = used[rows]
            if counted.any():
                middle, width = 0.5 * (place[counted].max() + place[counted].min()), np.ptp(place[counted])
                x = 2.0 * (place[counted] - middle) / (width or 1.0)
                # Each row is the mean of many cycles.
                degree = min(len(np.unique(np.round(x, 6))) - 1, TABLE_DEGREE)
                yield rows[counted], x, degree
                yield rows[counted] + count, x, degree
        return
    clock = np.arange(len(recording.force), dtype=float) if recording.time is None else recording.time
    for branch in recording.branches:
        indices = np.flatnonzero(used[branch.start : branch.stop]) + branch.start
        if len(indices):
            degree = int(np.clip(len(indices) // PER_COEFFICIENT - 1, 0, DEGREE))
            yield indices, _position(clock[indices], branch.kind == "hold"), degree


def _position(clock: Array, hold: bool) -> Array:
    """Return the position of each sample along its branch, from -1 to 1."""
    since = clock - clock[0]
    if len(since) < 2 or since[-1] <= 0.0:
        return np.zeros(len(since))
    if hold:
        # Relaxation is fast at first.
        since = np.log1p(since / max(float(since[1]), 1e-12))
    return np.asarray(2.0 * since / float(since[-1]) - 1.0)
