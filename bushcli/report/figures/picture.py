"""The style of pictures, and saving figures as PNG and SVG.

Figures are made with Matplotlib's objects only: no window, no global state that another caller could disturb.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from bushcli.report.document import Picture as Picture

# Okabe and Ito's palette, distinguishable with any colour vision: https://jfly.uni-koeln.de/color/
BLACK, BLUE, ORANGE, GREEN, RED = "#1a1a1a", "#0072B2", "#E69F00", "#009E73", "#D55E00"
GREY, LIGHT, METAL = "#5f6670", "#e3e6ea", "#b9c0c8"

_DPI = 160
_STYLE: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.titlesize": 12,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 10,
    "axes.labelsize": 10.5,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#d5d9de",
    "grid.linewidth": 0.5,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": BLACK,
    "ytick.labelcolor": BLACK,
    "text.color": BLACK,
    "axes.labelcolor": BLACK,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "legend.framealpha": 0.85,
    "legend.edgecolor": "white",
    "legend.fancybox": False,
    "legend.fontsize": 9.5,
    # The same input gives the same file, byte for byte.
    "svg.hashsalt": "bushcli",
}


def style() -> AbstractContextManager[None]:
    """Return a context in which Matplotlib draws in the style of bushcli."""
    return mpl.rc_context(dict(_STYLE))


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure.

    Parameters
    ----------
    width : float
        Width in inches; the unit of Matplotlib.
    height : float
        Height in inches; the unit of Matplotlib.
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def literal(text: str) -> str:
    """Return text that is drawn literally: a dollar sign in a user's title does not start a formula."""
    return text.replace("$", r"\$")


def log_ticks(axis: Axis, low: float, high: float) -> None:
    """Label a logarithmic axis with plain numbers, more densely if it spans less than a factor of 50.

    Parameters
    ----------
    axis : Axis
        The axis to label.
    low : float
        Lower end, more than 0, in the unit of the axis.
    high : float
        Upper end, in the unit of the axis.
    """
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 50 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def legend(axes: Axes, **options: Any) -> None:
    """Add a legend to axes that have labelled lines.

    Parameters
    ----------
    axes : Axes
        The axes.
    **options : object
        Passed on to `Axes.legend`.
    """
    if axes.get_legend_handles_labels()[0]:
        axes.legend(**options)


def picture(name: str, kind: str, title: str, figure: Figure, channel: str = "") -> Picture:
    """Save a figure as PNG and SVG in memory.

    Parameters
    ----------
    name : str
        File name without its suffix.
    kind : str
        Kind of picture, by which a page groups pictures.
    title : str
        Title in words, for the page.
    figure : Figure
        The drawn figure; its layout is fixed afterwards.
    channel : str
        Channel that the picture shows; empty for a picture of all channels.
    """
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
    return Picture(name, kind, title, channel, files["png"], files["svg"])
