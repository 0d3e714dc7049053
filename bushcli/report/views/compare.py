"""A comparison of results -> its document: curves, keys and numbers that differ, problems."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bushcli.report.document import Document, Section, Table, figures
from bushcli.report.quantity import join_names, number
from bushcli.study.compare import Comparison, Difference

# Rows on the terminal.
_MOST = 40


def compare_document(comparison: Comparison) -> Document:
    """Return the document of a comparison."""
    percentages = tuple(
        (curve.channel, *("-" if value is None else f"{value + 0.0:+.2f} %" for value in curve.percent))
        for curve in comparison.curves
    )
    heads = ("channel", *(item.name for item in comparison.items))
    curves = Table("Largest difference to the first curve, of its force range", heads, percentages)
    problems = tuple(
        (item.name, str(item.result.get("command", "")), ", ".join(names) or "none")
        for item, names in zip(comparison.items, comparison.problems, strict=True)
    )
    doubts = Table("Problems", ("result", "of", "problems"), problems, left=3)
    sections = [
        Section("Curves", [curves, figures("curve")]),
        Section("Keys that differ", [_table("Keys that differ", comparison, comparison.keys)]),
        Section("Numbers that differ", [_table("Numbers that differ", comparison, comparison.numbers)]),
        Section("Problems", [doubts]),
    ]
    return Document(compare_headline(comparison), [], "plain", sections)


def compare_headline(comparison: Comparison) -> str:
    """Return the result in one sentence."""
    names = join_names([item.name for item in comparison.items])
    keys = [difference.key for difference in comparison.keys]
    key_list = f" ({', '.join(keys)})" if 0 < len(keys) <= 3 else ""
    numbers = _differ(len(comparison.numbers), "number")
    return f"{names}: {_differ(len(keys), 'key') if keys else 'their cases are equal'}{key_list}, {numbers}"


def _differ(count: int, what: str) -> str:
    return f"{count or 'no'} {what}{'s differ' if count > 1 else ' differs'}"


def _table(title: str, comparison: Comparison, differences: Sequence[Difference]) -> Table:
    of_two = len(comparison.items) == 2
    heads = ("key", *(item.name for item in comparison.items), *(["change"] if of_two else []))
    rows = []
    for difference in differences:
        change = difference.percent[-1]
        changes = ["" if change is None else f"{change:+.3g} %"] if of_two else []
        rows.append((difference.key, *map(_value_text, difference.values), *changes))
    return Table(title, heads, tuple(rows), left=1, most=_MOST)


def _value_text(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return number(value, 5)
    text = ", ".join(map(_value_text, value)) if isinstance(value, tuple) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
