"""A result as a document: values without colours, HTML or Matplotlib, which the views make and the writers write.

One view of a result serves both the terminal and the page. Every block says on which of them it is; a table says which
of its columns and rows are left out on the terminal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.runtime.condition import Condition

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
    kind : {"plain", "note"}
        A note is in small print on the page, and dim on a terminal.
    on : {"both", "page", "terminal"}
    """

    text: str
    kind: Literal["plain", "note"] = "plain"
    on: On = "both"


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    title : str
        Empty for a table that its section's heading describes.
    heads : tuple of str
    rows : tuple of rows
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


Block = Paragraph | Table | Picture


@dataclass(frozen=True)
class Section:
    """A part of a document; one without blocks is left out.

    Attributes
    ----------
    heading : str
        On a terminal it is written above text, and above a table that has no title.
    blocks : sequence of blocks
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
    sections : sequence of Section
    problems : sequence of Condition
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


def on(where: Literal["page", "terminal"], sections: Iterable[Section]) -> list[Section]:
    """Return the sections with the blocks that are written there; empty ones are left out.

    Parameters
    ----------
    where : {"page", "terminal"}
    sections : iterable of Section
    """
    found = []
    for section in sections:
        if section.on not in ("both", where):
            continue
        blocks = [block for block in section.blocks if _is_on(where, block)]
        folded = section.folded if where == "page" else ()
        if blocks or folded:
            found.append(replace(section, blocks=blocks, folded=folded))
    return found


def _is_on(where: str, block: Block) -> bool:
    if isinstance(block, Table) and not block.rows:
        return False
    return where == "page" if isinstance(block, Picture) else block.on in ("both", where)


def paragraphs(
    lines: Iterable[str], on: On = "both", kind: Literal["plain", "note"] = "plain"
) -> list[Block]:
    """Return a paragraph for each line that is not empty.

    Parameters
    ----------
    lines : iterable of str
    on : {"both", "page", "terminal"}
    kind : {"plain", "note"}
    """
    return [Paragraph(line, kind, on) for line in lines if line]


def of_kind(pictures: Iterable[Picture], *kinds: str) -> list[Block]:
    """Return the pictures of these kinds, kind by kind.

    Parameters
    ----------
    pictures : iterable of Picture
    *kinds : str
    """
    known = list(pictures)
    return [one for kind in kinds for one in known if one.kind == kind]
