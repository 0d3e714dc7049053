"""Refined size of the noise, from the features of the plain law's misfit.

A few hundred samples determine the noise of an independent sample to some 40 % (`windows`). The misfit of the plain law
says more: missing physics is smooth along a branch, so that its features fall by a factor from each degree to the next,
while noise has the same size in all. The features (by degree d) are therefore modelled as Gaussian with variance
s^2 + f rho^d, where the factor s on the noise is log-normal about one with the uncertainty of the windows, the size f
is unknown, and rho is one of several values. On the first 15 recordings of the development deck, features of missing
physics fall by factors of two to six from degree to degree; those of a knee, as of free play, by 1.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bushcli.diagnosis.likelihood.features import Features
from bushcli.diagnosis.likelihood.noise import NoiseModel

Array = NDArray[np.float64]

# Fall of the variance of missing physics from degree to degree: from that of a knee to that of a stiffness.
FALLS = (0.67, 0.5, 0.25, 0.125)
# Variance of missing physics at degree 0 over that of noise: log-uniform, or zero.
SIZES = np.concatenate([[0.0], np.geomspace(0.1, 1e8, 37)])
# Factors on the noise, in standard deviations of their logarithm.
NODES = np.linspace(-2.5, 2.5, 41)


def levelled(noise: NoiseModel, features: Features, misfit: Array) -> NoiseModel:
    """Return the noise with its size refined from the features of a misfit.

    Parameters
    ----------
    noise : NoiseModel
        The features are in its units.
    features : Features
    misfit : (K,) array
        Features of the plain law's misfit.
    """
    if not np.isfinite(noise.freedom):
        return noise
    width = 0.5 * float(np.sqrt(2.0 / noise.freedom))
    factors = np.exp(width * NODES)
    log = _log_likelihood(factors, features.degrees, misfit) - 0.5 * NODES**2
    weight = np.exp(log - logsumexp(log))
    mean = float(weight @ NODES)
    spread = max(float(weight @ (NODES - mean) ** 2), 1e-4) * width**2
    # The variance of a logarithm of a variance with f degrees of freedom is 2 / f.
    factor = max(
        float(np.exp(width * mean)), noise.least / noise.sigma / float(np.sqrt(noise.correlation_time))
    )
    return replace(noise, sigma=noise.sigma * factor, freedom=0.5 / spread)


def _log_likelihood(factors: Array, degrees: NDArray[np.int_], misfit: Array) -> Array:
    """Logarithm of the likelihood of each factor on the noise, averaged over size and fall of missing physics."""
    count = np.bincount(degrees)
    squares = np.bincount(degrees, weights=misfit**2)
    fall = np.array(FALLS)[:, None] ** np.arange(len(count))
    # By factor, size, fall and degree.
    v = factors[:, None, None, None] ** 2 + SIZES[None, :, None, None] * fall
    log = -0.5 * np.sum(count * np.log(v) + squares / v, axis=-1)
    # A probability of one half that no smooth misfit is left.
    prior = np.log(np.concatenate([[0.5], np.full(len(SIZES) - 1, 0.5 / (len(SIZES) - 1))]))
    return np.asarray(logsumexp(log + prior[:, None], axis=(1, 2)))


def all_levelled(
    noises: Sequence[NoiseModel], features: Sequence[Features], misfits: Sequence[Array]
) -> tuple[NoiseModel, ...]:
    """Return the noise of every channel with its size refined (`levelled`).

    Parameters
    ----------
    noises : sequence of NoiseModel
    features : sequence of Features
    misfits : sequence of (K,) array
        Features of the misfit of each channel.
    """
    return tuple(levelled(*one) for one in zip(noises, features, misfits, strict=True))
