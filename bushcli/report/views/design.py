"""A design for target rates -> its document: targets, keys, derivatives, effect of tolerances."""

from __future__ import annotations

import math

from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Paragraph, Row, Section, Table, note, table_of
from bushcli.report.quantity import number
from bushcli.runtime.digits import with_decimals
from bushcli.study.design import Design, Dimension, Reached

_SPREAD = "Effect of the tolerances: change at the upper limit of each"
_NOTE = (
    "To first order, from the derivatives at the design. The worst case is the sum of the sizes of all changes; the "
    "standard deviation is that of independent normal deviations whose limits are three standard deviations away."
)


def design_document(design: Design) -> Document:
    """Return the document of a design."""
    remark = "The conditions above are those of the case file, where the search began."
    keys = tuple(design.targets[0].slopes)
    slopes = tuple(
        (goal.target.name, goal.target.unit, *(number(goal.slopes[key], 4) for key in keys))
        for goal in design.targets
    )
    tables = [
        table_of("Targets", design.targets, _TARGETS, left=2),
        table_of("Design", design.keys.items(), _DESIGN),
        Table("Derivatives, per unit of each key", ("target", "", *keys), slopes, left=2),
    ]
    sections = [
        Section("", [Paragraph(remark, on="page")]),
        *(Section(table.title, [table]) for table in tables),
        Section(_SPREAD, [spread_table(design), note(_NOTE)]),
    ]
    met = all(goal.is_met for goal in design.targets)
    lines = ["To simulate it: " + " ".join(f"--set {text}" for text in overrides(design))]
    condition_rows = conditions(design.case)
    return Document(
        design_headline(design), lines, "good" if met else "bad", sections, design.conditions, condition_rows
    )


def overrides(design: Design) -> list[str]:
    """Return the design as values of ``--set``."""
    return [f"{key}={dimension.value:.8g}" for key, dimension in design.keys.items()]


def design_headline(design: Design) -> str:
    """Return the result in one sentence."""
    values = ", ".join(f"{key} = {number(dimension.value, 5)}" for key, dimension in design.keys.items())
    missed = [goal.target.name for goal in design.targets if not goal.is_met]
    if missed:
        return f"Nearest design: {values}; it misses {', '.join(missed)}"
    return f"Design: {values}"


def _deviation(goal: Reached) -> str:
    """Return the deviation with the digits that show whether it is within what is allowed."""
    limit = 100 * goal.tolerance
    text = with_decimals(round(100 * goal.deviation, 9), -limit, limit, decimals=3)
    return f"{'' if text.startswith('-') else '+'}{text} %".replace("-0.000 %", "+0.000 %")


_TARGETS: Columns[Reached] = (
    ("target", lambda goal: goal.target.name),
    ("", lambda goal: goal.target.unit),
    ("wanted", lambda goal: number(goal.target_value, 5)),
    ("value", lambda goal: number(goal.value, 5)),
    ("deviation", _deviation),
    ("", lambda goal: "reached" if goal.is_met else "missed"),
)
_DESIGN: Columns[tuple[str, Dimension]] = (
    ("key", lambda row: row[0]),
    ("value", lambda row: number(row[1].value, 6)),
    ("started at", lambda row: number(row[1].start, 5)),
    ("lower bound", lambda row: number(row[1].lower, 5)),
    ("upper bound", lambda row: number(row[1].upper, 5)),
    ("", lambda row: "at its bound" if row[1].at_bound else ""),
)


def spread_table(design: Design) -> Table:
    """Return the change of each rate at the upper limit of each tolerance."""
    keys: tuple[str, ...] = ()
    rows: list[Row] = []
    for goal in design.targets:
        if (spread := goal.spread) is not None:
            keys = tuple(spread.contributions)
            share = "-" if math.isnan(spread.share) else f"{100 * spread.share:.1f} %"
            values = [
                number(value, 3) for value in (*spread.contributions.values(), spread.worst, spread.std)
            ]
            rows.append((goal.target.name, goal.target.unit, *values, share))
    heads = ("target", "", *keys, "worst case", "std", "within allowed")
    return Table(_SPREAD, heads, tuple(rows), left=2)
