"""The style of pictures, plots and bodies drawn with Matplotlib, and saving figures as PNG and SVG.

Figures are made with Matplotlib's objects only: no window, no global state that another caller could disturb.
"""

from __future__ import annotations

import io
import math
import textwrap
import warnings
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter, NullLocator

from bushcli.report.document import Array, Panels, Picture, Plot
from bushcli.report.drawing.looks import DIVERGING, GREY, INK, LOOKS
from bushcli.report.drawing.preparation import prepare, shade, tick, ticks
from bushcli.report.drawing.projection import Layer, Projection

_DPI = 160
# Units of a page per inch of a picture: a plot as wide as the page is 7.6 inches wide.
_PER_INCH = 118.0
_STYLE: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.titlesize": 12,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 10,
    "axes.labelsize": 10.5,
    "axes.edgecolor": GREY[0],
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#d5d9de",
    "grid.linewidth": 0.5,
    "xtick.color": GREY[0],
    "ytick.color": GREY[0],
    "xtick.labelcolor": INK[0],
    "ytick.labelcolor": INK[0],
    "text.color": INK[0],
    "axes.labelcolor": INK[0],
    "lines.solid_capstyle": "round",
    # The same input gives the same file, byte for byte.
    "svg.hashsalt": "bushcli",
}


def style() -> AbstractContextManager[None]:
    """Return a context in which Matplotlib draws in the style of bushcli."""
    return mpl.rc_context(dict(_STYLE))


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure; width and height in inches, the unit of Matplotlib."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def section_axes(axes: Axes, labels: tuple[str, str]) -> None:
    """Draw the axis of revolution of a section in true scale."""
    axes.set_aspect("equal")
    axes.axvline(0.0, color=GREY[0], lw=0.9, ls=(0, (10, 3, 2, 3)))
    axes.set(xlabel=labels[0], ylabel=labels[1])
    axes.grid(visible=False)


