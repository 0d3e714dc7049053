"""Prepares a plot for both drawings: thins its curves, finds its limits, moves its numbers apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.report.document import Plot, Region
from bushcli.report.drawing.looks import LOOKS

Array = NDArray[np.floating[Any]]

# Points of a curve up to which it is drawn as it is: 5,000 take 40 kB of a page, and are more than the eye resolves.
MOST = 5000
# Points of all outlines of one plot.
_MOST_OUTLINED = 20000
# Columns into which the width is divided to thin a curve, the finest first; the pane is some 800 pixels wide.
_COLUMNS = (1600, 800, 400, 200, 100, 50)
# Distance of two numbers, in the units of the pane: their circles have a radius of 9.
_APART = 20.0
# Opacity of the largest value of a scale: a number on it can still be read.
DEEPEST = 0.75
# Free share at the edges where no limits are given.
_MARGIN = 0.04


def prepare(plot: Plot) -> Plot:
    """Return the plot with limits, thinned curves and outlines, and one place for each number."""
    if plot.is_prepared:
        return plot
    series = []
    for curve in plot.series:
        if len(curve.x) > MOST and curve.error is None:
            x, y = thin_curve(curve.x, curve.y, MOST, curve.mark != "line")
            curve = replace(curve, x=x, y=y)
        series.append(curve)
    plot = replace(plot, series=series, regions=_thin_outlines(plot.regions))
    plot = replace(plot, x=plot.x or _limits(plot, 0), y=plot.y or _limits(plot, 1))
    return replace(plot, regions=_place_numbers(plot), is_prepared=True)


def pane(plot: Plot) -> tuple[float, float, float, float]:
    """Return left, top, width and height of the pane of the data, in the units of the plot's width."""
    numbers = () if plot.y_names or plot.y is None else ticks(*plot.y, 4, plot.log == "y")
    texts = [*map(tick, numbers), *(line for _, name in plot.y_names for line in name.split("\n"))]
    longest = max(map(len, texts), default=0)
    # An axis without label has its numbers, too, unless it has names. The first number of the other axis has room.
    least = 62.0 if plot.labels[1] or not plot.y_names else 26.0
    left = min(max(least, 7.2 * longest + 16), 0.45 * plot.width)
    left += 16 if plot.labels[1] else 0
    lines = max((name.count("\n") for _, name in plot.x_names), default=0)
    bottom = (46.0 if plot.labels[0] else 26.0) + 16 * lines
    return left, 12.0, plot.width - left - 12.0, plot.height - 12.0 - bottom


def ticks(low: float, high: float, most: int, logarithmic: bool = False) -> list[float]:
    """Return round numbers between two values: in steps, or mantissas, of 1, 2 and 5."""
    if logarithmic:
        mantissas = (1, 2, 5) if high < 50 * low else (1,)
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        candidates = [factor * 10.0**power for power in powers for factor in mantissas]
        numbers = [v for v in candidates if low * (1 - 1e-9) <= v <= high * (1 + 1e-9)]
        if len(numbers) > 1:
            return numbers
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    factors = (0.5, 1, 2, 5, 10)
    chosen = next(i for i in range(1, 5) if power * factors[i] >= raw * (1 - 1e-9))
    numbers = []
    # One number alone gives no scale: the steps are then finer.
    while len(numbers) < 2 and chosen >= 0:
        step = power * factors[chosen]
        numbers = [i * step for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]
        chosen -= 1
    return numbers


def tick(value: float) -> str:
    """Return a number at an axis."""
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")


def shade(region: Region, plot: Plot) -> tuple[str, float]:
    """Return the role and the opacity of a region: the larger the value that it shows, the deeper its colour."""
    if region.value is None or plot.scale is None:
        return region.key, LOOKS[region.key].opacity
    return "stiff" if region.value > 0 else "soft", DEEPEST * min(abs(region.value) / plot.scale[0], 1.0)


def position(plot: Plot, x: Array | float, y: Array | float) -> tuple[Array, Array]:
    """Return where points are in the pane, from its upper left corner."""
    _, _, width, height = pane(plot)
    ends = []
    for values, limits, name in zip((x, y), plot.limits, "xy", strict=True):
        scale = np.log10 if plot.log == name else np.asarray
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high, at = scale(limits[0]), scale(limits[1]), scale(np.asarray(values, dtype=float))
        ends.append((at - low) / (high - low))
    return width * ends[0], height * (1.0 - ends[1])


def _limits(plot: Plot, axis: int) -> tuple[float, float]:
    """Return limits around everything that is drawn."""
    values: list[Any] = [outline[:, axis] for region in plot.regions for outline in region.outlines]
    for series in plot.series:
        at = series.x if axis == 0 else series.y
        values += [at] if series.error is None or axis == 0 else [at - series.error, at + series.error]
    values += [band.x if axis == 0 else band.y for band in plot.bands]
    values += [note.at[axis] for note in plot.notes]
    coordinates = np.concatenate([np.empty(0), *map(np.ravel, values)])
    coordinates = coordinates[np.isfinite(coordinates)]
    if plot.log == "xy"[axis]:
        coordinates = coordinates[coordinates > 0]
        if not len(coordinates):
            return 0.1, 10.0
        factor = max(float(coordinates.max() / coordinates.min()), 1.5) ** _MARGIN
        return float(coordinates.min()) / factor, float(coordinates.max()) * factor
    if not len(coordinates):
        return 0.0, 1.0
    low, high = float(coordinates.min()), float(coordinates.max())
    # Values that differ by rounding only are drawn as equal.
    margin = (
        _MARGIN * (high - low) if high - low > 1e-9 * max(abs(low), abs(high)) else 0.05 * abs(low) or 1.0
    )
    return low - margin, high + margin


