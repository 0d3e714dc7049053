"""A design for target rates -> its document: targets, keys, derivatives, effect of tolerances."""

from __future__ import annotations

import math

from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Paragraph, Row, Section, Table, note, table_of
from bushcli.report.quantity import number
from bushcli.runtime.digits import beside
from bushcli.study.design import Design, Dimension, Reached

_SPREAD = "Effect of the tolerances: change at the upper limit of each"
_NOTE = (
    "To first order, from the derivatives at the design. The worst case is the sum of the sizes of all changes; the "
    "standard deviation is that of independent normal deviations whose limits are three standard deviations away."
)


def design_document(found: Design) -> Document:
    """Return the document of a design."""
    began = "The conditions above are those of the case file, where the search began."
    keys = tuple(found.targets[0].slopes)
    slopes = tuple(
        (one.target.name, one.target.unit, *(number(one.slopes[key], 4) for key in keys))
        for one in found.targets
    )
    tables = [
        table_of("Targets", found.targets, _TARGETS, left=2),
        table_of("Design", found.keys.items(), _DESIGN),
        Table("Derivatives, per unit of each key", ("target", "", *keys), slopes, left=2),
    ]
    sections = [
        Section("", [Paragraph(began, on="page")]),
        *(Section(table.title, [table]) for table in tables),
        Section(_SPREAD, [spread_table(found), note(_NOTE)]),
    ]
    met = all(one.met for one in found.targets)
    lines = ["To simulate it: " + " ".join(f"--set {text}" for text in overrides(found))]
    seen = conditions(found.case)
    return Document(design_headline(found), lines, "good" if met else "bad", sections, found.conditions, seen)


def overrides(found: Design) -> list[str]:
    """Return the design as values of ``--set``."""
    return [f"{key}={one.value:.8g}" for key, one in found.keys.items()]


def design_headline(found: Design) -> str:
    """Return the result in one sentence."""
    values = ", ".join(f"{key} = {number(one.value, 5)}" for key, one in found.keys.items())
    missed = [one.target.name for one in found.targets if not one.met]
    if missed:
        return f"Nearest design: {values}; it misses {', '.join(missed)}"
    return f"Design: {values}"


def _deviation(one: Reached) -> str:
    """Return the deviation with the digits that show whether it is within what is allowed."""
    limit = 100 * one.allowed
    text = beside(round(100 * one.deviation, 9), -limit, limit, decimals=3)
    return f"{'' if text.startswith('-') else '+'}{text} %".replace("-0.000 %", "+0.000 %")


_TARGETS: Columns[Reached] = (
    ("target", lambda one: one.target.name),
    ("", lambda one: one.target.unit),
    ("wanted", lambda one: number(one.wanted, 5)),
    ("value", lambda one: number(one.value, 5)),
    ("deviation", _deviation),
    ("", lambda one: "reached" if one.met else "missed"),
)
_DESIGN: Columns[tuple[str, Dimension]] = (
    ("key", lambda one: one[0]),
    ("value", lambda one: number(one[1].value, 6)),
    ("started at", lambda one: number(one[1].start, 5)),
    ("lower bound", lambda one: number(one[1].lower, 5)),
    ("upper bound", lambda one: number(one[1].upper, 5)),
    ("", lambda one: "at its bound" if one[1].at_bound else ""),
)


def spread_table(found: Design) -> Table:
    """Return the change of each rate at the upper limit of each tolerance."""
    keys: tuple[str, ...] = ()
    rows: list[Row] = []
    for one in found.targets:
        if (spread := one.spread) is not None:
            keys = tuple(spread.contributions)
            share = "-" if math.isnan(spread.share) else f"{100 * spread.share:.1f} %"
            values = [
                number(value, 3) for value in (*spread.contributions.values(), spread.worst, spread.std)
            ]
            rows.append((one.target.name, one.target.unit, *values, share))
    heads = ("target", "", *keys, "worst case", "std", "within allowed")
    return Table(_SPREAD, heads, tuple(rows), left=2)
