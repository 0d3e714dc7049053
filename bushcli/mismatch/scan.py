"""Scan statistic: the part of a grid of bins whose misfit stands out most, and how far noise alone would stand out.

A *box* is a range of cycles by a range of displacement bands, of some branches, sides and rates. By noise alone, the
misfit of a box with n samples adds up to about sqrt(n), so that z = sum / sqrt(n) compares boxes of all sizes; many
bins that are each within the noise are found together. The distribution of the largest z of all boxes by noise alone
is simulated for the grid at hand.

References
----------
Kulldorff (1997), A spatial scan statistic, Commun. Stat. Theory Methods 26:1481-1496,
doi:10.1080/03610929708831995.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, gumbel_r

Array = NDArray[np.float64]
Choice = tuple[tuple[int, ...], tuple[int, ...], tuple[float, float]]

# Loading (0), unloading (1) and holds (2) that a box may have together.
_BRANCHES = ((0, 1, 2), (0, 1), (0,), (1,), (2,))
# Sign of the misfit on the positive and the negative side: too stiff on both, too high on both, one side alone.
_SIDES = ((1.0, -1.0), (1.0, 1.0), (1.0, 0.0), (0.0, -1.0))
# Seed of the simulations.
_SEED = 20_240_905
# Simulations of noise: their maxima follow a Gumbel distribution, whose 95 % point is then known to 0.05 in z.
_REPLICATES = 200
_CHUNK = 10
# Least number of samples of a box: words only; judgement: fewer may be one disturbance.
_FEWEST = 4.0
# A box with a shorter description is chosen if its z^2 is at least this share of the largest. Words only: the shorter
# of two descriptions that fit alike.
_AS_GOOD = 0.90


@dataclass(frozen=True)
class Box:
    """A part of a grid: classes of rates, indices of branches, first and last cycle and band."""

    rates: tuple[int, ...]
    branches: tuple[int, ...]
    # Of the misfit on the positive and the negative side: (1, -1) for too stiff on both, (1, 1) for too high on both; 0
    # for a side that does not belong to the box.
    signs: tuple[float, float]
    cycles: tuple[int, int]
    bands: tuple[int, int]
    # Sum of the misfit with these signs, over its standard deviation by noise.
    z: float

    @property
    def is_higher(self) -> bool:
        """Whether the misfit points the same way on both sides."""
        return self.signs[0] * self.signs[1] > 0

    def mask(self, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Which bins of a grid belong to it, of the grid's shape."""
        mask = np.zeros(shape, dtype=bool)
        sides = [i for i in (0, 1) if self.signs[i]]
        cycles, bands = range(self.cycles[0], self.cycles[1] + 1), range(self.bands[0], self.bands[1] + 1)
        mask[np.ix_(self.rates, self.branches, sides, cycles, bands)] = True
        return mask

    def restrictions(self, count: Array) -> int:
        """Number of restrictions that the description needs."""
        sides = count.sum(axis=(0, 1, 3, 4)) > 0
        present = {i for i in range(3) if count[:, i].any()}
        return (
            (len(self.rates) < count.shape[0])
            + (not present <= set(self.branches))
            + (bool(sides.all()) and 0.0 in self.signs)
            + (self.cycles != (0, count.shape[3] - 1))
            + (self.bands != (0, count.shape[4] - 1))
        )


def strongest_box(total: Array, count: Array) -> Box | None:
    """Return the box with the largest |z|, or one nearly as good with a shorter description; None for an empty grid.

    Sums of the weighted misfit and numbers of samples have shape (rates, branches, 2, cycles, bands); noise of n
    samples adds up to sqrt(n).
    """
    boxes: list[Box] = []
    if not count.any():
        return None
    choices, signs_of = _choices(count)
    for choice, z in zip(choices, _z(total[None], count, signs_of)[0], strict=True):
        size = np.abs(z)
        # The best ranges of cycles and bands, and the best with all cycles, with all bands, and with both. Ranges are
        # ordered by their first index: the full one is the last of those that begin at 0.
        i, j = count.shape[3] - 1, count.shape[4] - 1
        best_pair = np.unravel_index(int(np.argmax(size)), size.shape)
        for place in (best_pair, (i, np.argmax(size[i])), (np.argmax(size[:, j]), j), (i, j)):
            cycles, bands = _range(place[0], count.shape[3]), _range(place[1], count.shape[4])
            boxes.append(Box(*choice, cycles, bands, float(z[place])))
    best = max(box.z**2 for box in boxes)
    near = [box for box in boxes if box.z**2 >= _AS_GOOD * best]
    return min(near, key=lambda box: (box.restrictions(count), -(box.z**2)))


