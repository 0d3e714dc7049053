"""Where in a recording each sample lies: rate, branch, side, cycle and displacement band; misfit and noise per bin."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f, t

from bushcli.curve.segment import Segment, per_sample
from bushcli.likelihood.noise import Compared
from bushcli.recording import Recording, departure
from cases.mode import modes

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Side = Literal["positive", "negative", "both"]

KINDS = ("loading", "unloading", "hold")
SIDES: tuple[Side, Side] = ("positive", "negative")
# Enough to name a place; more would reduce the power of the tests, since every bin is tested.
_BANDS = 8
_CYCLES = 8
# Rates that differ by a smaller factor count as one; largest number of classes of rates. Words only: programs change
# rates by factors of 2 to 10.
_RATE_GAP = 1.6
_RATES = 3


@dataclass(frozen=True)
class Bins:
    """The grid that a channel's samples are sorted into."""

    # Edges (d + 1,) of the bands of the absolute displacement, from 0, mm or rad.
    edges: Array
    # First and last cycle of each group; every cycle is a group unless there are many.
    cycles: tuple[tuple[int, int], ...]
    # Slowest and fastest branch of each class of rates, mm/s or rad/s, the slowest first; (nan, nan) without time.
    rates: tuple[tuple[float, float], ...]
    # Rate, branch (`KINDS`), side (`SIDES`), cycle group and band of each sample, shape (5, n).
    place: Index

    @property
    def shape(self) -> tuple[int, int, int, int, int]:
        """Numbers of rates, branches, sides, cycle groups and bands."""
        return len(self.rates), len(KINDS), len(SIDES), len(self.cycles), len(self.edges) - 1

    def total(self, values: Array) -> Array:
        """Sum of values (n,) in every bin, of the grid's shape."""
        flat = np.ravel_multi_index(tuple(self.place), self.shape)
        return np.asarray(
            np.bincount(flat, values, minlength=int(np.prod(self.shape))).reshape(self.shape), dtype=float
        )


@dataclass(frozen=True)
class Bin:
    """Misfit in one bin, tested against the noise.

    Attributes
    ----------
    branch : {"loading", "unloading", "hold"}
    side : {"positive", "negative"}
        Of the displacement.
    cycle : (int, int)
        First and last.
    rate : (float, float)
        Slowest and fastest branch, mm/s or rad/s.
    displacement_from, displacement_to : float
        Absolute displacement, mm or rad.
    mean : float
        Simulated minus recorded force, N, N mm or MPa.
    rms : float
        Root mean square misfit over the noise; 1 is noise.
    excess : float
        Sum of squares beyond the noise, in units of the noise's variance.
    p : float
        Probability that noise alone causes such a mean or such an rms in this bin.
    significant : bool
        At 5 % for all bins of all channels together (Holm).
    """

    channel: str
    branch: str
    side: Side
    cycle: tuple[int, int]
    rate: tuple[float, float]
    displacement_from: float
    displacement_to: float
    samples: int
    mean: float
    rms: float
    excess: float
    p: float
    significant: bool = False


def bins(recording: Recording) -> Bins:
    """Return the grid of a recording (n samples), and the place of each sample in it."""
    segments = recording.branches
    q, n = recording.displacement, len(recording.displacement)
    # About `_BANDS` bands from 0 to the largest displacement, at round numbers of mm or degrees.
    unit = np.pi / 180 if modes()[recording.mode].rotational else 1.0
    largest = float(np.abs(q).max())
    step = largest / unit / _BANDS
    choices = 10.0 ** np.floor(np.log10(step)) * np.array([1.0, 2.0, 2.5, 5.0, 10.0])
    step = float(choices[np.argmin(np.abs(np.log(choices / step)))])
    # A remainder beyond the last full band belongs to it if it is small.
    edges = np.append(np.arange(0.0, largest / unit - 0.3 * step, step) * unit, largest)
    classes, rates = _rates(segments, recording)
    rate, cycle = per_sample(segments, classes), per_sample(segments, [branch.cycle for branch in segments])
    kind = per_sample(segments, [KINDS.index(branch.kind) for branch in segments])
    numbers = np.unique(cycle).tolist()
    cuts = np.unique(np.linspace(0, len(numbers), min(len(numbers), _CYCLES) + 1).round().astype(int))
    groups = tuple((numbers[a], numbers[b - 1]) for a, b in pairwise(cuts))
    starts = np.array([first for first, _ in groups])
    # A side that is only noise about zero does not count.
    two_sided = bool(min(-q.min(), q.max()) > 0.05 * np.abs(q).max())
    side = (q < 0).astype(int) if two_sided else np.full(n, int(-q.min() > q.max()))
    band = np.clip(np.searchsorted(edges, np.abs(q), side="right") - 1, 0, len(edges) - 2)
    place = np.stack([rate, kind, side, np.searchsorted(starts, cycle, side="right") - 1, band])
    return Bins(edges, groups, rates, place)


