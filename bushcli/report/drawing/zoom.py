"""A plot as SVG in the page itself, which `templates/zoom.js` makes zoomable; without a script it is a picture.

The data are in an inner <svg> whose viewBox is the visible part: zooming changes only that viewBox. Lines keep
their width (`vector-effect`); grid and labels are outside and are drawn again. Colours are classes of the style sheet,
so that they follow light, dark and print.
"""

from __future__ import annotations

import base64
import html
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from bushcli.report.document import Picture, Plot, Region, Series, Stripe
from bushcli.report.drawing.prepared import pane, position, prepared, shade, tick, ticks

Array = NDArray[np.floating[Any]]

# Widths or heights of the pane, further than a user can pan: there a band without end ends.
_FAR = 50.0


@cache
def script() -> Markup:
    """Return the script of a page with plots, which contains no text that would end its element."""
    text = (resources.files("bushcli.report") / "templates" / "zoom.js").read_text(encoding="utf-8")
    assert "</" not in text
    return Markup(f"\n{text}")


def figure(picture: Picture) -> Markup:
    """Return a picture as it stands on a page: zoomable where it was drawn from plots, otherwise as an image.

    Lines are embedded as SVG, which stays sharp, shaded bodies as PNG, which is smaller.
    """
    panels = picture.panels
    if panels is None or panels.still:
        form, data = (
            ("png", picture.png) if picture.kind in ("mesh", "deformed") else ("svg+xml", picture.svg)
        )
        image = f"data:image/{form};base64,{base64.b64encode(data).decode()}"
        return Markup('<figure class="{}"><img src="{}" alt="{}"></figure>').format(
            picture.kind, image, picture.title
        )
    title = f'<p class="title">{html.escape(panels.title)}</p>'
    scale = ""
    if panels.rows[0][0].scale:
        end, label = panels.rows[0][0].scale
        ends = [tick(float(f"{sign * end:.3g}")) for sign in (-1, 1)]
        scale = f'<p class="scale">{ends[0]} <i></i> {ends[1]} {html.escape(label)}</p>'
    note = f'<p class="note">{html.escape(panels.note)}</p>' if panels.note else ""
    rows = [
        '<div class="row">' + "\n".join(svg(plot, f"{panels.name}-") for plot in row) + "</div>"
        for row in panels.rows
    ]
    return Markup(
        "\n".join([f'<div class="panels {html.escape(panels.kind)}">', title, scale, *rows, note, "</div>"])
    )


def svg(plot: Plot, prefix: str = "") -> Markup:
    """Return one plot with its legend; all text is escaped."""
    plot = prepared(plot)
    left, top, width, height = pane(plot)
    assert plot.x is not None
    assert plot.y is not None
    seen = " ".join(
        f'data-{name}="{ends[0]:.9g} {ends[1]:.9g}"'
        for name, limits in (("x", plot.x), ("y", plot.y))
        for ends in [np.log10(limits) if plot.log == name else limits]
    )
    fixed = plot.x_names or plot.y_names
    names = f'data-fixed="{"x" * bool(plot.x_names)}{"y" * bool(plot.y_names)}" data-log="{plot.log}"'
    title = html.escape(plot.heading or " over ".join(reversed(plot.labels)))
    marks = [
        _mark(plot, one.at[0], f'<circle r="9"/><text y="4">{one.number}</text>', f" as-{one.key}")
        for one in plot.regions
        if one.number and one.at is not None
    ]
    for note in plot.notes:
        shift = {"left": -6, "right": 6, "middle": 0}[note.place]
        text = f'<text class="note-{note.place}" x="{shift}" y="4">{html.escape(note.text)}</text>'
        marks.append(_mark(plot, np.array(note.at), text))
    return Markup(
        "\n".join(
            [
                f'<figure class="plot{" still" if fixed else ""}" id="{html.escape(prefix + plot.name)}" '
                f'style="flex:0 1 {100 * plot.width / 900:.1f}%">',
                _legend(plot),
                f'<svg class="frame" viewBox="0 0 {plot.width:g} {plot.height:g}" {seen} {names} '
                f'tabindex="{-1 if fixed else 0}" role="img" aria-label="{title}">',
                f"<title>{title}</title>",
                f'<g class="grid">{_grid(plot)}</g>',
                f'<svg class="pane" x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" '
                f'viewBox="0 0 {width:g} {height:g}" preserveAspectRatio="none">',
                *(_band(plot, band) for band in plot.bands),
                *(_region(plot, region) for region in plot.regions),
                *(_series(plot, series) for series in plot.series),
                "</svg>",
                f'<g class="numbers">{"".join(marks)}</g>',
                f'<rect class="edge" x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}"/>',
                f'<text class="axis" x="{left + width / 2:g}" y="{plot.height - 8:g}">{html.escape(plot.labels[0])}'
                "</text>",
                f'<text class="axis" transform="translate(14 {top + height / 2:g}) rotate(-90)">'
                f"{html.escape(plot.labels[1])}</text>",
                f'<text class="readout" x="{left + width - 8:g}" y="{top + height - 10:g}"></text>',
                "</svg>",
                "</figure>",
            ]
        )
    )


