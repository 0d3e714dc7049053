"""The page of a design for target rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from bushcli.report.design import design_headline, design_tables, overrides
from bushcli.report.html import PageSection, page
from bushcli.study.design import Design

_NOTE = (
    "To first order, from the derivatives at the design. The worst case is the sum of the sizes of all changes; the "
    "standard deviation is that of independent normal deviations whose limits are three standard deviations away."
)


def design_html(result: Mapping[str, Any], found: Design) -> str:
    """Return the page of a design.

    Parameters
    ----------
    result : mapping of str to object
        What `design_json` returned.
    found : Design
    """
    sections = [
        PageSection(
            table.title, tables=[replace(table, title="")], note=_NOTE if "tolerances" in table.title else ""
        )
        for table in design_tables(found)
    ]
    lines = [
        "To simulate it: " + " ".join(f"--set {text}" for text in overrides(found)),
        "The conditions below are those of the case file, where the search began.",
    ]
    tone = "good" if all(one.met for one in found.targets) else "bad"
    return page(result, found.case, None, design_headline(found), lines, tone, sections)
