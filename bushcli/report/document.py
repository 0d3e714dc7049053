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
    """A curve or a set of points; NaN interrupts a line."""

    key: str  # its role, from which the drawing takes colour and width: a key of `drawing.looks.LOOKS`
    label: str  # in the legend, where it can be switched off; empty for none
    x: NDArray[np.floating[Any]]
    y: NDArray[np.floating[Any]]
    mark: Literal["line", "dots", "both", "crosses"] = "line"
    error: NDArray[np.floating[Any]] | None = None  # half lengths of vertical error bars


@dataclass(frozen=True)
class Region:
    """A filled area: a place to which the user can zoom by its number, a band along a curve, a bar."""

    key: str
    label: str  # the sentence that describes a numbered place; otherwise the entry of the legend
    outlines: Sequence[Array]  # polygons (n, 2)
    number: int = 0  # from 1; 0 for an area without number
    at: Array | None = None  # places (k, 2) where the number may stand, the best first
    value: float | None = None  # shown as a colour of the plot's scale


@dataclass(frozen=True)
class Stripe:
    """A rectangle behind everything else; a line, where its two ends are equal. NaN means the edge of the plot."""

    key: str
    x: tuple[float, float] = (math.nan, math.nan)
    y: tuple[float, float] = (math.nan, math.nan)
    label: str = ""

    @property
    def is_line(self) -> bool:
        """Whether two ends are equal."""
        return self.x[0] == self.x[1] or self.y[0] == self.y[1]


@dataclass(frozen=True)
class Note:
    """A text in a plot that ends, begins or has its middle at a point on the axes."""

    text: str
    at: tuple[float, float]
    place: Literal["left", "right", "middle"] = "right"