def _grid(plot: Plot) -> str:
    """Return lines and numbers as `zoom.js` draws them, and names, which stay."""
    left, top, width, height = pane(plot)
    assert plot.x is not None
    assert plot.y is not None
    parts = []
    for value, name in plot.x_names or [
        (v, "") for v in ticks(*plot.x, round(plot.width / 75), plot.log == "x")
    ]:
        x = left + float(position(plot, value, plot.y[0])[0])
        if not plot.x_names:
            zero = ' class="zero"' if value == 0 else ""
            parts.append(f'<line{zero} x1="{x:.2f}" x2="{x:.2f}" y1="{top:g}" y2="{top + height:g}"/>')
        parts.append(_words("x", x, top + height + 17, name or tick(value), first=True))
    for value, name in plot.y_names or [
        (v, "") for v in ticks(*plot.y, max(4, round(height / 40)), plot.log == "y")
    ]:
        y = top + float(position(plot, plot.x[0], value)[1])
        if not plot.y_names:
            zero = ' class="zero"' if value == 0 else ""
            parts.append(f'<line{zero} x1="{left:g}" x2="{left + width:g}" y1="{y:.2f}" y2="{y:.2f}"/>')
        parts.append(_words("y", left - 7, y + 4, name or tick(value)))
    return "".join(parts)


def _words(axis: str, x: float, y: float, text: str, first: bool = False) -> str:
    """Return the lines of a text; they are centred about the point unless it is that of the first line."""
    lines = text.split("\n")
    y -= 0 if first else 8 * (len(lines) - 1)
    return "".join(
        f'<text class="{axis}" x="{x:.2f}" y="{y + 16 * i:.2f}">{html.escape(line)}</text>'
        for i, line in enumerate(lines)
    )


def _path(x: Array, y: Array, closed: bool = False) -> str:
    """Return points as a path in relative steps of a hundredth, which is half as long as absolute ones; NaN: a gap."""
    parts: list[str] = []
    pen, at = "M", np.zeros(2)
    # Points far outside the pane would have numbers that a browser cannot draw.
    for point in np.round(100 * np.clip(np.stack([x, y], axis=1), -1e5, 1e5)):
        if not np.isfinite(point).all():
            pen = "m" if parts else "M"
            continue
        across, down = (f"{step / 100:g}" for step in point - at)
        parts.append(f"{pen}{across}{'' if down.startswith('-') else ' '}{down}")
        pen, at = "l", point
    return "".join(parts) + ("z" if closed and parts else "")


