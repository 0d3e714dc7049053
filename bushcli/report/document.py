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
class Band:
    """A rectangle behind everything else.

    Attributes
    ----------
    key : str
        Class in the style sheet: "noise", "faulty".
    x, y : (float, float)
        NaN means the edge of the plot.
    """

    key: str
    x: tuple[float, float] = (math.nan, math.nan)
    y: tuple[float, float] = (math.nan, math.nan)


@dataclass(frozen=True)
class Plot:
    """A plot that can be zoomed on the page and saved as a picture: axes, lines and marked places.

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
    bands : sequence of Band
    height : float
        In the units of a page that is 900 wide.
    numbers_only : bool
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
    bands: Sequence[Band] = ()
    height: float = 430.0
    numbers_only: bool = False
    heading: str = ""


@dataclass(frozen=True)
class Picture:
    """A drawn figure, on the page only.

    Attributes
    ----------
    name : str
        Name of its files.
    kind : str
        Kind of picture, by which a view chooses its place.
    title : str
        Contents in words.
    channel : str
        The channel that it belongs to; empty for a picture of all channels.
    png, svg : bytes
    """

    name: str
    kind: str
    title: str
    channel: str
    png: bytes = field(repr=False)
    svg: bytes = field(repr=False)


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
