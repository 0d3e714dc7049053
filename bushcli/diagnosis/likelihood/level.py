"""Refined size of the noise, from the features of the plain law's misfit.

A few hundred samples say how large an independent sample's noise is to some 40 % (`windows`). What a law leaves of a
recording says more: missing physics is smooth along a branch, its features fall by a factor from each degree to the
next, and noise has the same size in all. So the features (by degree d) are taken for Gaussian with variance
s^2 + f rho^d, with s the factor on the noise, log-normal about one with the width that the windows leave, f of unknown
size, and rho one of several. On the first 15 recordings of the development deck features of missing physics fall by
factors of two to six from degree to degree; a knee, as of free play, by 1.5.
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
# Its size at degree 0 over the noise, log-uniform; and none.
SIZES = np.concatenate([[0.0], np.geomspace(0.1, 1e8, 37)])
# Factors on the noise, in standard deviations of their logarithm.
NODES = np.linspace(-2.5, 2.5, 41)


def levelled(noise: NoiseModel, features: Features, misfit: Array) -> NoiseModel:
    """Return the noise with its size refined from the features of a misfit.

    Parameters
    ----------
    noise : NoiseModel
        In whose units the features are.
    features : Features
    misfit : (K,) array
        Features of what the plain law leaves.
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
    """Logarithm of the likelihood of each factor on the noise, averaged over the misfit's size and fall."""
    count = np.bincount(degrees)
    squares = np.bincount(degrees, weights=misfit**2)
    fall = np.array(FALLS)[:, None] ** np.arange(len(count))
    # By factor, size, fall and degree.
    v = factors[:, None, None, None] ** 2 + SIZES[None, :, None, None] * fall
    log = -0.5 * np.sum(count * np.log(v) + squares / v, axis=-1)
    # Half of the probability that nothing smooth is left.
    prior = np.log(np.concatenate([[0.5], np.full(len(SIZES) - 1, 0.5 / (len(SIZES) - 1))]))
    return np.asarray(logsumexp(log + prior[:, None], axis=(1, 2)))


def all_levelled(
    noises: Sequence[NoiseModel], features: Sequence[Features], misfits: Sequence[Array]
) -> tuple[NoiseModel, ...]:
    """Return the noise of every channel (`levelled`).

    Parameters
    ----------
    noises : sequence of NoiseModel
    features : sequence of Features
    misfits : sequence of (K,) array
        Features of the misfit of each channel.
    """
    return tuple(levelled(*one) for one in zip(noises, features, misfits, strict=True))
