"""A document -> the terminal: tables with rules, or plain aligned columns where no person reads.

Colour only repeats what the words say; piped output has no colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Literal

import rich.table
from rich import box
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.padding import Padding
from rich.text import Text

from bushcli.report.document import Document, Paragraph, Section, Table, on

_INDENT = (0, 0, 0, 2)
_STYLES = {"good": "bold green", "bad": "bold red", "plain": "bold"}


@dataclass(frozen=True)
class DrawnTable:
    """A table on a console: with rules on a terminal, as plain aligned columns elsewhere."""

    table: Table

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draw the table for the given console."""
        # The title is printed separately: as title of the table it would be wrapped at the width of a narrow table.
        if self.table.title:
            yield Text(self.table.title, "bold")
        table = rich.table.Table(
            box=box.SIMPLE_HEAD if console.is_terminal else None,
            pad_edge=False,
            padding=(0, 2, 0, 0),
            header_style="bold",
            show_header=any(self.table.heads),
        )
        for i, head in enumerate(self.table.heads):
            justify: Literal["left", "right"] = "left" if i < self.table.left else "right"
            # A name or a number that is cut short would say something else.
            table.add_column(Text(head), justify=justify, overflow="fold")
        for row in self.table.rows:
            # As Text, because a name in square brackets must not act as mark-up.
            table.add_row(*(Text(cell) for cell in row))
        yield table


def terminal_text(document: Document) -> Group:
    """Return a document for the terminal: what is written on the page only is left out."""
    verdict: list[RenderableType] = []
    if document.headline:
        verdict = [Text(f"{document.headline}.", _STYLES[document.tone])]
        verdict += [Padding(Text(line), _INDENT) for line in document.lines]
    above = [document.warning] if document.warning else []
    groups = [group for section in on("terminal", [*above, *document.sections]) for group in _groups(section)]
    groups = [*groups, verdict] if document.ends_with_verdict else [verdict, *groups]
    for problem in document.problems:
        what = Text.assemble(("problem ", "bold yellow"), (problem.name, "bold"), f": {problem.message}")
        groups.append([what, Padding(Text(f"remedy: {problem.remedy}"), _INDENT)])
    # An empty line before each group but the first.
    lines = list(chain.from_iterable([Text(), *group] for group in groups if group))
    return Group(*lines[1:])


def _groups(section: Section) -> list[Sequence[RenderableType]]:
    """Return what belongs together without an empty line between: text under its heading, a table with its notes."""
    first_block = section.blocks[0]
    # A table has a title of its own, and a note follows what is above it.
    has_own = isinstance(first_block, Paragraph) and first_block.kind == "note"
    if isinstance(first_block, Table):
        has_own = bool(first_block.title)
    has_heading = bool(section.heading) and not has_own
    groups: list[list[RenderableType]] = [[Text(section.heading, "bold")] if has_heading else []]
    for block in section.blocks:
        if isinstance(block, Table):
            table = block.without_detail()
            groups += [[]] if block is not first_block else []
            groups[-1].append(DrawnTable(table if block.most is None else table.without_middle(block.most)))
        elif isinstance(block, Paragraph):
            line = Text(block.text, "dim" if block.kind == "note" else "")
            groups[-1].append(Padding(line, _INDENT) if has_heading and block.kind == "plain" else line)
    return list(groups)
