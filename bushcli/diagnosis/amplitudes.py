"""Amplitudes of effects to first order: least squares with signs, bounds and priors that are a Student's t.

A t is taken for the normal that pulls as strongly where the last solution has ended, again and again.

References
----------
Lange, Little and Taylor (1989), Robust statistical modeling using the t distribution, J. Am. Stat. Assoc. 84:881-896,
doi:10.1080/01621459.1989.10478852: such weights are an EM algorithm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.likelihood.linearised import cone_fit
from bushcli.diagnosis.prior import Known

Array = NDArray[np.float64]

# Solutions at most, and their relative change that is none.
MOST, SAME = 30, 1e-6


def amplitudes(
    gram: Array,
    score: Array,
    known: Sequence[Known | None],
    start: Array,
    bounded: Callable[[Array], Array],
) -> Array:
    """Return the amplitudes (k,) that minimise a' G a - 2 a' s and twice the negative logarithm of their priors.

    Such a prior may have a minimum near zero and one where the recordings have it: the lower one is taken.

    Parameters
    ----------
    gram : (k, k) array
    score : (k,) array
    known : sequence of Known or None
        Priors.
    start : (k,) array
        Values that the amplitudes are changes of.
    bounded : callable
        Brings amplitudes (k,) within what the effects admit.
    """
    if not len(start):
        return np.zeros(0)
    ends = [_settled(gram, score, known, start, bounded, at) for at in (start, np.full(len(start), np.inf))]

    def objective(end: Array) -> float:
        pairs = zip(known, start + end, strict=True)
        prior = sum(k.row(float(v))[0] ** 2 for k, v in pairs if k is not None and not k.prior.is_logarithmic)
        return float(end @ gram @ end - 2.0 * end @ score) + prior

    return min(ends, key=objective)


def _settled(
    gram: Array,
    score: Array,
    known: Sequence[Known | None],
    start: Array,
    bounded: Callable[[Array], Array],
    at: Array,
) -> Array:
    """Return where solutions end, of which the first has the priors' pull at the values `at` (k,)."""
    signs = [1 if one is not None and one.one_sided else 0 for one in known]
    found: Array = np.zeros(len(start))
    for _ in range(MOST):
        before = found
        pull = [0.0 if k is None else k.pull(float(v)) for k, v in zip(known, at, strict=True)]
        found = bounded(cone_fit(gram + np.diag(pull), score, signs)[0])
        at = start + found
        if np.allclose(found, before, rtol=SAME, atol=0.0):
            break
    return found
