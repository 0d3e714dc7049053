"""Amplitudes of effects to first order: least squares with signs, bounds and Student's t priors.

Each t is replaced by the normal that pulls as strongly at the previous solution, until the solutions converge.

References
----------
Lange, Little and Taylor (1989), Robust statistical modeling using the t distribution, J. Am. Stat. Assoc. 84:881-896,
doi:10.1080/01621459.1989.10478852: such weights are an EM algorithm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.evidence.prior import ParameterPrior
from bushcli.likelihood.linearisation import cone_fit

Array = NDArray[np.float64]

# Largest number of solutions, and relative change between two of them that counts as zero. Other values change
# probabilities by less than 0.002 (`benchmarks/constants.md`).
MOST_SOLUTIONS, SAME = 30, 1e-6


def amplitudes(
    gram: Array,
    score: Array,
    known: Sequence[ParameterPrior | None],
    start: Array,
    bounds: tuple[Array, Array],
) -> Array:
    """Return the amplitudes (k,) that minimise a' G a - 2 a' s and twice the negative logarithm of their priors.

    With a t prior there may be one minimum near zero and one where the recordings have theirs: the lower one is taken.

    Parameters
    ----------
    gram : (k, k) array
    score : (k,) array
    known : sequence of ParameterPrior or None
        Prior of each amplitude.
    start : (k,) array
        Values from which the amplitudes are measured.
    bounds : pair of arrays, shape (k,)
        Least and largest amplitudes.
    """
    if not len(start):
        return np.zeros(0)
    ends = [
        _converged_sizes(gram, score, known, start, bounds, at) for at in (start, np.full(len(start), np.inf))
    ]

    def objective(end: Array) -> float:
        pairs = zip(known, start + end, strict=True)
        prior = sum(k.row(float(v))[0] ** 2 for k, v in pairs if k is not None and not k.prior.is_logarithmic)
        return float(end @ gram @ end - 2.0 * end @ score) + prior

    return min(ends, key=objective)


def _converged_sizes(
    gram: Array,
    score: Array,
    known: Sequence[ParameterPrior | None],
    start: Array,
    bounds: tuple[Array, Array],
    at: Array,
) -> Array:
    """Return the converged solution; the first one uses the pull of the priors at the values `at` (k,)."""
    signs = [1 if prior is not None and prior.one_sided else 0 for prior in known]
    low, high = bounds
    sizes: Array = np.zeros(len(start))
    for _ in range(MOST_SOLUTIONS):
        before = sizes
        pull = [0.0 if k is None else k.pull(float(v)) for k, v in zip(known, at, strict=True)]
        sizes = np.minimum(np.maximum(cone_fit(gram + np.diag(pull), score, signs)[0], low), high)
        at = start + sizes
        if (np.abs(sizes - before) <= SAME * np.abs(before)).all():
            break
    return sizes
