"""A plot as SVG in the page itself, which `templates/zoom.js` makes zoomable; without a script it is a picture.

The data are in an inner <svg> whose viewBox is the visible part: zooming changes only that viewBox. Lines keep
their width (`vector-effect`); grid and labels are outside and are drawn again. Colours are classes of the style sheet,
so that they follow light, dark and print.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Outer size and the pane of the data within it, in units of the outer viewBox.
WIDTH, LEFT, RIGHT, TOP, BOTTOM = 900.0, 78.0, 12.0, 12.0, 46.0


@dataclass(frozen=True)
class Series:
    """A line, or dots, that can be switched off.

    Attributes
    ----------
    key : str
        Class in the style sheet: "recorded", "before", "after", "path".
    label : str
    x, y : shape (n,)
        NaN interrupts the line.
    dots : bool
    """

    key: str
    label: str
    x: Array
    y: Array
    dots: bool = False


@dataclass(frozen=True)
class Region:
    """A marked and numbered place to which the user can zoom.

    Attributes
    ----------
    number : int
    key : str
        Class in the style sheet: "stiff" or "soft".
    label : str
        The sentence that describes it.
    outlines : sequence of shape (n, 2)
        Polygons.
    at : (float, float)
        Position of its number.
    """

    number: int
    key: str
    label: str
    outlines: Sequence[Array]
    at: tuple[float, float]


@dataclass(frozen=True)
class Plot:
    """A plot: axes, lines and marked places.

    Attributes
    ----------
    name : str
        Unique on the page.
    title, x_label, y_label : str
    x, y : (float, float)
        Initially visible range.
    series : sequence of Series
        Later series are drawn on top.
    regions : sequence of Region
    bands : sequence of (float, float, float, float, str)
        Rectangles x0, x1, y0, y1 and their class, behind everything else; NaN means the edge of the plot.
    height : float
    brief : bool
        Whether the regions are described elsewhere on the page, so that the legend has their numbers only.
    heading : str
        Text before the legend, if the page has several plots of this kind.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    x: tuple[float, float]
    y: tuple[float, float]
    series: Sequence[Series]
    regions: Sequence[Region] = ()
    bands: Sequence[tuple[float, float, float, float, str]] = ()
    height: float = 430.0
    brief: bool = False
    heading: str = ""


def svg(plot: Plot) -> str:
    """Return the plot with its legend; all text is escaped."""
    width, height = WIDTH - LEFT - RIGHT, plot.height - TOP - BOTTOM
    seen = f'data-x="{plot.x[0]:.9g} {plot.x[1]:.9g}" data-y="{plot.y[0]:.9g} {plot.y[1]:.9g}"'
    inner = [_band(plot, band, width, height) for band in plot.bands]
    inner += [_region(plot, region, width, height) for region in plot.regions]
    inner += [_series(plot, series, width, height) for series in plot.series]
    title = html.escape(plot.title)
    return "\n".join(
        [
            f'<figure class="plot" id="{html.escape(plot.name)}">',
            _legend(plot),
            f'<svg class="frame" viewBox="0 0 {WIDTH:g} {plot.height:g}" {seen} tabindex="0" role="img" '
            f'aria-label="{title}">',
            f"<title>{title}</title>",
            f'<g class="grid">{_grid(plot, width, height)}</g>',
            f'<svg class="pane" x="{LEFT:g}" y="{TOP:g}" width="{width:g}" height="{height:g}" '
            f'viewBox="0 0 {width:g} {height:g}" preserveAspectRatio="none">',
            *inner,
            "</svg>",
            f'<g class="numbers">{"".join(_number(plot, r, width, height) for r in plot.regions)}</g>',
            f'<rect class="edge" x="{LEFT:g}" y="{TOP:g}" width="{width:g}" height="{height:g}"/>',
            f'<text class="axis" x="{LEFT + width / 2:g}" y="{plot.height - 8:g}">{html.escape(plot.x_label)}</text>',
            f'<text class="axis" transform="translate(16 {TOP + height / 2:g}) rotate(-90)">'
            f"{html.escape(plot.y_label)}</text>",
            f'<text class="readout" x="{LEFT + width - 8:g}" y="{TOP + height - 10:g}"></text>',
            "</svg>",
            "</figure>",
        ]
    )


def ticks(low: float, high: float, most: int) -> list[float]:
    """Return round numbers between two values, in steps of 1, 2 or 5 times a power of ten.

    Parameters
    ----------
    low : float
        Lower end, in the unit of the axis.
    high : float
        Upper end, in the unit of the axis.
    most : int
        Largest number of intervals.
    """
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= raw * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)]