@dataclass(frozen=True)
class Plot:
    """A plot that can be zoomed on the page and saved as a picture: axes, curves and marked places."""

    name: str  # unique in its panels
    labels: tuple[str, str]  # of the axes
    series: Sequence[Series] = ()  # later series are drawn on top
    regions: Sequence[Region] = ()
    bands: Sequence[Stripe] = ()
    notes: Sequence[Note] = ()
    x: tuple[float, float] | None = None  # range that is shown at first; None: of everything drawn
    y: tuple[float, float] | None = None
    heading: str = ""
    height: float = 280.0  # in the units of a page that is 900 wide
    width: float = 900.0
    numbers_only: bool = False  # the regions are described elsewhere: the legend has their numbers only
    log: Literal["", "x", "y"] = ""  # the axis that is logarithmic
    x_names: Sequence[tuple[float, str]] = ()  # names instead of numbers at an axis
    y_names: Sequence[tuple[float, str]] = ()
    scale: tuple[float, str] | None = None  # end of the symmetric colours of values; what these mean
    is_prepared: bool = False  # curves are thinned, limits and places of numbers found

    @property
    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges of x and y of a prepared plot."""
        assert self.x is not None
        assert self.y is not None
        return self.x, self.y


@dataclass(frozen=True)
class Panels:
    """Plots that belong together: one picture in the folder of results, one figure of the page."""

    name: str  # of its files
    kind: str  # kind of picture, by which a view chooses its place
    title: str
    rows: Sequence[Sequence[Plot]]  # plots beside each other, row by row
    channel: str = ""  # empty for all channels
    note: str = ""  # small print below the plots
    still: bool = False  # the page shows the picture, because the plots are too small to be zoomed


@dataclass(frozen=True)
class Picture:
    """A drawn figure, on the page only; `panels` are the plots of which it was drawn, which the page makes zoomable."""

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
    """A paragraph, or a line of a list; a note is in small print on the page, and dim on a terminal."""

    text: str
    kind: Literal["plain", "note"] = "plain"
    on: On = "both"

    @property
    def explains(self) -> bool:
        """Whether it explains on the page what stands beside it."""
        return self.kind == "note" and self.on == "page"


@dataclass(frozen=True)
class Table:
    """A table."""

    title: str  # empty if its section's heading describes it
    heads: Row
    rows: tuple[Row, ...]
    left: int = 1  # number of columns, from the left, that are words; the others are numbers, aligned right
    on: On = "both"
    detail: Sequence[int] = ()  # columns, counted from 0, that are on the page only
    most: int | None = None  # largest number of rows on the terminal, for tables that may be long

    def without_detail(self) -> Table:
        """Return the table without the columns that are on the page only."""
        return replace(self._without(self.detail), detail=())

    def without_empty(self, *heads: str) -> Table:
        """Return the table without those of the columns with these heads that say nothing in any row."""
        says = [any(row[i] not in ("", "-") for row in self.rows) for i in range(len(self.heads))]
        return self._without([i for i, head in enumerate(self.heads) if head in heads and not says[i]])

    def _without(self, omitted: Sequence[int]) -> Table:
        columns = [i for i in range(len(self.heads)) if i not in omitted]
        rows = tuple(tuple(row[i] for i in columns) for row in self.rows)
        left = sum(i < self.left for i in columns)
        return replace(self, heads=tuple(self.heads[i] for i in columns), rows=rows, left=left)

    def without_middle(self, most: int) -> Table:
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
    return Table(title, heads, tuple(tuple(cell(item) for cell in cells) for item in items), left, most=most)


@dataclass(frozen=True)
class Figures:
    """A place on the page for the pictures of some kinds, kind by kind; of one channel, or of all if it is empty."""

    kinds: tuple[str, ...]
    channel: str = ""
    on: Literal["page"] = field(default="page", init=False)

    def among(self, pictures: Sequence[Picture]) -> list[Block]:
        """Return the pictures that stand here."""
        candidates = [picture for picture in pictures if self.channel in ("", picture.channel)]
        return [picture for kind in self.kinds for picture in candidates if picture.kind == kind]


Block = Paragraph | Table | Figures | Picture


@dataclass(frozen=True)
class Section:
    """A part of a document; one without blocks, or with explanations of the page alone, is left out."""

    heading: str  # on a terminal it is written above text, and above a table that has no title
    blocks: Sequence[Block]
    on: On = "both"
    fold: str = ""  # label to be clicked on the page to unfold what is in `folded`, at the end of the section
    folded: Sequence[Block] = ()


@dataclass(frozen=True)
class Document:
    """What is told of a result: the verdict, its sections, its problems."""

    headline: str  # the verdict in one sentence, without its full stop; empty for a result without a verdict
    lines: Sequence[str]  # sentences below it
    tone: Tone
    sections: Sequence[Section]
    problems: Sequence[Condition] = ()
    conditions: Sequence[tuple[str, str]] = ()  # what was simulated, in names and values, for the page
    warning: Section | None = None  # above everything else
    ends_with_verdict: bool = False  # on a terminal, where the last lines are seen first

    def with_pictures(self, pictures: Sequence[Picture]) -> Document:
        """Return the document with pictures in the places for them."""

        def expand(blocks: Iterable[Block]) -> list[Block]:
            groups = (block.among(pictures) if isinstance(block, Figures) else [block] for block in blocks)
            return [block for group in groups for block in group]

        sections = [
            replace(section, blocks=expand(section.blocks), folded=expand(section.folded))
            for section in self.sections
        ]
        return replace(self, sections=sections)


def on(medium: Literal["page", "terminal"], sections: Iterable[Section]) -> list[Section]:
    """Return the sections with the blocks that are written there; empty ones are left out."""

    def visible(blocks: Iterable[Block]) -> list[Block]:
        filled = (block for block in blocks if not isinstance(block, Table) or block.rows)
        shown = [block for block in filled if block.on in ("both", medium)]
        return shown if any(not (isinstance(block, Paragraph) and block.explains) for block in shown) else []

    unfolds = medium == "page"
    filtered = [
        replace(section, blocks=visible(section.blocks), folded=visible(section.folded) if unfolds else ())
        for section in sections
        if section.on in ("both", medium)
    ]
    return [section for section in filtered if section.blocks or section.folded]


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
