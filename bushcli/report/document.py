"""A result as a document: values without colours, HTML or Matplotlib, which the views make and the writers write.

One view of a result serves both the terminal and the page. Every block says on which of them it is; a table says which
of its columns and rows are left out on the terminal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from bushcli.runtime.condition import Condition

Array = NDArray[np.float64]
Row = tuple[str, ...]
_Item = TypeVar("_Item")
Columns: TypeAlias = Iterable[tuple[str, Callable[[_Item], str]]]
"""Columns of a table: the head of each, and what it shows of an item."""
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
    x: NDArray[np.floating[Any]]
    y: NDArray[np.floating[Any]]
    mark: Literal["line", "dots", "both", "crosses"] = "line"
    error: NDArray[np.floating[Any]] | None = None


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
class Stripe:
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
        Unique in its panels.
    labels : (str, str)
        Of the axes.
    series : sequence of Series
        Later series are drawn on top.
    x, y : (float, float), optional
        Range that is shown at first; by default that of everything drawn.
    heading : str
        Text above the plot.
    height, width : float
        In the units of a page that is 900 wide.
    numbers_only : bool
        Whether the regions are described elsewhere on the page, so that the legend has their numbers only.
    log : {"", "x", "y"}
        The axis that is logarithmic.
    x_names, y_names : sequence of (float, str)
        Names instead of numbers at an axis.
    scale : (float, str), optional
        End of the symmetric colour scale of the regions' values, and what it shows.
    is_prepared : bool
        Whether it is ready to be drawn: curves thinned, limits and places of numbers found.
    """

    name: str
    labels: tuple[str, str]
    series: Sequence[Series] = ()
    regions: Sequence[Region] = ()
    bands: Sequence[Stripe] = ()
    notes: Sequence[Note] = ()
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None
    heading: str = ""
    height: float = 280.0
    width: float = 900.0
    numbers_only: bool = False
    log: Literal["", "x", "y"] = ""
    x_names: Sequence[tuple[float, str]] = ()
    y_names: Sequence[tuple[float, str]] = ()
    scale: tuple[float, str] | None = None
    is_prepared: bool = False


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
    on: Literal["page"] = field(default="page", init=False)