def _series(plot: Plot, series: Series) -> str:
    x, y = position(plot, series.x, series.y)
    good = np.isfinite(x) & np.isfinite(y)
    made = []
    if series.error is not None and series.error.any():
        ends = [position(plot, series.x, series.y + sign * series.error)[1] for sign in (-1, 1)]
        bars = "".join(
            f"M{a:.2f} {b:.2f}V{c:.2f}" for a, b, c, shown in zip(x, *ends, good, strict=True) if shown
        )
        made.append(f'<path class="error" d="{bars}"/>')
    if series.mark in ("line", "both"):
        made.append(f'<path class="line as-{series.key}" d="{_path(x, y)}"/>')
    if series.mark != "line":
        # A line of zero length with round ends is a dot that keeps its size.
        dots = "".join(f"M{a:.2f} {b:.2f}h0" for a, b in zip(x[good], y[good], strict=True))
        made.append(
            f'<path class="{"dots" if series.mark != "crosses" else "dots crosses"} as-{series.key}" d="{dots}"/>'
        )
    return "".join(made)


def _band(plot: Plot, band: Stripe) -> str:
    _, _, width, height = pane(plot)
    x, y = position(plot, np.array(band.x), np.array(band.y))
    left, right = np.where(np.isnan(x), [-_FAR * width, _FAR * width], x)
    bottom, top = np.where(np.isnan(y), [_FAR * height, -_FAR * height], y)
    if left == right or top == bottom:
        return f'<path class="line as-{band.key}" d="M{left:.2f} {top:.2f}L{right:.2f} {bottom:.2f}"/>'
    return (
        f'<rect class="band as-{band.key}" x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" '
        f'height="{bottom - top:.2f}"/>'
    )


def _region(plot: Plot, region: Region) -> str:
    shapes = "".join(_path(*position(plot, *outline.T), closed=True) for outline in region.outlines)
    if region.value is not None:
        key, opacity = shade(region, plot)
        return f'<path class="region valued as-{key}" style="--opacity:{opacity:.3f}" d="{shapes}"/>'
    number = f' data-number="{region.number}"' if region.number else ""
    return f'<path class="region as-{region.key}"{number} d="{shapes}"/>'


def _mark(plot: Plot, at: Array, inside: str, role: str = "") -> str:
    """Return what keeps its size at a point of the axes: a number, a text."""
    x, y = (float(v) for v in position(plot, *at))
    left, top, _, _ = pane(plot)
    return (
        f'<g class="mark{role}" data-x="{x:.2f}" data-y="{y:.2f}" '
        f'transform="translate({left + x:.2f} {top + y:.2f})">{inside}</g>'
    )


def _legend(plot: Plot) -> str:
    entries = [f"<strong>{html.escape(plot.heading)}</strong>"] if plot.heading else []
    lines = [one for one in plot.bands if one.x[0] == one.x[1] or one.y[0] == one.y[1]]
    kinds = [(one.key, one.label, "stroke" if one in lines else "swatch") for one in plot.bands]
    kinds += [(one.key, one.label, "swatch") for one in plot.regions if not one.number]
    kinds += [(one.key, one.label, "stroke" if one.mark == "line" else "spot") for one in plot.series]
    entries += [
        f'<button type="button" class="key as-{key}" data-key="as-{key}" aria-pressed="true">'
        f'<i class="{kind}"></i>{html.escape(label)}</button>'
        for key, label, kind in dict.fromkeys(kinds)
        if label
    ]
    if not (plot.x_names or plot.y_names):
        entries.append(
            '<span class="zoom"><button type="button" data-zoom="in" title="zoom in">+</button>'
            '<button type="button" data-zoom="out" title="zoom out">\N{MINUS SIGN}</button>'
            '<button type="button" data-zoom="all" title="show all (double click)">all</button></span>'
        )
    links = "".join(
        f'<li><button type="button" class="place as-{region.key}" data-number="{region.number}" '
        f'title="{html.escape(region.label)}"><b>{region.number}</b>'
        f"{'' if plot.numbers_only else f' {html.escape(region.label)}'}</button></li>"
        for region in plot.regions
        if region.number
    )
    places = f'<ol class="places{" brief" if plot.numbers_only else ""}">{links}</ol>' if links else ""
    return f'<figcaption><div class="keys">{"".join(entries)}</div>{places}</figcaption>'
