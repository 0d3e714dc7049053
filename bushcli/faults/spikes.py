"""Single bad samples of a signal: neither the samples before them nor those after them predict them.

From the samples before a sample, and from those after it, a parabola and straight lines through fewer samples
are extrapolated to it; the nearest forecast of each side counts. At a kink (a knee, a reversal, the start of a
hold) one side predicts the sample; at a step each side predicts one end of it; where the signal bends
sharply they miss it in opposite directions. A spike of one to three samples is missed by both, in the same
direction, and by more than the samples next to it are. The scale of a miss is measured on the recording itself,
so that noise with memory, a hum or a coarse converter only make the search less sensitive. The largest spike is
removed first, and the rest is judged again without it.

The first and last samples of a recording have too few neighbours on one side. With ``ends`` they are judged by the
other side alone: to leave out a sound sample costs a fit almost nothing. A first sample between zero and its forecast
is no spike, because friction and play begin like that.

References
----------
Davies, Gather (1993), The identification of multiple outliers, J. Am. Stat. Assoc. 88:782-792,
doi:10.1080/01621459.1993.10476339 (outliers by robust scale, the Hampel identifier).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bushcli.faults.signal import quantum

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WIDEST = 3
_SAMPLES, _LEAST = 9, 5
# Samples that are extrapolated to at a time, so that what is needed for them stays in the processor's cache.
_PIECE = 8_192
# Samples of the straight lines that serve between two kinks.
_ON_LINES = (4, 3)
# Both extrapolations miss a sample of normal noise by more than 4 standard deviations with a probability of
# some 1e-6: the two share the sample's own noise. If only one of them stays inside the branch, it alone has to
# miss by the second number.
_BOTH, _ALONE = 4.0, 6.0
# Least ratio of a spike to the misses nearby beyond noise, number of samples that are nearby, and noise of their
# misses. A relaxation that loses two thirds from sample to sample still makes a ratio of 3.
_OVER_NEARBY, _NEARBY, _NOISE_NEARBY = 4.0, 6, 3.0
# No fit notices a smaller spike: share of the range, and steps of the converter.
_SMALLEST, _STEPS = 3e-3, 3.0
# Fewer samples do not determine their scatter.
_FEWEST = 40
# More than this share of the samples cannot be single bad ones: then the search has misunderstood the signal.
_MOST = 0.05
# At an end one side alone cannot tell a spike from a kink, where a stop engages or play closes. Past a kink, a
# forecast over up to `WIDEST` samples misses by at most as many changes from sample to sample; a spike has to be
# larger by one. The change is that which one sample in twenty exceeds, so that other spikes do not count. Of 3,240
# drawn recordings without spikes (as in tests/unit/test_faults.py) none has a false alarm; without this rule 132.
_CHANGES, _EXCEEDED = WIDEST + 1.0, _MOST


@dataclass(frozen=True)
class _Miss:
    """By how much extrapolations from one side miss each sample (n,), in their own standard deviations.

    ``score`` is nan where there are too few samples on that side; ``large`` says whether the miss is as large as that
    of a spike, ``alone`` whether it makes a spike where there is no other side, and ``clean`` whether the samples that
    were extrapolated are of the same branch as the sample.
    """

    score: Array
    large: Mask
    alone: Mask
    clean: Mask

    @property
    def mirrored(self) -> _Miss:
        """The misses from the last sample to the first."""
        return _Miss(self.score[::-1], self.large[::-1], self.alone[::-1], self.clean[::-1])

    def agreement(self, other: _Miss) -> Array:
        """Return by how many standard deviations (n,) both miss each sample in one direction; 0 where they do not."""
        with np.errstate(invalid="ignore"):
            least = np.minimum(np.abs(self.score), np.abs(other.score))
            # Few samples are missed by as much.
            samples = np.flatnonzero(
                (least >= _BOTH) & self.large & other.large & (self.score * other.score > 0)
            )
        own, its = self.clean[samples], other.clean[samples]
        sure = np.abs(np.where(own, self.score[samples], other.score[samples])) >= _ALONE
        samples = samples[(own & its) | (sure & (own | its))]
        misses = np.zeros(len(least))
        misses[samples] = least[samples]
        return misses


def spikes(
    values: Array, x: Array, branch: NDArray[np.int_], explained: Array | float = 0.0, ends: bool = False
) -> Mask:
    """Return which samples of a signal are spikes."""
    n = len(values)
    bad = np.zeros(n, dtype=bool)
    if n < _FEWEST:
        return bad
    smallest = _SMALLEST * float(np.ptp(np.sort(values)[n // 50 : n - n // 50]))
    floor = np.maximum(max(smallest, _STEPS * quantum(values)), np.broadcast_to(explained, n))
    for _ in range(n):
        remaining = np.flatnonzero(~bad)
        largest = _largest(values[remaining], x[remaining], branch[remaining], floor[remaining], ends)
        if not len(largest):
            return bad
        bad[remaining[largest]] = True
        if bad.mean() > _MOST:
            break
    return np.zeros(n, dtype=bool)


def _largest(values: Array, x: Array, branch: NDArray[np.int_], floor: Array, ends: bool) -> NDArray[np.intp]:
    """Return the samples of the spikes that are the largest in their neighbourhood."""
    n = len(values)
    at_end = np.maximum(floor, _CHANGES * np.quantile(np.abs(np.diff(values)), 1.0 - _EXCEEDED))
    back = slice(None, None, -1)
    left = [_miss(values, x, branch, floor, at_end, gap, False) for gap in range(1, WIDEST + 1)]
    right = [
        _miss(values[back], -x[back], branch[back], floor[back], at_end[back], gap, True).mirrored
        for gap in range(1, WIDEST + 1)
    ]
    height = np.zeros((WIDEST, n))
    for width in range(1, WIDEST + 1):
        block = np.full(n, np.inf)
        for k in range(width):
            before, after = left[k], right[width - k - 1]
            agreement = before.agreement(after)
            for side, other in ((after, before), (before, after)) if ends else ():
                none = np.flatnonzero(np.isnan(other.score))
                agreement[none] = np.where(side.alone[none], np.abs(side.score[none]), 0.0)
            block[: n - k] = np.minimum(block[: n - k], agreement[k:])
        block[n - width + 1 :] = 0.0
        # The misses beyond noise next to the block: before it those of the extrapolations from earlier samples, after
        # it those from later ones, neither of which used the samples of the block.
        high = np.flatnonzero(block)
        sides = [np.where(side.clean, np.abs(side.score), 0.0) for side in (left[0], right[0])]
        padded = np.pad(sides[0], (_NEARBY, 0)), np.pad(sides[1], (0, _NEARBY + width))
        windows = [sliding_window_view(side, _NEARBY) for side in padded]
        most = np.maximum(
            windows[0][high].max(axis=1, initial=0.0), windows[1][high + width].max(axis=1, initial=0.0)
        )
        nearby = np.sqrt(np.maximum(most**2 - _NOISE_NEARBY**2, 0.0))
        block[high[block[high] < _OVER_NEARBY * nearby]] = 0.0
        height[width - 1] = block
    # Of spikes that share samples, or lie in each other's parabolas, the highest is taken first.
    best = height.max(axis=0)
    high = np.flatnonzero(best > 0)
    around = sliding_window_view(np.pad(best, _SAMPLES), 2 * _SAMPLES + 1)[high]
    starts = high[best[high] == around.max(axis=1)]
    samples = [s + k for s in starts for k in range(int(np.argmax(height[:, s])) + 1)]
    return np.array(samples, dtype=np.intp)


def _miss(
    values: Array,
    x: Array,
    branch: NDArray[np.int_],
    floor: Array,
    at_end: Array,
    gap: int,
    first: bool,
) -> _Miss:
    """Extrapolate to each sample from samples that end ``gap`` samples before it; the nearest forecast counts."""
    parabola, size, clean = _by_parabola(values, x, branch, gap)
    score = parabola
    n = len(values)
    for samples in _ON_LINES:
        # Straight lines through a few samples; nan where there are too few.
        other, miss, start = np.full(n, np.nan), np.full(n, np.nan), gap + samples - 1
        for position in range(0, n - start, _PIECE):
            count = min(_PIECE, n - start - position)
            y = np.stack([values[position + k : position + k + count] for k in range(samples)])
            u = np.stack([x[position + k : position + k + count] for k in range(samples)])
            centre = u.mean(axis=0)
            u -= centre
            power = (u * u).sum(axis=0)
            judged = slice(position + start, position + start + count)
            ahead = x[judged] - centre
            miss[judged] = values[judged] - y.mean(axis=0) - (u * y).sum(axis=0) / power * ahead
            other[judged] = miss[judged] / np.sqrt(1.0 + 1.0 / samples + ahead**2 / power)
        other /= _scale(other[start:], values)
        with np.errstate(invalid="ignore"):
            nearer = ~(np.abs(other) >= np.abs(score))
            # Forecasts on both sides of the sample: it is no outlier.
            between = other * score < 0
        score = np.where(between, 0.0, np.where(nearer, other, score))
        size = np.where(between, 0.0, np.where(nearer, miss, size))
    score = np.where(np.isnan(parabola), np.nan, score)
    size = np.nan_to_num(size)
    forecast = values - size
    begins = first & (values * forecast >= 0.0) & (np.abs(values) <= np.abs(forecast))
    with np.errstate(invalid="ignore"):
        alone = clean & ~begins & (np.abs(score) >= _ALONE) & (np.abs(size) >= at_end)
    return _Miss(score, np.abs(size) >= floor, alone, clean)


def _scale(score: Array, values: Array) -> float:
    """Return the standard deviation of the scores; it is nearly zero for a signal without noise."""
    spread = 1.4826 * float(np.median(np.abs(score))) if len(score) else 0.0
    return max(spread, 1e-9 * float(np.ptp(values)), 1e-300)


def _by_parabola(values: Array, x: Array, branch: NDArray[np.int_], gap: int) -> tuple[Array, Array, Mask]:
    """Extrapolate parabolas through up to 9 samples, of the branch alone if it has at least 5 of them.

    Scores and misses (n,) are nan where there are too few; the mask says where the branch alone has enough.
    """
    n, pad = len(values), gap + _SAMPLES - 1
    score, size, clean, enough = np.empty(n), np.empty(n), np.empty(n, dtype=bool), np.empty(n, dtype=bool)
    before = [np.concatenate([np.full(pad, signal[0]), signal]) for signal in (x, values)]
    numbers = np.concatenate([np.full(pad, branch[0] - 1), branch])
    for start in range(0, n, _PIECE):
        piece = slice(start, min(start + _PIECE, n))
        back = [slice(piece.start + pad - gap - k, piece.stop + pad - gap - k) for k in range(_SAMPLES)]
        own = np.stack([numbers[part] for part in back]) == branch[piece]
        clean[piece] = own.sum(axis=0) >= _LEAST
        there = np.arange(piece.start, piece.stop) - gap >= np.arange(_SAMPLES)[:, None]
        used = np.where(clean[piece], own, there)
        enough[piece] = used.sum(axis=0) >= _LEAST
        u = np.stack([before[0][part] for part in back])
        # Samples that are not used may be far away: they must not determine the scale.
        u = (u - x[piece]) * used
        u /= np.maximum(np.abs(u).max(axis=0), 1e-300)
        # The parabola at u = 0 by the normal equations: moments of the abscissae, and the first column of the inverse.
        powers = [used.astype(float)]
        for _ in range(4):
            powers.append(powers[-1] * u)
        s0, s1, s2, s3, s4 = (power.sum(axis=0) for power in powers)
        inverse = np.stack([s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2])
        determinant = s0 * inverse[0] + s1 * inverse[1] + s2 * inverse[2]
        poor = enough[piece] & (determinant <= 1e-9 * s0 * s2 * s4)
        inverse /= np.where(enough[piece] & ~poor, determinant, 1.0)
        if poor.any():
            # Cofactors lose too many digits where samples are far from each other.
            normal = np.stack([s0, s1, s2, s1, s2, s3, s2, s3, s4], axis=1)[poor].reshape(-1, 3, 3)
            inverse[:, poor] = np.linalg.pinv(normal, hermitian=True)[:, :, 0].T
        y = np.stack([before[1][part] for part in back])
        y -= values[piece]
        size[piece] = -sum(inverse[k] * (powers[k] * y).sum(axis=0) for k in range(3))
        score[piece] = size[piece] / np.sqrt(1.0 + np.where(enough[piece], np.maximum(inverse[0], 0.0), 0.0))
    judged = enough & clean
    nan = np.where(enough, 0.0, np.nan)
    return score / _scale(score[judged], values) + nan, size + nan, judged