@dataclass(frozen=True)
class Paragraph:
    """A paragraph, or a line of a list.

    Attributes
    ----------
    kind : {"plain", "note"}
        A note is in small print on the page, and dim on a terminal.
    on : {"both", "page", "terminal"}
    """

    text: str
    kind: Literal["plain", "note"] = "plain"
    on: On = "both"

    @property
    def explains(self) -> bool:
        """Whether it explains on the page what stands beside it."""
        return self.kind == "note" and self.on == "page"


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    title : str
        Empty for a table that its section's heading describes.
    left : int
        Number of columns, from the left, that are words; the others are numbers and aligned right.
    on : {"both", "page", "terminal"}
    detail : collection of int
        Columns, counted from 0, that are on the page only.
    most : int or None
        Largest number of rows on the terminal, for tables that may be long; None for all.
    """

    title: str
    heads: Row
    rows: tuple[Row, ...]
    left: int = 1
    on: On = "both"
    detail: Sequence[int] = ()
    most: int | None = None

    def without_detail(self) -> Table:
        """Return the table without the columns that are on the page only."""
        kept = [i for i in range(len(self.heads)) if i not in self.detail]
        rows = tuple(tuple(row[i] for i in kept) for row in self.rows)
        left = sum(i < self.left for i in kept)
        return replace(self, heads=tuple(self.heads[i] for i in kept), rows=rows, left=left, detail=())

    def shortened(self, most: int) -> Table:
        """Return the table without its middle rows if it has more than `most`; its title then says how many it has."""
        if len(self.rows) <= most:
            return self
        tail = most // 4
        gap = ("...", *("" for _ in self.heads[1:]))
        rows = (*self.rows[: most - tail - 1], gap, *self.rows[len(self.rows) - tail :])
        return replace(self, title=f"{self.title} ({len(self.rows)} in all)", rows=rows)


def table_of(
    title: str, items: Iterable[_Item], columns: Columns[_Item], left: int = 1, most: int | None = None
) -> Table:
    """Return a table with a row for each item; a column is its head, and what it shows of an item."""
    heads, cells = zip(*columns, strict=True)
    return Table(title, heads, tuple(tuple(cell(one) for cell in cells) for one in items), left, most=most)


@dataclass(frozen=True)
class Figures:
    """A place on the page for the pictures of some kinds, kind by kind.

    Attributes
    ----------
    kinds : tuple of str
        As of `Panels`.
    channel : str
        The channel whose pictures stand here; empty for those of all channels.
    """

    kinds: tuple[str, ...]
    channel: str = ""
    on: Literal["page"] = field(default="page", init=False)

    def among(self, pictures: Sequence[Picture]) -> list[Block]:
        """Return the pictures that stand here."""
        own = [one for one in pictures if self.channel in ("", one.channel)]
        return [one for kind in self.kinds for one in own if one.kind == kind]


Block = Paragraph | Table | Figures | Picture


@dataclass(frozen=True)
class Section:
    """A part of a document; one without blocks, or with explanations of the page alone, is left out.

    Attributes
    ----------
    heading : str
        On a terminal it is written above text, and above a table that has no title.
    on : {"both", "page", "terminal"}
    fold : str
        Label to be clicked on the page to unfold what is in `folded`.
    folded : sequence of blocks
        At the end of the section, on the page only.
    """

    heading: str
    blocks: Sequence[Block]
    on: On = "both"
    fold: str = ""
    folded: Sequence[Block] = ()


@dataclass(frozen=True)
class Document:
    """What is told of a result: the verdict, its sections, its problems.

    Attributes
    ----------
    headline : str
        The verdict in one sentence, without its full stop; empty for a result without a verdict.
    lines : sequence of str
        Sentences below the headline.
    tone : {"good", "bad", "plain"}
    conditions : sequence of (str, str)
        What was simulated, in pairs of name and value, for the page.
    warning : Section or None
        Above everything else.
    ends_with_verdict : bool
        Whether the verdict follows the sections on a terminal, where the last lines are seen first.
    """

    headline: str
    lines: Sequence[str]
    tone: Tone
    sections: Sequence[Section]
    problems: Sequence[Condition] = ()
    conditions: Sequence[tuple[str, str]] = ()
    warning: Section | None = None
    ends_with_verdict: bool = False

    def illustrated(self, pictures: Sequence[Picture]) -> Document:
        """Return the document with pictures in the places for them."""

        def filled(blocks: Iterable[Block]) -> list[Block]:
            found = (one.among(pictures) if isinstance(one, Figures) else [one] for one in blocks)
            return [one for several in found for one in several]

        sections = [
            replace(one, blocks=filled(one.blocks), folded=filled(one.folded)) for one in self.sections
        ]
        return replace(self, sections=sections)


def on(where: Literal["page", "terminal"], sections: Iterable[Section]) -> list[Section]:
    """Return the sections with the blocks that are written there; empty ones are left out."""

    def kept(blocks: Iterable[Block]) -> list[Block]:
        here = [
            one
            for one in blocks
            if one.on in ("both", where) and not (isinstance(one, Table) and not one.rows)
        ]
        return here if any(not (isinstance(one, Paragraph) and one.explains) for one in here) else []

    found = [
        replace(one, blocks=kept(one.blocks), folded=kept(one.folded) if where == "page" else ())
        for one in sections
        if one.on in ("both", where)
    ]
    return [one for one in found if one.blocks or one.folded]


def paragraphs(
    lines: Iterable[str], on: On = "both", kind: Literal["plain", "note"] = "plain"
) -> list[Block]:
    """Return a paragraph for each line that is not empty."""
    return [Paragraph(line, kind, on) for line in lines if line]


def note(text: str) -> Paragraph:
    """Return an explanation in small print, for the page only."""
    return Paragraph(text, "note", "page")


def figures(*kinds: str, channel: str = "") -> Figures:
    """Return the place for the pictures of these kinds, of one channel or of all."""
    return Figures(kinds, channel)
