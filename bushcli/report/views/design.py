"""A design for target rates -> its document: targets, keys, derivatives, effect of tolerances."""

from __future__ import annotations

import math

from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Paragraph, Row, Section, Table, Tone, note, table_of
from bushcli.report.quantity import number
from bushcli.runtime.digits import with_decimals
from bushcli.study.design import Design, Reached

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
        design_table(design),
        Table("Derivatives, per unit of each key", ("target", "", *keys), slopes, left=2),
    ]
    sections = [
        Section("", [Paragraph(remark, on="page")]),
        *(Section(table.title, [table]) for table in tables),
        Section(_SPREAD, [spread_table(design), note(_NOTE)]),
    ]
    tone: Tone = "good" if all(goal.is_met for goal in design.targets) else "bad"
    lines = ["To simulate it: " + " ".join(f"--set {text}" for text in overrides(design))]
    simulated = conditions(design.case)
    return Document(design_headline(design), lines, tone, sections, design.conditions, simulated)


def overrides(design: Design) -> list[str]:
    """Return the design as values of ``--set``."""
    return [f"{key}={dimension.value:.8g}" for key, dimension in design.keys.items()]


def design_headline(design: Design) -> str:
    """Return the result in one sentence."""
    values = ", ".join(f"{key} = {number(dimension.value, 5)}" for key, dimension in design.keys.items())
    missed = ", ".join(goal.target.name for goal in design.targets if not goal.is_met)
    return f"Nearest design: {values}; it misses {missed}" if missed else f"Design: {values}"


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


def design_table(design: Design) -> Table:
    """Return the value of each key, where the search began, and its bounds."""
    rows = []
    for key, of in design.keys.items():
        values = (number(of.value, 6), *(number(value, 5) for value in (of.start, of.lower, of.upper)))
        rows.append((key, *values, "at its bound" if of.at_bound else ""))
    return Table("Design", ("key", "value", "started at", "lower bound", "upper bound", ""), tuple(rows))


def spread_table(design: Design) -> Table:
    """Return the change of each rate at the upper limit of each tolerance."""
    keys: tuple[str, ...] = ()
    rows: list[Row] = []
    for goal in design.targets:
        if (spread := goal.spread) is not None:
            keys = tuple(spread.contributions)
            share = "-" if math.isnan(spread.share) else f"{100 * spread.share:.1f} %"
            values = (*spread.contributions.values(), spread.worst, spread.std)
            rows.append((goal.target.name, goal.target.unit, *map(number, values), share))
    heads = ("target", "", *keys, "worst case", "std", "within allowed")
    return Table(_SPREAD, heads, tuple(rows), left=2)