def _grid(plot: Plot, width: float, height: float) -> str:
    """Return lines and numbers as `zoom.js` draws them."""
    parts = []
    for value in ticks(*plot.x, 9):
        x = LEFT + float(_x(plot, value, width))
        zero = ' class="zero"' if value == 0 else ""
        parts.append(f'<line{zero} x1="{x:.2f}" x2="{x:.2f}" y1="{TOP:g}" y2="{TOP + height:g}"/>')
        parts.append(f'<text class="x" x="{x:.2f}" y="{TOP + height + 17:g}">{_tick(value)}</text>')
    for value in ticks(*plot.y, 7):
        y = TOP + float(_y(plot, value, height))
        zero = ' class="zero"' if value == 0 else ""
        parts.append(f'<line{zero} x1="{LEFT:g}" x2="{LEFT + width:g}" y1="{y:.2f}" y2="{y:.2f}"/>')
        parts.append(f'<text class="y" x="{LEFT - 7:g}" y="{y + 4:.2f}">{_tick(value)}</text>')
    return "".join(parts)


def _tick(value: float) -> str:
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")


def _x(plot: Plot, value: float | Array, width: float) -> Array:
    return np.asarray((np.asarray(value) - plot.x[0]) / (plot.x[1] - plot.x[0]) * width)


def _y(plot: Plot, value: float | Array, height: float) -> Array:
    return np.asarray((plot.y[1] - np.asarray(value)) / (plot.y[1] - plot.y[0]) * height)


def _series(plot: Plot, series: Series, width: float, height: float) -> str:
    x, y = _x(plot, series.x, width), _y(plot, series.y, height)
    finite = np.isfinite(x) & np.isfinite(y)
    # A line of zero length with round ends is a dot that keeps its size.
    parts, pen = [], "M"
    for at_x, at_y, good in zip(x, y, finite, strict=True):
        if not good:
            pen = "M"
        elif series.dots:
            parts.append(f"M{at_x:.2f} {at_y:.2f}h0")
        else:
            parts.append(f"{pen}{at_x:.2f} {at_y:.2f}")
            pen = "L"
    kind = "dots" if series.dots else "line"
    return f'<path class="{kind} {series.key}" d="{"".join(parts)}"/>'


def _band(plot: Plot, band: tuple[float, float, float, float, str], width: float, height: float) -> str:
    x0, x1, y0, y1, key = band
    far = 50.0  # widths or heights of the pane: further than a user can pan
    left = -far * width if math.isnan(x0) else float(_x(plot, x0, width))
    right = far * width if math.isnan(x1) else float(_x(plot, x1, width))
    top = -far * height if math.isnan(y1) else float(_y(plot, y1, height))
    bottom = far * height if math.isnan(y0) else float(_y(plot, y0, height))
    return (
        f'<rect class="band {key}" x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" '
        f'height="{bottom - top:.2f}"/>'
    )


def _region(plot: Plot, region: Region, width: float, height: float) -> str:
    shapes = []
    for outline in region.outlines:
        points = np.stack([_x(plot, outline[:, 0], width), _y(plot, outline[:, 1], height)], axis=1)
        shapes.append("M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points) + "Z")
    return f'<path class="region {region.key}" data-number="{region.number}" d="{"".join(shapes)}"/>'


def _number(plot: Plot, region: Region, width: float, height: float) -> str:
    x, y = float(_x(plot, region.at[0], width)), float(_y(plot, region.at[1], height))
    place = f'transform="translate({LEFT + x:.2f} {TOP + y:.2f})"'
    return (
        f'<g class="number-mark {region.key}" data-x="{x:.2f}" data-y="{y:.2f}" {place}>'
        f'<circle r="9"/><text y="4">{region.number}</text></g>'
    )


def _legend(plot: Plot) -> str:
    entries = [f"<strong>{html.escape(plot.heading)}</strong>"] if plot.heading else []
    entries += [
        f'<button type="button" class="key {series.key}" data-key="{series.key}" aria-pressed="true">'
        f"<i></i>{html.escape(series.label)}</button>"
        for series in plot.series
    ]
    entries.append(
        '<span class="zoom"><button type="button" data-zoom="in" title="zoom in">+</button>'
        '<button type="button" data-zoom="out" title="zoom out">\N{MINUS SIGN}</button>'
        '<button type="button" data-zoom="all" title="show all (double click)">all</button></span>'
    )
    links = "".join(
        f'<li><button type="button" class="place {region.key}" data-number="{region.number}" '
        f'title="{html.escape(region.label)}"><b>{region.number}</b>'
        f"{'' if plot.brief else f' {html.escape(region.label)}'}</button></li>"
        for region in plot.regions
    )
    places = f'<ol class="places{" brief" if plot.brief else ""}">{links}</ol>' if links else ""
    return f'<figcaption><div class="keys">{"".join(entries)}</div>{places}</figcaption>'
