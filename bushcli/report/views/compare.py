"""A comparison of results -> its document: curves, keys and numbers that differ, problems."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bushcli.report.document import Document, Section, Table, figures
from bushcli.report.quantity import listed, number
from bushcli.study.compare import Comparison, Difference

# Rows on the terminal.
_MOST = 40


def compare_document(found: Comparison) -> Document:
    """Return the document of a comparison."""
    curves = Table(
        "Largest difference to the first curve, of its force range",
        ("channel", *(item.name for item in found.items)),
        tuple(
            (one.channel, *("-" if value is None else f"{value + 0.0:+.2f} %" for value in one.percent))
            for one in found.curves
        ),
    )
    problems = tuple(
        (item.name, str(item.result.get("command", "")), ", ".join(names) or "none")
        for item, names in zip(found.items, found.problems, strict=True)
    )
    doubts = Table("Problems", ("result", "of", "problems"), problems, left=3)
    sections = [
        Section("Curves", [curves, figures("curve")]),
        Section("Keys of the cases", [_table("Keys that differ", found, found.keys)]),
        Section("Numbers", [_table("Numbers that differ", found, found.numbers)]),
        Section("Problems of each result", [doubts]),
    ]
    return Document(compare_headline(found), [], "plain", sections)


def compare_headline(found: Comparison) -> str:
    """Return the result in one sentence."""
    names = listed([one.name for one in found.items])
    keys = [one.key for one in found.keys]
    count = len(keys)
    said = f"{count} key{'s differ' if count != 1 else ' differs'}" if keys else "their cases are equal"
    few = f" ({', '.join(keys)})" if 0 < count <= 3 else ""
    differ = len(found.numbers)
    return f"{names}: {said}{few}, {differ or 'no'} number{'s differ' if differ > 1 else ' differs'}"


def _table(title: str, found: Comparison, differences: Sequence[Difference]) -> Table:
    heads = ["key", *(item.name for item in found.items), *(["change"] if len(found.items) == 2 else [])]
    rows = []
    for one in differences:
        change = one.percent[-1]
        last = [("" if change is None else f"{change:+.3g} %")] if len(found.items) == 2 else []
        rows.append((one.key, *map(_shown, one.values), *last))
    return Table(title, tuple(heads), tuple(rows), left=1, most=_MOST)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return number(float(value), 5)
    text = ", ".join(map(_shown, value)) if isinstance(value, tuple) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
