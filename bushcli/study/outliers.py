"""Which of several like parts are outliers, and the band in which a share of the parts lies.

The generalised extreme studentised deviate test takes away the part farthest from the mean, then the next, and
compares each deviation with the largest that parts of one normal distribution would show: where all parts are alike,
one of them is called an outlier with the stated probability, however many parts there are. Outliers do not mask each
other, because the number of outliers is the last one that passes.

References
----------
Rosner (1983), Percentage points for a generalized ESD many-outlier procedure, Technometrics 25:165-172,
doi:10.1080/00401706.1983.10487848. Howe (1969), Two-sided tolerance limits for normal populations, some improvements,
J. Am. Stat. Assoc. 64:610-620, doi:10.1080/01621459.1969.10500999.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Probability that a batch without outliers is said to have one.
FALSE_ALARM = 0.05
# The steps together give a false alarm more often than one alone does: by these factors for that many parts, measured
# in 20,000 batches of normal deviates each. The probability of each step is divided by them.
_PARTS, _MORE_OFTEN = (10, 15, 20, 30, 50, 100), (1.75, 1.65, 1.4, 1.2, 1.08, 1.0)
# Of four values none can deviate by more than 1.5 standard deviations, which is about Rosner's limit.
FEWEST = 5
#: Share of parts within the band, and the confidence in it.
CONTENT, CONFIDENCE = 0.95, 0.95


def find_outliers(values: Array, false_alarm: float = FALSE_ALARM) -> tuple[NDArray[np.bool_], Array]:
    """Return which values are outliers, and the deviation of each in standard deviations of those that are not."""
    from scipy.stats import t

    n, remaining, order = len(values), np.arange(len(values)), list[int]()
    count, probability = 0, false_alarm / float(np.interp(n, _PARTS, _MORE_OFTEN))
    # Up to a third of the parts: with more, it is not clear which are the outliers.
    for i in range(n // 3 if n >= FEWEST else 0):
        spread = float(np.std(values[remaining], ddof=1))
        if spread <= 0.0:
            break
        deviation = np.abs(values[remaining] - values[remaining].mean()) / spread
        worst = int(np.argmax(deviation))
        free = n - i - 2
        point = float(t.ppf(1.0 - probability / (2.0 * (n - i)), free))
        limit = (n - i - 1) * point / np.sqrt((free + point**2) * (n - i))
        order.append(int(remaining[worst]))
        if deviation[worst] > limit:
            count = i + 1
        remaining = np.delete(remaining, worst)
    is_outlier = np.zeros(n, dtype=bool)
    is_outlier[order[:count]] = True
    inliers = values[~is_outlier]
    spread = float(np.std(inliers, ddof=1)) if len(inliers) > 1 else 0.0
    return is_outlier, (values - inliers.mean()) / spread if spread > 0.0 else np.zeros(n)


def foreign(value: float, inliers: Array, others: int, false_alarm: float = FALSE_ALARM) -> bool:
    """Whether a further value does not belong to like ones: outside the prediction interval of a single value."""
    from scipy.stats import t

    if len(inliers) < FEWEST:
        return False
    limit = t.ppf(1.0 - false_alarm / (2.0 * others), len(inliers) - 1) * np.sqrt(1.0 + 1.0 / len(inliers))
    return bool(abs(value - inliers.mean()) > limit * np.std(inliers, ddof=1))


def tolerance_factor(count: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Return k: mean +- k standard deviations hold a share of all parts, with some confidence (Howe)."""
    from scipy.stats import chi2, norm

    free = count - 1
    if free < 1:
        return float("nan")
    spread = np.sqrt(free * (1.0 + 1.0 / count) / chi2.ppf(1.0 - confidence, free))
    return float(norm.ppf(0.5 + 0.5 * content) * spread)