# -- curves ------------------------------------------------------------------------------------------------------------


def thin_curve(x: Array, y: Array, most: int, dots: bool = False) -> tuple[Array, Array]:
    """Return at most about this many points that look like the curve; the envelope is kept exactly.

    Of consecutive samples in one column of pixels the first, the last, the lowest and the highest remain (Jugel et al.,
    M4, https://doi.org/10.14778/2732951.2732953). Passes of a loop over pixels that were drawn before are left
    out, but for the lowest and the highest point of each column.
    """
    points = np.stack([x, y], axis=1)
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        return x[:1], y[:1]
    share = (points - points[finite].min(axis=0)) / _size(points[finite])
    at: NDArray[np.intp] = np.arange(len(x))
    for columns in _COLUMNS:
        column, row = np.where(finite, share.T * (columns - 1e-6), -1).astype(np.int16)
        if not dots:
            # The extremes of a column are among those of its halves.
            at = at[_extremes(column[at], y[at])]
        chosen: NDArray[np.intp] = at
        if len(at) > most:
            new = np.zeros(len(at), dtype=bool)
            # The lowest and the highest sample of each column.
            order = np.argsort(column[at], kind="stable")
            new[order[_extremes(column[at][order], y[at][order])]] = True
            cell = column[at].astype(np.int64) * columns + row[at]
            if dots:
                new[np.unique(cell, return_index=True)[1]] = True
                chosen = at[new & finite[at]]
            else:
                # Segments that join cells that were joined before are left out; -1 interrupts the curve.
                low, high = np.minimum(cell[:-1], cell[1:]), np.maximum(cell[:-1], cell[1:])
                joins = new[:-1] | new[1:]
                joins[np.unique(low * columns**2 + high, return_index=True)[1]] = True
                joins &= finite[at][:-1] & finite[at][1:]
                used = np.append(joins, False) | np.append(False, joins)
                starts = np.flatnonzero(used & ~np.append(False, joins))
                chosen = np.insert(at[used], np.searchsorted(np.flatnonzero(used), starts[1:]), -1)
        if len(chosen) <= most:
            break
    gap = chosen < 0
    return np.where(gap, np.nan, x[chosen]), np.where(gap, np.nan, y[chosen])


def _size(points: Array) -> Array:
    """Return the extent of points (n, 2) along both axes, 1 where they have none."""
    size = np.ptp(points, axis=0)
    return np.where(size > 0.0, size, 1.0)


def _extremes(column: NDArray[np.int16], y: Array) -> NDArray[np.intp]:
    """Return first, lowest, highest and last sample of each run of samples in one column, in their order."""
    start = np.flatnonzero(np.diff(column, prepend=np.int16(-2)))
    run = np.repeat(np.arange(len(start)), np.diff(np.append(start, len(y))))
    mask = np.zeros(len(y), dtype=bool)
    mask[start], mask[np.append(start[1:], len(y)) - 1] = True, True
    for extreme in (np.fmin, np.fmax):
        samples = np.flatnonzero(y == extreme.reduceat(y, start)[run])
        mask[samples[np.diff(run[samples], prepend=-1) > 0]] = True
    return np.flatnonzero(mask)


# -- areas and their numbers -------------------------------------------------------------------------------------------


def _thin_outlines(regions: Sequence[Region]) -> Sequence[Region]:
    """Return the regions with outlines of fewer points; pieces that lie in cells drawn before are left out."""
    outlines = [outline for region in regions for outline in region.outlines]
    if sum(map(len, outlines)) <= _MOST_OUTLINED:
        return regions
    coordinates = np.concatenate(outlines)
    low, size = coordinates.min(axis=0), _size(coordinates)
    for columns in _COLUMNS[2:]:
        outlined = []
        for region in regions:
            points = np.concatenate([np.empty((0, 2)), *region.outlines])
            cell = ((points - low) / size * (columns - 1e-6)).astype(np.int16)
            new = np.zeros(len(points), dtype=bool)
            new[np.unique(cell[:, 0].astype(np.int64) * columns + cell[:, 1], return_index=True)[1]] = True
            ends = np.cumsum([0, *map(len, region.outlines)])
            pieces = [slice(a, b) for a, b in pairwise(ends) if new[a:b].any()]
            reduced = [points[piece][_extremes(cell[piece, 0], points[piece, 1])] for piece in pieces]
            outlined.append(replace(region, outlines=reduced))
        if sum(len(outline) for region in outlined for outline in region.outlines) <= _MOST_OUTLINED:
            break
    return outlined


def _place_numbers(plot: Plot) -> list[Region]:
    """Return the regions with one place for each number, far enough from the numbers before it."""
    _, _, width, height = pane(plot)
    angle = np.arange(0.0, 2 * np.pi, np.pi / 8)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points: list[Array] = []
    numbered = []
    for region in plot.regions:
        if not region.number or region.at is None:
            numbered.append(region)
            continue
        places = np.clip(np.stack(position(plot, *region.at.T), axis=1), 10.0, [width - 10.0, height - 10.0])
        around = [places[:1] + _APART * ring * circle for ring in (0.6, 1.1, 1.7, 2.4, 3.2)]
        places = np.concatenate([places, *around])
        inside = ((places >= 9.0) & (places <= [width - 9.0, height - 9.0])).all(axis=1)
        free = inside & np.all([np.hypot(*(places - place).T) >= _APART for place in points], axis=0)
        points.append(places[int(np.argmax(free))])
        x, y = points[-1]
        (left, right), (bottom, top) = plot.limits
        # Numbers are used on linear axes only.
        at = (left + x / width * (right - left), top - y / height * (top - bottom))
        numbered.append(replace(region, at=np.array([at])))
    return numbered
