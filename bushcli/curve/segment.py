"""Cut a recorded displacement into loading, unloading and hold branches, and these into cycles.

The rules, all relative to the noise of the displacement, which is estimated from the signal (where the steps of a
converter show, it is at least their rounding error, a step over the square root of 12):

- A *turning point* is an extreme from which the displacement then retreats by more than 8 standard
  deviations, and by more than 0.2 % of the whole range. Noise of that size between two samples
  has a probability below 1e-7.
- A *hold* is a stretch of at least 5 samples that stays within a band of 8 standard deviations without a
  trend, reached and left abruptly: the displacement moves by one more such band in 0.3 of its duration. Where rounding
  makes the noise, one level of the staircase is none, nor is a sine's crest: it is left by three levels in that time.
- *Loading* leads away from zero displacement, *unloading* towards it; a stretch that crosses zero is cut
  there.
- An *overshoot* is not an excursion: where the motion passes zero by less than 5 % of the neighbouring excursions
  before it turns back, it is not cut there.
- An *excursion* begins with a loading branch that follows an unloading one: 0, 4, 0, -4, 0 are two. A recording that
  begins at a turning point is counted from there, in whole loops: 4, -4, 4 is one.
- A *cycle* is a full reversal, as rigs count: two successive excursions to opposite sides are one, an excursion whose
  successor goes to the same side is one by itself. 0, 4, 0, -4, 0 and 0, 4, 0 are one cycle each. Where an excursion
  differs in size from the two after it, and these are alike, it is a ramp before their cycle: 0, 4, 0, -2, 0, 2, 0 are
  two. What leads to a cycle or away from the last one without a reversal of its own belongs to that cycle.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.noise import converter_step, noise_of_sparse

Array = NDArray[np.float64]
Kind = Literal["loading", "unloading", "hold"]

TURN = 8.0
_HALF_BAND = 4.0
# Small compared with any useful program, large compared with the steps of a coarse analogue-digital converter.
_SMALLEST_TURN = 2e-3
_SMALLEST_NOISE = 1.25e-4
_SHORTEST_HOLD = 5
# Standard deviations from its median within which a hold ends where rounding makes the noise: less than a step (3.5).
_LEVEL = 3.0
# Stretches whose ends are found for all samples of a piece at once, a power of two; and samples in a piece, so that
# what is needed for them stays in the processor's cache.
_LONGEST, _PIECE = 2_048, 16_384
# Rigs overshoot zero by some per cent of the stroke; a recording cut at its turning points begins at the extreme, up to
# noise and control error.
OVERSHOOT = 0.05
AT_THE_TURN = 0.9
# Excursions are alike if they differ by less than this share of the larger one, as amplitudes of cycles are
# (`bushcli.standards.observation`).
_ALIKE = 0.1


@dataclass(frozen=True)
class Segment:
    """A stretch of a recording.

    Attributes
    ----------
    kind : {"loading", "unloading", "hold"}
    start, stop : int
        Samples ``start:stop``. Branches follow each other without gap or overlap: a turning point is the
        last sample of the branch that leads to it.
    cycle : int
        From 1.
    direction : {1, -1, 0}
        Sign of the displacement rate, 0 in a hold.
    """

    kind: Kind
    start: int
    stop: int
    cycle: int
    direction: int


def per_sample(segments: Sequence[Segment], values: Sequence[Any]) -> NDArray[Any]:
    """Return the value of its segment for each sample.

    Parameters
    ----------
    segments : sequence of Segment
        Of all samples (n,).
    values : sequence
        One for each segment.
    """
    return np.repeat(values, [segment.stop - segment.start for segment in segments])


def displacement_noise(displacement: Array, time: Array | None = None) -> float:
    """Return the standard deviation of the noise of a displacement, in its unit.

    Parameters
    ----------
    displacement : Array
        Shape (n,), mm or rad.
    time : Array | None
        Shape (n,), s; None where the recording has none.
    """
    # The residuals of few levels are few numbers, and their median is often zero.
    rounding = converter_step(displacement) / np.sqrt(12.0)
    return max(noise_of_sparse(displacement, _abscissa(displacement, time), 3), rounding)


def segment(
    displacement: Array, time: Array | None = None, sigma: float | None = None
) -> tuple[Segment, ...]:
    """Cut a displacement (n,) at its turning points, holds and zero crossings; see the module for the rules.

    Parameters
    ----------
    displacement : (n,) array
    time : (n,) array, optional
        Strictly increasing; without it, holds are judged by the number of samples.
    sigma : float, optional
        Standard deviation of the displacement's noise in its unit, if it is known.

    Returns
    -------
    tuple of Segment
        At least one, covering all samples.
    """
    segments = excursions(displacement, time, sigma)
    pending = []
    for number, branches in groupby(segments, lambda branch: branch.cycle):
        part = list(branches)
        start, stop = max(part[0].start - 1, 0), part[-1].stop
        furthest = start + int(np.argmax(np.abs(displacement[start:stop])))
        kinds = [branch.kind for branch in part if branch.kind != "hold"]
        ends = float(displacement[start]), float(displacement[furthest])
        pending.append(_Excursion(number, *ends, len(set(kinds)) == 2, kinds[:1] == ["unloading"]))
    groups: list[list[_Excursion]] = []
    while pending:
        size = 2 if _reverse(pending, groups[-1] if groups else ()) else 1
        groups.append(pending[:size])
        pending = pending[size:]
    # A dip before the first cycle, and the way back to rest or to a preload after the last one, are no cycles.
    if len(groups) > 1 and len(groups[0]) == 1 and not groups[0][0].is_cycle:
        excursion, after = groups[0][0], groups[1]
        if excursion.height < OVERSHOOT * after[0].height or _at_preload(excursion, after, after[0].begin):
            groups[:2] = [[excursion, *after]]
    if len(groups) > 1 and len(groups[-1]) == 1 and not groups[-1][0].is_cycle:
        before, excursion = groups[-2], groups[-1][0]
        # A last loading as far as before is half a cycle more; a mere return to rest is not.
        least = AT_THE_TURN * max(abs(each.furthest) for each in before)
        returns = abs(excursion.furthest) < least or excursion.height == 0.0
        if _at_preload(excursion, before, excursion.begin) if excursion.reverses else returns:
            groups[-2:] = [[*before, excursion]]
    numbers = {excursion.number: i for i, group in enumerate(groups, 1) for excursion in group}
    return tuple(replace(branch, cycle=numbers[branch.cycle]) for branch in segments)


def excursions(
    displacement: Array, time: Array | None = None, sigma: float | None = None
) -> tuple[Segment, ...]:
    """Return the branches of a displacement as `segment` does, but with the numbers of their excursions as cycles."""
    span = float(np.ptp(displacement))
    if len(displacement) < 2 or span == 0.0:
        return (Segment("hold", 0, len(displacement), 1, 0),)
    sigma = displacement_noise(displacement, time) if sigma is None else sigma
    threshold = max(TURN * sigma, _SMALLEST_TURN * span)
    # The threshold has to stay below the range if the noise exceeds a twentieth of it.
    threshold = min(threshold, 0.4 * span)
    turns = turning_points(displacement, threshold)
    abscissa, step = _abscissa(displacement, time), converter_step(displacement)
    holds = _holds(displacement, abscissa, max(sigma, _SMALLEST_NOISE * span), step)
    # Turning points within a hold do not cut it.
    q, held = displacement, np.zeros(len(displacement), dtype=bool)
    for start, stop in holds:
        held[start:stop] = True
    cuts = {0, len(q)} | {edge for hold in holds for edge in hold} | {t + 1 for t in turns if not held[t]}
    # Pieces that move without a net displacement, a hold's ragged ends, are joined to their neighbour.
    pieces: list[tuple[int, int, bool]] = []
    for start, stop in pairwise(sorted(cuts)):
        idle = not held[start] and abs(q[stop - 1] - q[max(start - 1, 0)]) < threshold
        if pieces and (idle or (held[start] and pieces[-1][2])):
            pieces[-1] = (pieces[-1][0], stop, pieces[-1][2])
        else:
            pieces.append((start, stop, bool(held[start])))
    if len(pieces) > 1 and not pieces[0][2] and abs(q[pieces[0][1] - 1] - q[0]) < threshold:
        pieces[:2] = [(0, pieces[1][1], pieces[1][2])]
    return tuple(_named_segments(pieces, q, threshold))


def _abscissa(displacement: Array, time: Array | None) -> Array:
    return np.arange(len(displacement), dtype=float) if time is None else time


def turning_points(q: Array, threshold: float) -> list[int]:
    """Return the samples at which the direction changes, by the zigzag rule.

    Parameters
    ----------
    q : (n,) array
        Displacement, in any unit.
    threshold : float
        In the unit of `q`: smaller reversals do not count.
    """
    turns: list[int] = []
    low = high = direction = 0
    lowest = highest = float(q[0])
    for i, value in enumerate(np.ascontiguousarray(q, dtype=float).data):
        if value > highest:
            high, highest = i, value
        if value < lowest:
            low, lowest = i, value
        if direction >= 0 and highest - value > threshold:
            if direction > 0 or high > 0:
                turns.append(high)
            direction, low, high, lowest, highest = -1, i, i, value, value
        elif direction <= 0 and value - lowest > threshold:
            if direction < 0 or low > 0:
                turns.append(low)
            direction, low, high, lowest, highest = 1, i, i, value, value
    return turns


def _holds(q: Array, x: Array, sigma: float, step: float) -> list[tuple[int, int]]:
    """Return the holds, as (start, stop), of a signal whose converter has the given step; 0: none is known."""
    band = 2.0 * _HALF_BAND * sigma
    coarse = step > _LEVEL * sigma
    width = 2.0 * _LEVEL * sigma if coarse else band
    # Views, because most stretches are short: a function of NumPy takes longer than they do.
    values, times = (np.ascontiguousarray(signal, dtype=float).data for signal in (q, x))
    holds, start, n = [], 0, len(q)
    stops = _stops(q, band)
    while start <= n - _SHORTEST_HOLD:
        stop = int(stops[start])
        if stop - start >= _LONGEST:
            out, size = np.zeros(0, dtype=bool), _LONGEST
            while not out.any() and len(out) < n - start:
                size *= 2
                part = q[start : start + size]
                out = np.maximum.accumulate(part) - np.minimum.accumulate(part) > band
            stop = start + (int(np.argmax(out)) if out.any() else len(out))
        first, last = start, stop
        if coarse and stop - start >= _SHORTEST_HOLD:
            # Two levels of the ramps beside it are in the band. Twice, because they move the median.
            first, last = _on_level(q, *_on_level(q, start, stop, 0.5 * width), 0.5 * width)
        long = last - first >= _SHORTEST_HOLD and _is_abrupt(values, times, first, last, width)
        if long and _is_still(q[first:last], x[first:last], sigma):
            holds.append((first, last))
            start = stop
        else:
            start += max(1, (stop - start) // 8)
    return holds


def _on_level(q: Array, start: int, stop: int, reach: float) -> tuple[int, int]:
    """Return the part of a stretch without the samples at its ends that are not within reach of its median."""
    part = q[start:stop]
    near = np.flatnonzero(np.abs(part - np.partition(part, len(part) // 2)[len(part) // 2]) <= reach)
    return start + int(near[0]), start + int(near[-1]) + 1


def _stops(q: Array, band: float) -> NDArray[np.int_]:
    """Return the first sample (n,) after each that is not in one band with all between; at most `_LONGEST` further on.

    A stretch is put together of halves, quarters and so on of `_LONGEST`, whose extremes are known.
    """
    stops = np.empty(len(q), dtype=np.int_)
    for start in range(0, len(q), _PIECE):
        part = np.append(q[start : start + _PIECE + _LONGEST], np.nan)
        sizes = [1 << k for k in range(_LONGEST.bit_length())]
        highs, lows = [part], [part]
        for size in sizes[:-1]:
            # Stretches beyond the last sample contain nan, and no band.
            beyond = np.full(min(size, len(part)), np.nan)
            highs.append(np.maximum(highs[-1], np.concatenate([highs[-1][size:], beyond])))
            lows.append(np.minimum(lows[-1], np.concatenate([lows[-1][size:], beyond])))
        count = min(_PIECE, len(q) - start)
        stop, high, low = np.arange(count), part[:count].copy(), part[:count].copy()
        for size, top, bottom in reversed(list(zip(sizes, highs, lows, strict=True))):
            inside = np.minimum(stop, len(part) - 1)
            new_high, new_low = np.maximum(high, top[inside]), np.minimum(low, bottom[inside])
            fits = new_high - new_low <= band
            high, low = np.where(fits, new_high, high), np.where(fits, new_low, low)
            stop += size * fits
        stops[start : start + count] = start + stop
    return stops


def _is_abrupt(q: Sequence[float], x: Sequence[float], start: int, stop: int, band: float) -> bool:
    """Whether the motion into and out of a stretch is fast: one more band in 0.3 of its duration.

    At the crest of a sine, where the band takes a time t to leave, the next takes more than 0.37 t.
    """
    margin = 0.3 * (x[stop - 1] - x[start])
    before = q[bisect_left(x, x[start] - margin) : start]
    # The median is no further than a band from any sample: most stretches are none by that alone.
    if start and not (before and max(max(before) - q[start], q[start] - min(before)) > 0.5 * band):
        return False
    after = q[stop : bisect_right(x, x[stop - 1] + margin)]
    ordered, half = sorted(q[start:stop]), (stop - start) // 2
    centre = 0.5 * (ordered[half] + ordered[-1 - half])
    low, high = centre - 1.5 * band, centre + 1.5 * band
    came = start == 0 or (bool(before) and (max(before) > high or min(before) < low))
    return came and (stop == len(q) or (bool(after) and (max(after) > high or min(after) < low)))


def _is_still(q: Array, x: Array, sigma: float) -> bool:
    """Whether a stretch shows noise but neither a trend nor the arch of a slow reversal."""
    n = len(q)
    third = max(1, n // 3)
    first, middle, last = q[:third].mean(), q[third : n - third].mean(), q[n - third :].mean()
    trend = np.polynomial.polynomial.polyfit((x - x[0]) / (x[-1] - x[0]), q, 1)[1]
    arch = middle - 0.5 * (first + last)
    # Four standard errors of trend and arch under white noise, but no less than a rig may drift in a hold.
    straight = abs(trend) <= sigma * max(1.0, 4.0 * np.sqrt(12.0 / n))
    flat = abs(arch) <= sigma * max(0.5, 4.0 * np.sqrt(1.5 / third))
    return bool(straight and flat and q.std() <= 1.6 * sigma)


def _named_segments(pieces: list[tuple[int, int, bool]], q: Array, threshold: float) -> Iterator[Segment]:
    cycle, turned, side = 1, False, 0
    moving = next(((start, stop) for start, stop, held in pieces if not held), None)
    if moving:
        # The sign of the displacement at the turning point where the recording begins; 0 if it begins elsewhere.
        begin, end = float(q[max(moving[0] - 1, 0)]), float(q[moving[1] - 1])
        sign = 1 if begin > 0 else -1
        away = sign * (end - begin) < 0 and abs(begin) > threshold
        side = sign if away and abs(begin) >= AT_THE_TURN * float((sign * q).max()) else 0
    for place, (start, stop, held) in enumerate(pieces):
        if held:
            yield Segment("hold", start, stop, cycle, 0)
            continue
        before = max(start - 1, 0)
        direction = 1 if q[stop - 1] > q[before] else -1
        small = max(threshold, _overshoot(pieces, place, q))
        cuts = [start, stop]
        if q[before] * q[stop - 1] < 0 and min(abs(q[before]), abs(q[stop - 1])) > small:
            # It crosses zero: the sample nearest to it ends the first part.
            middle = start + int(np.argmin(np.abs(q[start:stop]))) + 1
            cuts = [start, middle, stop] if start < middle < stop else cuts
        for first, last in pairwise(cuts):
            end = q[last - 1]
            kind: Kind = "loading" if abs(end) > abs(q[max(first - 1, 0)]) else "unloading"
            # A cycle ends where the next one begins: at rest, or at the turning point at which the file begins.
            if kind == ("unloading" if side else "loading") and turned:
                cycle, turned = cycle + 1, False
            turns = end * side > 0 if side and kind == "loading" else not side and kind == "unloading"
            turned = turned or turns
            yield Segment(kind, first, last, cycle, direction)


@dataclass(frozen=True)
class _Excursion:
    """Where an excursion begins and is furthest (mm, rad, stretch - 1), whether it comes back, whether it is a loop."""

    number: int
    begin: float
    furthest: float
    reverses: bool
    loop: bool

    @property
    def height(self) -> float:
        """Distance from the beginning to the furthest displacement."""
        return abs(self.furthest - self.begin)

    @property
    def is_cycle(self) -> bool:
        """Whether it is a cycle of its own."""
        return self.loop and self.reverses


def _reverse(excursions: Sequence[_Excursion], before: Sequence[_Excursion]) -> bool:
    """Whether the first two excursions are the halves of one cycle, after the cycle `before`."""
    if len(excursions) < 2 or _same_side(*excursions[:2]):
        return False
    a = [abs(half.furthest) for half in excursions[:5]]
    a = a[: next((i for i in range(2, len(a)) if _same_side(excursions[i - 1], excursions[i])), len(a))]
    if len(a) == 2 or (len(before) == 2 and _repeat([abs(half.furthest) for half in before], a)):
        return True
    if _repeat(a, a[2:]) or (len(a) == 3 and _at_preload(excursions[2], excursions[:2], 0.0)):
        return True
    ramp = not _are_alike(a[0], a[1]) and not _are_alike(a[0], a[2])
    later = len(a) > 3 and _repeat(a[1:], a[3:])
    return not (
        later or (ramp and _are_alike(a[1], a[2])) or _at_preload(excursions[0], excursions[1:3], 0.0)
    )


def _same_side(first: _Excursion, second: _Excursion) -> bool:
    """Whether two successive excursions are no halves of one cycle: on one side of zero, or whole loops."""
    return second.loop or first.furthest * second.furthest >= 0.0


def _repeat(halves: Sequence[float], later: Sequence[float]) -> bool:
    """Whether both halves of a cycle are as large as those of a later cycle, if there is one."""
    return all(_are_alike(a, b) for a, b in zip(halves[:2], later[:2], strict=False))


def _at_preload(excursion: _Excursion, cycle: Sequence[_Excursion], turn: float) -> bool:
    """Whether an excursion turns at the middle of a cycle beside it, away from rest, which it meets at `turn`."""
    ends = [half.furthest for half in cycle]
    largest = max(map(abs, ends))
    if len(cycle) == 1:
        if abs(turn) <= OVERSHOOT * largest:
            return False
        ends.append(turn)
    preload, span = 0.5 * (max(ends) + min(ends)), max(ends) - min(ends)
    return abs(preload) > OVERSHOOT * largest and abs(excursion.furthest - preload) <= _ALIKE * span


def _are_alike(a: float, b: float) -> bool:
    return abs(a - b) <= _ALIKE * max(a, b)


def _overshoot(pieces: list[tuple[int, int, bool]], place: int, q: Array) -> float:
    """Return the largest excursion of a piece beyond zero that is an overshoot: small compared with both neighbours.

    In 4, -0.1, 4 the excursion of 0.1 is an overshoot; in 0.1, -0.1, 4 it is a cycle of its own.
    """
    ends = [float(q[max(pieces[0][0] - 1, 0)])]
    index = 0
    for i, (_, stop, held) in enumerate(pieces):
        if not held:
            ends.append(float(q[stop - 1]))
        if i == place:
            index = len(ends) - 1
    start, end = ends[index - 1], ends[index]
    small = index if abs(end) < abs(start) else index - 1
    beside = [abs(ends[i]) for i in (small - 1, small + 1) if 0 <= i < len(ends)]
    same_side = all(ends[i] * ends[small] < 0 for i in (small - 1, small + 1) if 0 <= i < len(ends))
    return OVERSHOOT * min(beside) if beside and same_side else 0.0