def false_alarm(z: float, count: Array, freedom: float) -> float:
    """Return the probability that noise alone causes a box with |z| or more somewhere in a grid of `count` samples.

    `freedom` is that of the noise's variance, so that z is a Student variable; inf if the variance is known.
    """
    place, scale = _null(count.shape, count.astype(np.int64).tobytes())
    if not np.isfinite(freedom):
        return float(gumbel_r.sf(z**2, place, scale))
    spread = chi2.ppf((np.arange(400) + 0.5) / 400, freedom) / freedom
    return float(np.mean(gumbel_r.sf(z**2 * spread, place, scale)))


@lru_cache(maxsize=32)
def _null(shape: tuple[int, ...], counts: bytes) -> tuple[float, float]:
    """Return location and scale of the Gumbel distribution of the largest z^2 that noise gives."""
    count = np.frombuffer(counts, dtype=np.int64).reshape(shape).astype(float)
    generator = np.random.default_rng(_SEED)
    largest = np.zeros(_REPLICATES)
    _, signs_of = _choices(count)
    for start in range(0, _REPLICATES, _CHUNK):
        noise = generator.normal(size=(_CHUNK, *shape)) * np.sqrt(count)
        largest[start : start + _CHUNK] = np.max(_z(noise, count, signs_of) ** 2, axis=(1, 2, 3))
    # By the method of moments, which depends on all replicates and not only on the few in the tail.
    scale = float(np.std(largest)) * np.sqrt(6.0) / np.pi
    return float(np.mean(largest)) - np.euler_gamma * scale, max(scale, 1e-9)


def _choices(count: Array) -> tuple[list[Choice], Array]:
    """Distinct choices of rates, branches and sides, and their signs (choices, rates, branches, sides)."""
    rates = [tuple(range(count.shape[0]))]
    if count.shape[0] > 1:
        rates += [(i,) for i in range(count.shape[0])]
    distinct: dict[bytes, tuple[Choice, Array]] = {}
    for choice in product(rates, _BRANCHES, _SIDES):
        some_rates, branches, signs = choice
        signs_of = np.zeros(count.shape[:3])
        signs_of[np.ix_(some_rates, branches)] = np.array(signs)
        # Without holds, "all branches" are "loading and unloading"; without a negative side both sides are one.
        signs_of *= count.sum(axis=(3, 4)) > 0
        if signs_of.any():
            key = (signs_of * signs_of[np.nonzero(signs_of)][0]).tobytes()
            distinct.setdefault(key, (choice, signs_of))
    choices, signs = zip(*distinct.values(), strict=True)
    return list(choices), np.array(signs)


def _z(total: Array, count: Array, signs_of: Array) -> Array:
    """Return z of all boxes, (replicates, choices, ranges of cycles, ranges of bands)."""
    n = _ranges(np.tensordot(np.abs(signs_of), count, axes=3))
    s = _ranges(np.einsum("mrbs,krbscd->kmcd", signs_of, total, optimize=True))
    return np.where(n >= _FEWEST, s / np.sqrt(np.maximum(n, 1.0)), 0.0)


def _ranges(values: Array) -> Array:
    """Sums (..., ranges of cycles, ranges of bands) of values (..., cycles, bands)."""
    for axis in (-2, -1):
        low, high = _pairs(values.shape[axis])
        padded = np.insert(np.cumsum(values, axis=axis), 0, 0.0, axis=axis)
        values = np.take(padded, high + 1, axis=axis) - np.take(padded, low, axis=axis)
    return values


@cache
def _pairs(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.triu_indices(n)


def _range(i: np.intp | int, n: int) -> tuple[int, int]:
    low, high = _pairs(n)
    return int(low[i]), int(high[i])
