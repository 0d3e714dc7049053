"""A plot as SVG in the page itself, which `templates/zoom.js` makes zoomable; without a script it is a picture.

The data are in an inner <svg> whose viewBox is the visible part: zooming changes only that viewBox. Lines keep
their width (`vector-effect`); grid and labels are outside and are drawn again. Colours are classes of the style sheet,
so that they follow light, dark and print.
"""

from __future__ import annotations

import base64
from functools import cache
from importlib import resources
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from bushcli.report.document import Picture, Plot, Region, Series, Stripe
from bushcli.report.drawing.preparation import pane, position, prepare, shade, tick, ticks

Array = NDArray[np.floating[Any]]

# Widths or heights of the pane, further than a user can pan: there a band without end ends.
_FAR = 50.0


@cache
def templates() -> jinja2.Environment:
    """Return the templates of the page, which escape all text."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("bushcli.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@cache
def script() -> Markup:
    """Return the script of a page with plots, which contains no text that would end its element."""
    text = (resources.files("bushcli.report") / "templates" / "zoom.js").read_text(encoding="utf-8")
    assert "</" not in text
    return Markup(f"\n{text}")


def figure(picture: Picture, heading: str = "") -> Markup:
    """Return a picture as it stands on a page: zoomable where it was drawn from plots, otherwise as an image.

    Lines are embedded as SVG, which stays sharp, shaded bodies as PNG, which is smaller. A title that is the heading
    of its section is left out.
    """
    panels, image, rows = picture.panels, "", []
    scale: tuple[str, ...] = ()
    if panels is None or panels.still:
        is_body = picture.kind in ("mesh", "deformed")
        form, data = ("png", picture.png) if is_body else ("svg+xml", picture.svg)
        image = f"data:image/{form};base64,{base64.b64encode(data).decode()}"
    else:
        rows = [[svg(plot, f"{panels.name}-") for plot in row] for row in panels.rows]
        if colour_scale := panels.rows[0][0].scale:
            scale = (*(tick(float(f"{sign * colour_scale[0]:.3g}")) for sign in (-1, 1)), colour_scale[1])
    template = templates().get_template("figure.html")
    return Markup(template.render(picture=picture, heading=heading, image=image, scale=scale, rows=rows))


def svg(plot: Plot, prefix: str = "") -> Markup:
    """Return one plot with its legend; all text is escaped."""
    plot = prepare(plot)
    ends = zip(plot.limits, "xy", strict=True)
    keys = [(band.key, band.label, "stroke" if band.is_line else "swatch") for band in plot.bands]
    keys += [(region.key, region.label, "swatch") for region in plot.regions if not region.number]
    keys += [
        (series.key, series.label, "stroke" if series.mark == "line" else "spot") for series in plot.series
    ]
    grid, words = _grid(plot)
    shapes = [_band(plot, band) for band in plot.bands] + [_region(plot, region) for region in plot.regions]
    template = templates().get_template("plot.html")
    return Markup(
        template.render(
            plot=plot,
            prefix=prefix,
            fixed="x" * bool(plot.x_names) + "y" * bool(plot.y_names),
            title=plot.heading or " over ".join(reversed(plot.labels)),
            keys=[entry for entry in dict.fromkeys(keys) if entry[1]],
            places=[region for region in plot.regions if region.number],
            seen=[" ".join(f"{v:.9g}" for v in (np.log10(p) if plot.log == n else p)) for p, n in ends],
            grid=grid,
            words=words,
            shapes=map(Markup, [*shapes, *(_series(plot, series) for series in plot.series)]),
            marks=_marks(plot),
            pane=pane(plot),
        )
    )


def _grid(plot: Plot) -> tuple[list[tuple[float, ...]], list[tuple[str, float, float, str]]]:
    """Return lines (x1, x2, y1, y2, is zero) and words as `zoom.js` draws them, and names, which stay."""
    left, top, width, height = pane(plot)
    x, y = plot.limits
    lines: list[tuple[float, ...]] = []
    words = []
    for value, name in plot.x_names or [(v, "") for v in ticks(*x, round(plot.width / 75), plot.log == "x")]:
        at = left + float(position(plot, value, y[0])[0])
        lines += [] if plot.x_names else [(at, at, top, top + height, value == 0)]
        texts = (name or tick(value)).split("\n")
        words += [("x", at, top + height + 17 + 16 * i, text) for i, text in enumerate(texts)]
    most = max(4, round(height / 40))
    for value, name in plot.y_names or [(v, "") for v in ticks(*y, most, plot.log == "y")]:
        at = top + float(position(plot, x[0], value)[1])
        lines += [] if plot.y_names else [(left, left + width, at, at, value == 0)]
        # The lines of a name are centred about its place.
        texts = (name or tick(value)).split("\n")
        baseline = at + 4 - 8 * (len(texts) - 1)
        words += [("y", left - 7, baseline + 16 * i, text) for i, text in enumerate(texts)]
    return lines, words


def _marks(plot: Plot) -> list[tuple[float, float, Markup, str]]:
    """Return what keeps its size at a point of the axes: numbers of places and texts, with their roles."""
    number = Markup('<circle r="9"/><text y="4">{}</text>')
    marks = [
        (region.at[0], number.format(region.number), f" as-{region.key}")
        for region in plot.regions
        if region.number and region.at is not None
    ]
    for note in plot.notes:
        shift = {"left": -6, "right": 6, "middle": 0}[note.place]
        text = Markup('<text class="note-{}" x="{}" y="4">{}</text>').format(note.place, shift, note.text)
        marks.append((np.array(note.at), text, ""))
    return [(*map(float, position(plot, *at)), inside, role) for at, inside, role in marks]  # type: ignore[misc]


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
    finite = np.isfinite(x) & np.isfinite(y)
    paths = []
    if series.error is not None and series.error.any():
        ends = [position(plot, series.x, series.y + sign * series.error)[1][finite] for sign in (-1, 1)]
        bars = "".join(f"M{a:.2f} {b:.2f}V{c:.2f}" for a, b, c in zip(x[finite], *ends, strict=True))
        paths.append(f'<path class="error" d="{bars}"/>')
    if series.mark in ("line", "both"):
        paths.append(f'<path class="line as-{series.key}" d="{_path(x, y)}"/>')
    if series.mark != "line":
        # A line of zero length with round ends is a dot that keeps its size.
        dots = "".join(f"M{a:.2f} {b:.2f}h0" for a, b in zip(x[finite], y[finite], strict=True))
        role = "dots crosses" if series.mark == "crosses" else "dots"
        paths.append(f'<path class="{role} as-{series.key}" d="{dots}"/>')
    return "".join(paths)


def _band(plot: Plot, band: Stripe) -> str:
    _, _, width, height = pane(plot)
    x, y = position(plot, np.array(band.x), np.array(band.y))
    left, right = np.where(np.isnan(x), [-_FAR * width, _FAR * width], x)
    bottom, top = np.where(np.isnan(y), [_FAR * height, -_FAR * height], y)
    if band.is_line:
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
