"""Which part of a document the terminal has, and which the page."""

import io
import re

import pytest
from rich.console import Console

from bushcli.report.document import Document, Paragraph, Section, Table, note, on
from bushcli.report.writers.page import page
from bushcli.report.writers.terminal import terminal_text
from bushcli.runtime.condition import Condition

RESULT = {
    "command": "direct",
    "case": {"title": "a bushing", "path": "case.toml"},
    "versions": {},
    "timings_s": {},
    "problems": [],
}


def document(*sections, **changes):
    return Document(
        **({"headline": "Done", "lines": ["So it is."], "tone": "plain", "sections": sections} | changes)
    )


def printed(*sections, **changes):
    stream = io.StringIO()
    Console(file=stream, width=100, no_color=True).print(terminal_text(document(*sections, **changes)))
    return [line.rstrip() for line in stream.getvalue().splitlines()]


def written(*sections, **changes):
    """Return the text of the body of the page, without tags."""
    body = page(document(*sections, **changes), RESULT).split("<body>")[1].split("<h2>Provenance")[0]
    return " ".join(re.sub(r"<[^>]+>", " ", body).split())


TABLE = Table("Rates", ("channel", "unit", "rate"), (("axial", "N/mm", "1"), ("radial", "N/mm", "2")), left=2)


@pytest.mark.parametrize("where", ["terminal", "page", "both"])
def test_a_block_is_where_it_says(where):
    blocks = [Paragraph("always there"), Paragraph("sought", on=where)]
    assert ("  sought" in printed(Section("What", blocks))) == (where != "page")
    assert ("sought" in written(Section("What", blocks))) == (where != "terminal")
    alone = Section("What", [Paragraph("always there")], on=where)
    assert ("What" in printed(alone)) == (where != "page")
    assert ("What" in written(alone)) == (where != "terminal")


def test_details_of_a_table_are_on_the_page_only():
    table = Table(TABLE.title, TABLE.heads, TABLE.rows, left=2, detail=[1])
    assert "channel  rate" in printed(Section("", [table]))
    assert "channel unit rate axial N/mm 1" in written(Section("", [table]))
    assert table.without_detail().left == 1


def test_a_long_table_keeps_its_ends_on_the_terminal():
    rows = tuple((str(n),) for n in range(1, 151))
    table = Table("Cycles", ("cycle",), rows, most=8)
    cells = printed(Section("", [table]))
    assert cells[2:] == ["", "Cycles (150 in all)", "cycle", "1", "2", "3", "4", "5", "...", "149", "150"]
    # The page has a hundred; result.json has all.
    assert "Cycles (150 in all)" in written(Section("", [table]))
    whole = Table("Cycles", ("cycle",), rows)
    assert printed(Section("", [whole]))[-1] == "150"
    assert [row[0] for row in table.without_middle(3).rows] == ["1", "2", "..."]


def test_a_heading_stands_above_text_and_above_a_table_without_title():
    assert printed(Section("Stiffness", [Paragraph("It is 3.")]))[2:] == ["", "Stiffness", "  It is 3."]
    assert printed(Section("Stiffness", [TABLE]))[2:4] == ["", "Rates"]
    untitled = Table("", TABLE.heads, TABLE.rows, left=2)
    assert printed(Section("Stiffness", [untitled]))[2:5] == ["", "Stiffness", "channel  unit  rate"]
    # On the page a title that repeats the heading is left out.
    assert written(Section("Rates", [TABLE])).count("Rates") == 1
    assert written(Section("Stiffness", [TABLE])).count("Rates") == 1


def test_what_explains_nothing_is_left_out():
    empty = Table("Rates", ("rate",), ())
    assert on("page", [Section("Stiffness", [empty, note("in N/mm")])]) == []
    (section,) = on("page", [Section("Stiffness", [TABLE, note("in N/mm")])])
    assert len(section.blocks) == 2
    (folded,) = on("page", [Section("Stiffness", [], fold="more", folded=[TABLE, empty])])
    assert folded.folded == [TABLE]
    assert on("terminal", [Section("Stiffness", [], fold="more", folded=[TABLE])]) == []


def test_the_verdict_is_first_or_last_and_problems_come_with_their_remedy():
    doubt = Condition("coarse", "the mesh is coarse", "refine it")
    first = printed(Section("", [TABLE]), problems=[doubt])
    assert first[:3] == ["Done.", "  So it is.", ""]
    assert first[-2:] == ["problem coarse: the mesh is coarse", "  remedy: refine it"]
    last = printed(Section("", [TABLE]), ends_with_verdict=True)
    assert last[0] == "Rates"
    assert last[-2:] == ["Done.", "  So it is."]
    # A result without a verdict begins with its sections.
    assert printed(Section("", [TABLE]), headline="", lines=[])[0] == "Rates"


def test_names_from_a_case_are_neither_mark_up_nor_html():
    name = "[red]rig[/red] <b>2</b>"
    table = Table("", ("channel",), ((name,),))
    assert name in printed(Section(name, [table, Paragraph(name)]))
    assert "&lt;b&gt;2&lt;/b&gt;" in page(document(Section(name, [table, Paragraph(name)])), RESULT)
