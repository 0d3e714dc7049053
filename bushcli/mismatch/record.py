"""Locate the misfit in the record: which parts of which recordings are missed by more than noise, and in which sense.

The record is divided into bins (`bins`), each bin is tested, and neighbours are joined to the few boxes that stand out
most (`scan`). The first box is the one with the most significant misfit of one sign; its bins are then left out, and
the next box is searched. The search ends at a box that noise alone would cause in more than 5 % of all recordings, or
whose share is too small to mention. Excess is the sum of squares beyond that of noise, in units of its variance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.likelihood.noise import Compared
from bushcli.mismatch.bins import KINDS, SIDES, Bin, Bins, Side, bin_tests, bins
from bushcli.mismatch.scan import Box, false_alarm, strongest_box

Array = NDArray[np.float64]
Sign = Literal["too_stiff", "too_soft", "too_high", "too_low", "both_ways"]

# Probability that noise alone causes a mismatch in any of the channels. Convention.
LEVEL = 0.05
# Least share of the excess that is worth a sentence; largest number of mismatches.
_SMALLEST_SHARE = 0.03
_MOST = 5
# Standard deviations by which a band may differ from the value expected from the box next to it. Convention: two
# standard deviations; words only.
_UNSURE = 2.0
# A misfit is given relative to the force if this share of the force has one sign, and it is this share of the
# largest. Words only: otherwise the misfit is given in N, not in %.
_ONE_WAY, _LARGE_ENOUGH = 0.8, 0.05
# Mean of a misfit over its root mean square below which it has no sense. Judgement.
_SENSELESS = 0.1


@dataclass(frozen=True)
class Mismatch:
    """A part of a recording that the simulation misses by more than noise.

    Attributes
    ----------
    cycle : (int, int)
        First and last.
    branch : str
        "loading", "unloading", "hold", "loading and unloading", or "all".
    side : {"positive", "negative", "both"}
        Of the displacement.
    displacement_from, displacement_to : float
        Absolute displacement, mm or rad; strain of a coupon.
    rate : (float, float) or None
        Slowest and fastest branch, mm/s or rad/s; None if all recorded rates belong to it.
    share : float
        Of the misfit above the noise, of all channels; of disjoint parts at most 1 together.
    sign : {"too_stiff", "too_soft", "too_high", "too_low", "both_ways"}
        Of the simulation; high and low are towards positive and negative forces, on both sides of zero. Both ways if
        the misfit has no sense: a fit makes the mean of what it leaves small.
    relative : float or None
        Simulated over recorded force, less 1; None where the recorded force goes through zero.
    difference : float
        Mean of simulated less recorded force in the sense of ``sign``, N, N mm or MPa; positive when too stiff or high.
    rms : float
        Root mean square misfit over the noise.
    p : float
        Probability that noise alone causes a mismatch like it anywhere in the recordings.
    whole : frozenset of str
        For which of "cycle", "branch", "side", "displacement" it covers the whole recording; "largest" if its
        displacements reach the largest recorded one.
    samples : (n,) array of bool
        Which samples of the channel belong to it.
    """

    channel: str
    mode: str
    cycle: tuple[int, int]
    branch: str
    side: Side
    displacement_from: float
    displacement_to: float
    rate: tuple[float, float] | None
    share: float
    sign: Sign
    relative: float | None
    difference: float
    rms: float
    p: float
    whole: frozenset[str]
    samples: NDArray[np.bool_]


@dataclass(frozen=True)
class Location:
    """Where the misfit is.

    Attributes
    ----------
    mismatch : tuple of Mismatch
        The mismatch with the largest share first; empty if the misfit is noise.
    excess : float
        Sum of squares of the misfit beyond that of noise, over all channels, in units of the noise's variance.
    bins : tuple of Bin
        All bins of all channels, each tested alone.
    ratio : float
        Root mean square misfit over the noise, over all samples.
    """

    mismatch: tuple[Mismatch, ...]
    excess: float
    bins: tuple[Bin, ...]
    ratio: float = 1.0


def locate(channels: Sequence[Compared]) -> Location:
    """Return where the misfit of all channels is."""
    grids = [bins(channel.recording) for channel in channels]
    excess = sum(_excess(channel, channel.known) for channel in channels)
    tested: list[Bin] = []
    mismatches: list[Mismatch] = []
    for channel, grid in zip(channels, grids, strict=True):
        tested += bin_tests(channel, grid)
        mismatches += _mismatches(channel, grid, excess, len(channels))
    # Where the rest is nearer to the model than its noise, what stands out is more than the whole: then that is all.
    whole = max(excess, sum(mismatch.share for mismatch in mismatches), 1e-300)
    mismatches = [replace(mismatch, share=mismatch.share / whole) for mismatch in mismatches]
    mismatches.sort(key=lambda mismatch: -mismatch.share)
    count = max(sum(int(channel.known.sum()) for channel in channels), 1)
    ratio = float(np.sqrt(max(1.0 + excess / count, 0.0)))
    # Holm's procedure: bins that are significant among all that are tested.
    order = sorted(range(len(tested)), key=lambda i: tested[i].p)
    failed = (k for k, i in enumerate(order) if tested[i].p > LEVEL / (len(tested) - k))
    passed = set(order[: next(failed, len(order))])
    marked = tuple(replace(tested_bin, significant=i in passed) for i, tested_bin in enumerate(tested))
    return Location(tuple(mismatches[:_MOST]), excess, marked, ratio)


def _excess(channel: Compared, samples: NDArray[np.bool_]) -> float:
    """Return the sum of squares in excess of what noise alone gives."""
    misfit = channel.misfit[samples & channel.known]
    return float(misfit @ misfit) / channel.noise.sigma**2 - len(misfit)


def _mismatches(channel: Compared, grid: Bins, excess: float, channels: int) -> list[Mismatch]:
    known = channel.known
    count = grid.total(known.astype(float))
    total = grid.total(np.where(known, channel.misfit, 0.0) * channel.weights)
    force = grid.total(np.where(known, channel.recording.force, 0.0) * channel.weights)
    left = np.ones(grid.shape, dtype=bool)
    boxes: list[tuple[Box, float]] = []
    for _ in range(_MOST):
        box = strongest_box(total * left, count * left)
        # Sidak's correction: the probability of a false alarm in any of the channels.
        p = 1.0 if box is None else 1.0 - (1.0 - false_alarm(box.z, count, channel.noise.freedom)) ** channels
        if box is None or p > LEVEL:
            break
        mask = box.mask(grid.shape) & left
        # Significant, but a small part of the misfit; the next boxes stand out less.
        if boxes and _excess(channel, mask[tuple(grid.place)] & known) < _SMALLEST_SHARE * excess:
            break
        boxes.append((box, p))
        left &= ~mask
    # Their shares are sums of squares here, and become shares in `locate`.
    mismatches = []
    left = np.ones(grid.shape, dtype=bool)
    for box, p in _join(boxes):
        whole = _to_zero(box, total * left, count * left, force)
        mask = whole.mask(grid.shape) & left
        samples = mask[tuple(grid.place)] & known
        if not samples.any():
            continue
        squares = max(_excess(channel, samples), 0.0)
        mismatches.append(_mismatch(channel, grid, whole, samples, squares, p))
        left &= ~mask
    return mismatches


def _join(boxes: Sequence[tuple[Box, float]]) -> list[tuple[Box, float]]:
    """Join boxes of one sign that together form a box, as they do if the misfit grows with the force."""
    joined = list(boxes)
    for i, j in combinations(range(len(joined)), 2):
        (a, p), (b, _) = joined[i], joined[j]
        alike = (a.rates, a.branches, a.signs, a.z > 0) == (b.rates, b.branches, b.signs, b.z > 0)
        beside = (a.cycles == b.cycles and _adjacent(a.bands, b.bands)) or (
            a.bands == b.bands and _adjacent(a.cycles, b.cycles)
        )
        if alike and beside:
            cycles, bands = _hull(a.cycles, b.cycles), _hull(a.bands, b.bands)
            rest = [joined[k] for k in range(len(joined)) if k not in (i, j)]
            return _join([(replace(a, cycles=cycles, bands=bands), p), *rest])
    return joined


def _adjacent(a: tuple[int, int], b: tuple[int, int]) -> bool:
    return a[1] + 1 == b[0] or b[1] + 1 == a[0]


def _hull(a: tuple[int, int], b: tuple[int, int]) -> tuple[int, int]:
    return min(a[0], b[0]), max(a[1], b[1])


def _to_zero(box: Box, total: Array, count: Array, force: Array) -> Box:
    """Extend a box towards zero displacement, band by band, as long as its misfit continues there.

    The misfit is assumed to be proportional to the force, or constant in a box that is too high. It continues in a band
    if the band's misfit is nearer to that expectation than to zero, or within the noise of it.
    """
    signs = np.array(box.signs)[None, None, :, None, None]
    shape = count if box.is_higher else force * signs
    mask = box.mask(count.shape)
    of_shape = float((total * signs)[mask].sum()) / max(abs(float(shape[mask].sum())), 1e-300)
    first = box.bands[0]
    while first > 0:
        band = replace(box, bands=(first - 1, first - 1)).mask(count.shape)
        unit = max(float(count[band].sum()), 1.0) ** 0.5
        expected = of_shape * float(shape[band].sum()) / unit
        seen = float((total * signs)[band].sum()) / unit
        if abs(seen - expected) > max(abs(seen), _UNSURE):
            break
        first -= 1
    return replace(box, bands=(first, box.bands[1]))


def _mismatch(
    channel: Compared, grid: Bins, box: Box, samples: NDArray[np.bool_], share: float, p: float
) -> Mismatch:
    kinds, sides = set(grid.place[1, samples]), set(grid.place[2, samples])
    cycles, bands = grid.place[3, samples], grid.place[4, samples]
    place = grid.place[:, channel.known]
    whole = {
        name
        for name, axis in (("branch", 1), ("side", 2), ("cycle", 3), ("displacement", 4))
        if set(grid.place[axis, samples]) == set(place[axis])
    }
    rates = [grid.rates[i] for i in box.rates]
    if bands.max() == len(grid.edges) - 2:
        whole.add("largest")
    signs = np.array(box.signs)[grid.place[2, samples]]
    # On one side alone, too stiff means a misfit away from zero.
    if len(sides) == 1:
        signs = np.full(len(signs), -1.0 if sides == {1} else 1.0)
    force, misfit = channel.recording.force[samples], channel.misfit[samples]
    difference = float(np.mean(misfit * signs))
    higher = len(sides) == 2 and box.is_higher
    rms = float(np.sqrt(np.mean(misfit**2)))
    # Factor, less 1, on the recorded force that comes nearest to the simulated one; it has no meaning where the force
    # goes both ways or is small.
    mean_force, relative = float(np.abs(force).mean()), None
    one_way = abs(float((force * signs).mean())) >= _ONE_WAY * mean_force
    if not higher and one_way and mean_force >= _LARGE_ENOUGH * float(np.abs(channel.recording.force).max()):
        relative = float(misfit @ force / (force @ force))
    mean = difference if relative is None else relative * float(np.sqrt(np.mean(force**2)))
    sense: Sign = "too_high" if higher else "too_stiff"
    if difference <= 0:
        sense = "too_low" if higher else "too_soft"
    if abs(mean) < _SENSELESS * rms:
        sense, relative = "both_ways", None
    return Mismatch(
        channel=channel.name,
        mode=channel.recording.mode,
        cycle=(grid.cycles[cycles.min()][0], grid.cycles[cycles.max()][1]),
        branch="all"
        if "branch" in whole and len(kinds) > 1
        else " and ".join(KINDS[i] for i in sorted(kinds)),
        side="both" if len(sides) == 2 else SIDES[sides.pop()],
        displacement_from=float(grid.edges[bands.min()]),
        displacement_to=float(grid.edges[bands.max() + 1]),
        rate=(rates[0][0], rates[-1][1]) if len(rates) < len(grid.rates) else None,
        share=share,
        sign=sense,
        relative=relative,
        difference=difference,
        rms=rms / channel.noise.sigma,
        p=p,
        whole=frozenset(whole),
        samples=samples,
    )
