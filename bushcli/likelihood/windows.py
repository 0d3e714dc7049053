"""Noise of a recorded force, from its residuals to cubics in short windows: size, correlation, and their uncertainty.

A cubic in a window of some twenty samples follows any smooth curve, and its residuals show the noise with its
correlation. Size and correlation of a first-order autoregression are found by restricted maximum likelihood, which
allows for the part of the noise that the cubics absorb. Windows with a kink (a turn, a knee, a bad sample) have larger
residuals than the others and do not count.

All later steps need the standard deviation of an independent sample, sigma sqrt((1 + r) / (1 - r)), and its
uncertainty, which depends on how well the correlation is known. On the 90 channels of the development deck
(`benchmarks/decks`, hum left out) the logarithm of estimate over truth has median -0.03 and root mean square 0.54, or
1.6 in units of the uncertainty stated here. When noise was taken as white unless a test at three standard deviations
rejected that, the median estimate was half the truth.

References
----------
Harville (1977), Maximum likelihood approaches to variance component estimation and to related problems, J. Am. Stat.
Assoc. 72:320-338, doi:10.1080/01621459.1977.10480998.
Prais and Winsten (1954), Trend estimators and serial correlation, Cowles Commission discussion paper 383.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.stats import chi2

from bushcli.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Samples of a window, degree of the polynomial, and fewest samples of a window. Of 24 or 36 samples and degree 3 or 4
# these had the smallest error on the development deck; the errors differ by 5 %. Other values change probabilities by
# up to 0.04 (`benchmarks/constants.md`).
WINDOW, DEGREE, LEAST = 24, 3, 8
# Fewest windows of a branch: a short branch may bend as much as a long one, and one cubic would not follow it. Other
# values change probabilities by up to 0.04 (`benchmarks/constants.md`).
WINDOWS = 2
# Least share of the samples in windows: a few windows would say more about their kinks than about noise. 0.25 and
# 0.75 change probabilities by up to 0.02 (`benchmarks/constants.md`).
COVERED = 0.5
# Correlations that are compared, and their prior, which falls to zero at 1. Loggers filter little or much.
CORRELATIONS = np.linspace(0.0, 0.9, 46, dtype=np.float64)
PRIOR = np.log(1.0 - CORRELATIONS)
# Windows with larger residuals than noise leaves in 999 of 1000 do not count: they contain something else. Other
# values change probabilities by less than 0.002 (`benchmarks/constants.md`).
_USUAL = 0.999
# Rounds in which such windows are left out, at most: other values change probabilities by less than 0.002
# (`benchmarks/constants.md`).
_ROUNDS = 6


@dataclass(frozen=True)
class Correlations:
    """What is known of the noise's correlation.

    Attributes
    ----------
    weights : shape (46,)
        Probability of each of `CORRELATIONS`.
    sizes : shape (46,)
        Standard deviation of the noise, in the signal's unit, if that is its correlation.
    freedom : float
        Degrees of freedom with which the variance is known if the correlation is.
    """

    weights: Array
    sizes: Array
    freedom: float


@dataclass(frozen=True)
class SignalNoise:
    """The noise of a signal.

    Attributes
    ----------
    sigma : float
        Standard deviation, in the signal's unit.
    correlation : float
        Between neighbouring samples.
    freedom : float
        Degrees of freedom with which the variance of an independent sample is known.
    correlations : Correlations
    """

    sigma: float
    correlation: float
    freedom: float
    correlations: Correlations


def noise_in_windows(recording: Recording, used: Mask, size: int = WINDOW) -> SignalNoise | None:
    """Return the noise of the recorded force; None where branches have too few samples.

    Parameters
    ----------
    recording : Recording
        n samples.
    used : (n,) array of bool
        Samples that count.
    size : int
        Samples of a window.
    """
    windows = list(_windows(recording, used, size))
    if sum(len(force) for _, force in windows) < COVERED * used.sum():
        return None
    squares, determinants, freedom = _tables(windows)
    counted: Mask = np.ones(len(windows), dtype=bool)
    best, log = 0, np.zeros(len(CORRELATIONS))
    for _ in range(_ROUNDS):
        usual = _unremarkable(squares[best], freedom, counted)
        log = PRIOR - determinants[:, usual].sum(axis=1)
        log = log - 0.5 * freedom[usual].sum() * np.log(squares[:, usual].sum(axis=1) + 1e-300)
        likeliest = int(np.argmax(log))
        same = likeliest == best and np.array_equal(usual, counted)
        best, counted = likeliest, usual
        if same:
            break
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    total = float(freedom[counted].sum())
    variance = np.log(squares[:, counted].sum(axis=1) / total + 1e-300)
    inflation = np.log((1.0 + CORRELATIONS) / (1.0 - CORRELATIONS))
    spread = (variance + inflation - float(weight @ (variance + inflation))) ** 2
    mean = float(np.exp(weight @ inflation))
    return SignalNoise(
        float(np.exp(0.5 * (weight @ variance))),
        (mean - 1.0) / (mean + 1.0),
        2.0 / (float(weight @ spread) + 2.0 / total),
        Correlations(weight, np.exp(0.5 * variance), total),
    )


def _windows(recording: Recording, used: Mask, size: int) -> Iterator[tuple[Array, Array]]:
    """Orthonormal polynomials (w, DEGREE + 1) and force (w,) of each window."""
    n = len(recording.force)
    clock = np.arange(n, dtype=float) if recording.time is None else recording.time
    for branch in recording.branches:
        indices = np.flatnonzero(used[branch.start : branch.stop]) + branch.start
        if len(indices) < WINDOWS * LEAST:
            continue
        for part in np.array_split(indices, max(-(-len(indices) // size), WINDOWS)):
            position = clock[part] - clock[branch.start]
            if branch.kind == "hold":
                # Relaxation is fast at first.
                interval = float(clock[min(branch.start + 1, n - 1)] - clock[branch.start])
                position = np.log1p(position / max(interval, 1e-12))
            position = position - position[0]
            if position[-1] > 0.0:
                basis, _ = np.linalg.qr(legvander(2.0 * position / position[-1] - 1.0, DEGREE))
                yield basis, recording.force[part]


def _tables(windows: list[tuple[Array, Array]]) -> tuple[Array, Array, Array]:
    """Sum of squares and logarithm of the determinants by correlation and window; degrees of freedom by window."""
    counts = np.array([len(force) for _, force in windows])
    # All windows at once, filled up with rows of zeros, which change neither squares nor determinants.
    columns = np.zeros((len(windows), counts.max(), DEGREE + 2))
    for column, (basis, force) in zip(columns, windows, strict=True):
        column[: len(force)] = np.column_stack([basis, force])
    filling = np.arange(counts.max()) >= counts[:, None]
    squares = np.zeros((len(CORRELATIONS), len(windows)))
    determinants = np.zeros_like(squares)
    for i, r in enumerate(CORRELATIONS):
        white = columns.copy()
        # Part of each sample that the previous one does not predict, scaled to the variance of the noise.
        white[:, 1:] = (columns[:, 1:] - r * columns[:, :-1]) / np.sqrt(1.0 - r**2)
        white[filling] = 0.0
        # The force is the last column: its part outside the polynomials is the last entry of the triangle.
        diagonal = np.abs(np.diagonal(np.linalg.qr(white, mode="r"), axis1=-2, axis2=-1))
        squares[i] = diagonal[:, -1] ** 2
        determinants[i] = np.log(diagonal[:, :-1]).sum(axis=-1) + 0.5 * (counts - 1) * np.log(1.0 - r**2)
    return squares, determinants, np.asarray(counts - (DEGREE + 1), dtype=float)


def _unremarkable(squares: Array, freedom: Array, counted: Mask) -> Mask:
    """Return the windows whose residuals are no larger than noise, at least half of all."""
    sizes = squares / freedom
    # Wilson and Hilferty's median of chi square.
    median = float(np.median(sizes[counted] / (1.0 - 2.0 / (9.0 * freedom[counted])) ** 3))
    usual = squares <= median * chi2.ppf(_USUAL, freedom)
    return usual if usual.sum() >= 0.5 * len(sizes) else np.asarray(sizes <= np.median(sizes))
