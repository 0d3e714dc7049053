"""Refined size and correlation of the noise, from the features of the plain law's misfit.

A few hundred samples determine the noise of an independent sample to some 40 % (`windows`), because short windows
hardly show the correlation. The misfit of the plain law says more: missing physics is smooth along a branch, so that
its features fall from degree to degree, while the share of noise in each of them follows from its correlation. The
features of degree d are therefore modelled as Gaussian with variance s^2 a(r) + f_d. The correlation r has the
probabilities that the windows give it, and the factor s on the noise is log-normal about one; the sizes f_d are unknown
and fall from each degree to the next. On the first 15 recordings of the development deck, features of missing physics
fall by factors of two to six from degree to degree; those of a knee, as of free play, by 1.5.

On programs of the development deck with a cubic curve, correlations up to 0.8 and nothing missing, the logarithm of
estimate over truth has median -0.02 and root mean square 0.17 (`windows` alone: -0.07 and 0.47); with missing physics
of 0.2 to 5 % of the range, 0.07 and 0.40.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bushcli.likelihood.features import Features, noise_variances
from bushcli.likelihood.noise import NoiseModel
from bushcli.likelihood.windows import CORRELATIONS

Array = NDArray[np.float64]

# Variance of missing physics in a degree over that of noise: zero, or on a grid with steps of a factor 1.78. Wider
# ranges change probabilities by up to 0.002 (`benchmarks/constants.md`).
SIZES = np.concatenate([[0.0], np.geomspace(0.1, 1e8, 37)])
# Weights of a fall of this variance by 0, 1, ... steps from one degree to the next; each further step has half the
# weight of the last. Falls by factors from 1.8 to 10 are alike. Factors of 1.5 to 6 on the first 15 recordings of the
# development deck.
STEPS = (0.5, 1.0, 1.0, 1.0, 1.0)
# Factors on the noise, in standard deviations of their logarithm. Wider ranges change probabilities by up to 0.002
# (`benchmarks/constants.md`).
NODES = np.linspace(-2.5, 2.5, 41)


def refine_noise(noise: NoiseModel, features: Features, misfit: Array) -> NoiseModel:
    """Return the noise with its size and correlation refined from the features of a misfit.

    Parameters
    ----------
    noise : NoiseModel
        The features are in its units.
    features : Features
    misfit : (K,) array
        Features of the plain law's misfit.
    """
    if not np.isfinite(noise.freedom):
        return replace(noise, correlations=None)
    weights, variances, freedom = _possible(noise, features)
    factors = np.exp(np.sqrt(0.5 / freedom) * NODES)
    plain = misfit * features.spread
    falls = _falls()
    log = np.array([_log_likelihood(factors, own, features.degrees, plain, falls) for own in variances])
    log += np.log(weights + 1e-300)[:, None] - 0.5 * NODES**2
    posterior = np.exp(log - logsumexp(log))
    # Mean over the features of the logarithm of the noise's variance.
    size = np.log(variances).mean(axis=1)[:, None] + 2.0 * np.log(factors)
    mean = float(np.sum(posterior * size))
    spread = max(float(np.sum(posterior * (size - mean) ** 2)), 1e-4 / freedom)
    memory, correlation = noise.correlation_time, noise.correlation
    unit, passed = noise.sigma * float(np.sqrt(memory)), features.spread**2 * memory
    if noise.correlations is not None:
        memory = float(np.exp(posterior.sum(axis=1) @ np.log((1.0 + CORRELATIONS) / (1.0 - CORRELATIONS))))
        correlation = (memory - 1.0) / (memory + 1.0)
        passed = noise_variances(features.basis, np.array([correlation]))[0]
    sigma = unit * float(np.exp(0.5 * (mean - np.log(passed).mean())))
    sigma = max(sigma, noise.least / float(np.sqrt(memory)))
    return NoiseModel(sigma, correlation, 2.0 / spread, noise.least)


def _possible(noise: NoiseModel, features: Features) -> tuple[Array, Array, float]:
    """Return the probability of each correlation (m,), variances of its features (m, K), and degrees of freedom.

    The variances are in units of the noise's, for independent samples; the degrees of freedom are those of its size if
    the correlation is known.
    """
    if noise.correlations is None:
        return np.ones(1), features.spread[None] ** 2, noise.freedom
    unit = noise.sigma**2 * noise.correlation_time
    relative = noise.correlations.sizes[:, None] ** 2 / unit
    return (
        noise.correlations.weights,
        relative * noise_variances(features.basis, CORRELATIONS),
        noise.correlations.freedom,
    )


def _log_likelihood(
    factors: Array, own: Array, degrees: NDArray[np.int_], misfit: Array, falls: Array
) -> Array:
    """Logarithm of the likelihood of each factor on the noise, averaged over the sizes of missing physics.

    Parameters
    ----------
    factors : shape (s,)
    own : shape (K,)
        Variance of each feature of the noise.
    degrees : shape (K,)
    misfit : shape (K,)
    falls : shape (38, 38)
        Result of `_falls`.
    """
    # A probability of one half that no smooth misfit is left.
    prior = np.log(np.concatenate([[0.5], np.full(len(SIZES) - 1, 0.5 / (len(SIZES) - 1))]))
    log = np.tile(prior, (len(factors), 1))
    for degree in range(int(degrees.max()) + 1):
        of_degree = degrees == degree
        # By factor, size and feature.
        v = factors[:, None, None] ** 2 * own[of_degree] + SIZES[:, None]
        log = log - 0.5 * (np.log(v).sum(axis=-1) + (1.0 / v) @ misfit[of_degree] ** 2)
        top = log.max(axis=1, keepdims=True)
        log = np.log(np.exp(log - top) @ falls + 1e-300) + top
    return np.asarray(logsumexp(log, axis=1))


def _falls() -> Array:
    """Return the transition probabilities (38, 38) of the size of missing physics from one degree to the next."""
    count = len(SIZES)
    falls = np.zeros((count, count))
    falls[0, 0] = 1.0
    weights = np.concatenate([STEPS, STEPS[-1] * 0.5 ** np.arange(1, count - len(STEPS) + 1)])
    for size in range(1, count):
        falls[size, size:0:-1] = weights[:size]
        # Less than the least size is none.
        falls[size, 0] = weights[size:].sum()
        falls[size] /= falls[size].sum()
    return falls


def all_levelled(
    noises: Sequence[NoiseModel], features: Sequence[Features], misfits: Sequence[Array]
) -> tuple[NoiseModel, ...]:
    """Return the noise of every channel with its size refined (`refine_noise`).

    Parameters
    ----------
    noises : sequence of NoiseModel
    features : sequence of Features
    misfits : sequence of (K,) array
        Features of the misfit of each channel.
    """
    return tuple(refine_noise(*channel) for channel in zip(noises, features, misfits, strict=True))