def bin_tests(compared: Compared, grid: Bins) -> list[Bin]:
    """Test every bin that holds samples: the mean and the mean square of its misfit, against the noise.

    A mean of n samples has the standard error sigma sqrt(T / n), with T the correlation time, and a sum of squares has
    n / T degrees of freedom; the degrees of freedom of t and F allow for the estimation of the noise. The smaller
    probability of the two tests is doubled.
    """
    known, noise = compared.known, compared.noise
    misfit = np.where(known, compared.misfit, 0.0)
    count, total = grid.total(known.astype(float)), grid.total(misfit)
    square = grid.total(misfit**2) / noise.sigma**2
    places = np.argwhere(count > 0)
    at = tuple(places.T)
    n, mean, rms = count[at], total[at] / count[at], np.sqrt(square[at] / count[at])
    size = np.abs(mean) / (noise.sigma * np.sqrt(noise.correlation_time / n))
    by_mean = 2.0 * t.sf(size, noise.freedom)
    by_size = f.sf(rms**2, np.maximum(n / noise.correlation_time, 1.0), min(noise.freedom, 1e9))
    p = np.minimum(1.0, 2.0 * np.minimum(by_mean, by_size))
    return [
        Bin(
            channel=compared.name,
            branch=KINDS[kind],
            side=SIDES[side],
            cycle=grid.cycles[cycle],
            rate=grid.rates[rate],
            displacement_from=float(grid.edges[band]),
            displacement_to=float(grid.edges[band + 1]),
            samples=int(n[i]),
            mean=float(mean[i]),
            rms=float(rms[i]),
            excess=float(n[i] * (rms[i] ** 2 - 1.0)),
            p=float(p[i]),
        )
        for i, (rate, kind, side, cycle, band) in enumerate(places)
    ]


def _rates(
    segments: tuple[Segment, ...], recording: Recording
) -> tuple[list[int], tuple[tuple[float, float], ...]]:
    """Return the rate class of each branch, and the classes; a hold has the rate of the branch before it."""
    time, q = recording.time, recording.displacement
    if time is None:
        return [0] * len(segments), ((float("nan"), float("nan")),)
    speeds, last = [], float("nan")
    for i, branch in enumerate(segments):
        first = departure(segments, i)
        seconds = float(time[branch.stop - 1] - time[first])
        if branch.kind != "hold" and seconds > 0:
            last = abs(float(q[branch.stop - 1] - q[first])) / seconds
        speeds.append(last)
    moving = [v for v in speeds if v > 0]
    speeds = [v if v > 0 else (moving[0] if moving else 1.0) for v in speeds]
    ordered = np.unique(speeds)
    gaps = np.diff(np.log(ordered))
    widest = np.sort(np.argsort(gaps)[::-1][: _RATES - 1])
    cuts = [i for i in widest if gaps[i] > np.log(_RATE_GAP)]
    parts = np.split(ordered, [i + 1 for i in cuts])
    limits = np.array([part[-1] for part in parts])
    classes = [int(np.searchsorted(limits, v)) for v in speeds]
    return classes, tuple((float(part[0]), float(part[-1])) for part in parts)