def body_axes(low: Array, high: Array, longest: float, room: tuple[float, float]) -> tuple[Figure, Axes]:
    """Return a figure with axes in true scale between two corners in mm.

    Its longer side is this long in inches, without the room beside and above it for numbers, titles and a colour bar.
    """
    width, height = longest * (high - low) / (high - low).max()
    figure = new_figure(max(width + room[0], 4.6), height + room[1])
    axes = figure.add_subplot(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return figure, axes


def paint(axes: Axes, view: Projection, layers: Sequence[Layer], *, rasterized: bool = True) -> None:
    """Draw layers of polygons as a view shows them, distant polygons first."""
    polygons, fill, ink, depth = (np.concatenate([layer[i] for layer in layers]) for i in range(4))
    width = np.concatenate([np.full(len(layer.depth), layer.width) for layer in layers])
    order = np.argsort(depth, kind="stable")
    axes.add_collection(
        PolyCollection(
            # An array is converted three times as fast as a list.
            view.project(polygons[order]),  # type: ignore[arg-type]  # Matplotlib's stubs know lists only
            facecolors=fill[order],
            edgecolors=ink[order],
            linewidths=width[order],
            joinstyle="round",
            rasterized=rasterized,
        )
    )


def directions(axes: Axes, view: Projection, origin: Array, length: float) -> None:
    """Draw arrows of this length in mm along x, y and z."""
    arrow = {"arrowstyle": "<|-", "color": GREY[0], "lw": 1.1}
    for name, along in zip("xyz", view.project(np.eye(3)), strict=True):
        axes.annotate(
            name, tuple(origin), tuple(origin + length * along), ha="center", va="center", fontsize=9,
            color=GREY[0], arrowprops=arrow,
        )  # fmt: skip


def colour_bar(figure: Figure, axes: Any, mappable: ScalarMappable, label: str, **where: Any) -> Colorbar:
    """Draw the scale of colours that show values."""
    bar = figure.colorbar(mappable, ax=axes, **where)
    bar.set_label(label, fontsize=9)
    bar.outline.set_visible(False)  # type: ignore[operator]
    return bar


def literal(text: str) -> str:
    """Return text that is drawn literally: a dollar sign in a user's title does not start a formula."""
    return text.replace("$", r"\$")


def wrap(text: str, width: float, size: float) -> str:
    """Return text in lines that fit into this width in inches in a font of this size in points."""
    return literal("\n".join(textwrap.wrap(text, max(20, int(width * 72 / (0.62 * size))))))


def draw_panels(panels: Panels) -> Picture:
    """Draw plots that belong together as one picture, row by row."""
    panels = replace(panels, rows=[[prepare(plot) for plot in row] for row in panels.rows])
    width = max(sum(plot.width for plot in row) for row in panels.rows) / _PER_INCH
    heights = [max(plot.height for plot in row) / _PER_INCH for row in panels.rows]
    with style():
        figure = new_figure(max(width, 4.6), sum(heights) + 0.35 * len(heights) + 0.4)
        # All axes in one grid, which aligns them.
        across = math.lcm(*(len(row) for row in panels.rows))
        grid = figure.add_gridspec(len(heights), across, height_ratios=heights)
        axes = []
        for i, row in enumerate(panels.rows):
            step = across // len(row)
            for j, plot in enumerate(row):
                axes.append(figure.add_subplot(grid[i, j * step : (j + 1) * step]))
                draw(axes[-1], plot)
        if scale := panels.rows[0][0].scale:
            mappable = ScalarMappable(Normalize(-scale[0], scale[0]), DIVERGING)
            colour_bar(figure, axes, mappable, wrap(scale[1], 0.9 * sum(heights), 9), pad=0.015)
        figure.suptitle(
            wrap(panels.title, figure.get_figwidth(), 12), fontsize=12, fontweight="bold", x=0.01, ha="left"
        )
        if panels.note:
            note = wrap(panels.note, figure.get_figwidth(), 8.5)
            figure.supxlabel(note, fontsize=8.5, color=GREY[0], x=0.01, ha="left")
    return picture(panels.name, panels.kind, panels.title, figure, panels.channel, panels)


def draw(axes: Axes, plot: Plot) -> None:
    """Draw a prepared plot into axes."""
    handles: dict[str, Any] = {}
    axes.set(xlim=plot.limits[0], ylim=plot.limits[1])
    axes.set(xlabel=literal(plot.labels[0]), ylabel=literal(plot.labels[1]))
    _axis(axes, plot, "x")
    _axis(axes, plot, "y")
    for band in plot.bands:
        look, zorder = LOOKS[band.key], 0.1 + 0.9 * band.is_line
        for ends, line, span in ((band.x, axes.axvline, axes.axvspan), (band.y, axes.axhline, axes.axhspan)):
            if np.isnan(ends).all():
                continue
            options: dict[str, Any] = {"color": look.colours[0], "zorder": zorder}
            if ends[0] == ends[1]:
                artist: Any = line(ends[0], lw=look.width, ls=_dash(band.key), **options)
            else:
                low, high = np.where(np.isnan(ends), axes.get_xlim(), ends)
                artist = span(low, high, alpha=look.opacity, lw=0, **options)
            handles.setdefault(band.label, artist)
    for region in plot.regions:
        key, opacity = shade(region, plot)
        fill = to_rgba(LOOKS[key].colours[0], opacity)
        if region.outlines:
            outline = Path.make_compound_path(*(Path(points, closed=False) for points in region.outlines))
            edge = "#d5d9de" if region.value is not None else "none"
            axes.add_patch(PathPatch(outline, fc=fill, ec=edge, lw=0.6, zorder=1.2))
        if region.number and region.at is not None:
            badge = {"boxstyle": "circle,pad=0.22", "fc": LOOKS[key].colours[0], "ec": "white"}
            axes.annotate(
                str(region.number), region.at[0], ha="center", va="center", fontsize=8.5, fontweight="bold",
                color="white", zorder=5, bbox=badge,
            )  # fmt: skip
        else:
            handles.setdefault(region.label, Patch(color=fill))
    for i, series in enumerate(plot.series):
        look, is_line = LOOKS[series.key], series.mark in ("line", "both")
        (artist,) = axes.plot(
            series.x, series.y, color=look.colours[0], lw=look.width, ls=_dash(series.key) if is_line else "none",
            marker={"line": "", "dots": "o", "both": "o", "crosses": "x"}[series.mark],
            ms=max(3.0, 1.6 * look.width) if series.mark != "crosses" else 5.5, zorder=2 + 0.1 * i,
        )  # fmt: skip
        if series.error is not None and series.error.any():
            bars: dict[str, Any] = {"fmt": "none", "ecolor": GREY[0], "elinewidth": 1.1, "capsize": 2.5}
            axes.errorbar(series.x, series.y, series.error, zorder=2.05 + 0.1 * i, **bars)
        handles.setdefault(series.label, artist)
    for note in plot.notes:
        side = {"left": ("right", -5), "right": ("left", 5), "middle": ("center", 0)}[note.place]
        axes.annotate(
            literal(note.text), note.at, (side[1], 0), textcoords="offset points", ha=side[0], va="center",
            fontsize=9, zorder=4,
        )  # fmt: skip
    handles.pop("", None)
    _head(axes, plot, handles)


def _dash(key: str) -> Any:
    look = LOOKS[key]
    return (0, tuple(v / look.width for v in look.dash)) if look.dash else "-"


def _axis(axes: Axes, plot: Plot, name: Literal["x", "y"]) -> None:
    """Put the numbers or names of the page at an axis."""
    axis = axes.xaxis if name == "x" else axes.yaxis
    if names := plot.x_names if name == "x" else plot.y_names:
        axis.set_major_locator(FixedLocator([at for at, _ in names]))
        axis.set_major_formatter(FixedFormatter([literal(text) for _, text in names]))
        axes.grid(visible=False, axis=name)
        axes.tick_params(axis=name, length=0)
        return
    if plot.log == name:
        axes.set(**{f"{name}scale": "log"})
        axis.set_minor_locator(NullLocator())
    most = plot.width / 75 if name == "x" else (plot.height - 58) / 40
    numbers = ticks(*plot.limits["xy".index(name)], max(4, round(most)), plot.log == name)
    axis.set_major_locator(FixedLocator(numbers))
    axis.set_major_formatter(FuncFormatter(lambda value, _: tick(value)))


def _head(axes: Axes, plot: Plot, handles: Mapping[str, Any]) -> None:
    """Put heading and legend above the plot, where they hide no curve."""
    width = plot.width / _PER_INCH
    longest = max(map(len, handles), default=1)
    columns = max(1, min(len(handles), int(13.0 * (width - 0.6) / (longest + 5))))
    if handles:
        axes.legend(
            handles.values(), [literal(label) for label in handles], loc="lower left", bbox_to_anchor=(0.0, 1.0),
            ncols=columns, frameon=False, fontsize=9, borderaxespad=0.1, borderpad=0.1, handlelength=1.6,
            columnspacing=1.2, labelspacing=0.3,
        )  # fmt: skip
    if plot.heading:
        heading = wrap(plot.heading, width - 0.6, 9.5)
        axes.set_title(heading, fontsize=9.5, fontweight="normal", pad=5 + 14.5 * -(-len(handles) // columns))


def picture(
    name: str, kind: str, title: str, figure: Figure, channel: str = "", panels: Panels | None = None
) -> Picture:
    """Save a figure as PNG and SVG in memory; its layout is fixed afterwards. The words are those of `Panels`."""
    files: dict[str, bytes] = {}
    with style(), warnings.catch_warnings():
        # A character that the font lacks is drawn as a box; the user need not be warned.
        warnings.filterwarnings("ignore", message=r"Glyph .* missing from font")
        for form, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
            buffer = io.BytesIO()
            figure.savefig(buffer, format=form, dpi=_DPI, facecolor="white", metadata=metadata)
            files[form] = buffer.getvalue()
            # The layout is made only once, because it takes as long as drawing.
            figure.set_layout_engine("none")
    return Picture(name, kind, title, channel, files["png"], files["svg"], panels)
