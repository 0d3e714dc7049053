"""A result as a document: values without colours, HTML or Matplotlib, which the views make and the writers write.

One view of a result serves both the terminal and the page. Every block says on which of them it is; a table says which
of its columns and rows are left out on the terminal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Row = tuple[str, ...]
#: The writers that write a block.
On = Literal["both", "page", "terminal"]
#: Colour of a verdict.
Tone = Literal["good", "bad", "plain"]


@dataclass(frozen=True)
class Series:
    """A curve or a set of points.

    Attributes
    ----------
    key : str
        Its role, from which the drawing takes colour and width: a key of `drawing.looks.LOOKS`.
    label : str
        In the legend, where it can be switched off; empty for none.
    x, y : shape (n,)
        NaN interrupts the line.
    mark : {"line", "dots", "both", "crosses"}
    error : shape (n,), optional
        Half lengths of vertical error bars.
    """

    key: str
    label: str
    x: Array
    y: Array
    mark: Literal["line", "dots", "both", "crosses"] = "line"
    error: Array | None = None


@dataclass(frozen=True)
class Region:
    """A filled area: a place to which the user can zoom by its number, a band along a curve, a bar.

    Attributes
    ----------
    key : str
        Its role, as of a series.
    label : str
        The sentence that describes a numbered place; otherwise the entry of the legend.
    outlines : sequence of shape (n, 2)
        Polygons.
    number : int
        From 1; 0 for an area without number.
    at : shape (k, 2), optional
        Places where the number may stand, the best first.
    value : float, optional
        Value that is shown as a colour of the plot's scale.
    """

    key: str
    label: str
    outlines: Sequence[Array]
    number: int = 0
    at: Array | None = None
    value: float | None = None


@dataclass(frozen=True)
class Band:
    """A rectangle behind everything else; a line, where its two ends are equal.

    Attributes
    ----------
    key : str
        Its role, as of a series.
    x, y : (float, float)
        NaN means the edge of the plot.
    label : str
        In the legend; empty for none.
    """

    key: str
    x: tuple[float, float] = (math.nan, math.nan)
    y: tuple[float, float] = (math.nan, math.nan)
    label: str = ""


@dataclass(frozen=True)
class Note:
    """A text in a plot.

    Attributes
    ----------
    text : str
    at : (float, float)
        On the axes of the plot.
    place : {"left", "right", "middle"}
        Whether the text ends or begins at that point, or has its middle there.
    """

    text: str
    at: tuple[float, float]
    place: Literal["left", "right", "middle"] = "right"


@dataclass(frozen=True)
class Plot:
    """A plot that can be zoomed on the page and saved as a picture: axes, curves and marked places.

    Attributes
    ----------
    name : str
        Unique on the page.
    title, x_label, y_label : str
    x, y : (float, float), optional
        Range that is shown at first; by default that of everything drawn.
    series : sequence of Series
        Later series are drawn on top.
    regions, bands, notes : sequences
    height, width : float
        In the units of a page that is 900 wide.
    numbers_only : bool
        Whether the regions are described elsewhere on the page, so that the legend has their numbers only.
    heading : str
        Text above the plot.
    log : {"", "x", "y"}
        The axis that is logarithmic.
    x_names, y_names : sequence of (float, str)
        Names instead of numbers at an axis.
    scale : (float, str), optional
        End of the symmetric colour scale of the regions' values, and what it shows.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    series: Sequence[Series] = ()
    regions: Sequence[Region] = ()
    bands: Sequence[Band] = ()
    notes: Sequence[Note] = ()
    height: float = 430.0
    width: float = 900.0
    numbers_only: bool = False
    heading: str = ""
    log: Literal["", "x", "y"] = ""
    x_names: Sequence[tuple[float, str]] = ()
    y_names: Sequence[tuple[float, str]] = ()
    scale: tuple[float, str] | None = None


@dataclass(frozen=True)
class Panels:
    """Plots that belong together: one picture in the folder of results, one figure of the page.

    Attributes
    ----------
    name : str
        Name of its files.
    kind : str
        Kind of picture, by which a view chooses its place.
    title : str
        Contents in words.
    rows : sequence of sequences of Plot
        Plots beside each other, row by row.
    channel : str
        The channel that it belongs to; empty for all channels.
    note : str
        Small print below the plots.
    still : bool
        Whether the page shows the picture, because the plots are too small to be zoomed.
    """

    name: str
    kind: str
    title: str
    rows: Sequence[Sequence[Plot]]
    channel: str = ""
    note: str = ""
    still: bool = False


@dataclass(frozen=True)
class Picture:
    """A drawn figure, on the page only.

    Attributes
    ----------
    name, kind, title, channel : str
        As of `Panels`.
    png, svg : bytes
    panels : Panels, optional
        The plots of which it was drawn, which the page makes zoomable.
    """

    name: str
    kind: str
    title: str
    channel: str
    png: bytes = field(repr=False)
    svg: bytes = field(repr=False)
    panels: Panels | None = None


@dataclass(frozen=True)
class Paragraph:
    """A paragraph, or a line of a list.

    Attributes
    ----------
    text : str
    kind : {"plain", "note", "strong"}
        A note is in small print on the page, and dim on a terminal.
    on : {"both", "page", "terminal"}
    """

    text: str
    kind: Literal["plain", "note", "strong"] = "plain"
    on: On = "both"


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    title : str
    heads : tuple of str
    rows : tuple of rows
    left : int
        Number of columns, from the left, that are words; the others are numbers and aligned right.
    on : {"both", "page", "terminal"}
    detail : frozenset of int
        Columns that are on the page only.
    most : int or None
        Largest number of rows on the terminal; None for all.
    """

    title: str
    heads: Row
    rows: tuple[Row, ...]
    left: int = 1
    on: On = "both"
    detail: frozenset[int] = frozenset()
    most: int | None = None


Block = Paragraph | Table | Plot | Picture


@dataclass(frozen=True)
class Section:
    """A part of a document; without blocks it is left out.

    Attributes
    ----------
    heading : str
    blocks : sequence of blocks
    on : {"both", "page", "terminal"}
    fold : str
        Label to be clicked on the page to unfold the blocks in `folded`.
    folded : sequence of blocks
        On the page only, at the end of the section, folded at first.
    """

    heading: str
    blocks: Sequence[Block]
    on: On = "both"
    fold: str = ""
    folded: Sequence[Block] = ()
