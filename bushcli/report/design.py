"""A design for target rates -> JSON, tables and sentences, for both the terminal and the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.text import Text

from bushcli.report.json.direct import cleaned, head
from bushcli.report.quantity import number
from bushcli.report.tables import ReportTable, Row
from bushcli.report.text import Shown, problem_parts
from bushcli.study.design import Design, Reached


def design_json(found: Design, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a design as JSON-ready data.

    Parameters
    ----------
    found : Design
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("design", found.case, found.conditions, timings)
    document["converged"] = found.converged
    document["evaluations"] = found.evaluations
    document["met"] = all(one.met for one in found.targets)
    document["design"] = {
        key: {
            "value": one.value,
            "lower": one.lower,
            "upper": one.upper,
            "start": one.start,
            "at_bound": one.at_bound,
        }
        for key, one in found.keys.items()
    }
    document["set"] = overrides(found)
    document["targets"] = {one.target.name: _target(one) for one in found.targets}
    return cleaned(document)


def _target(one: Reached) -> dict[str, Any]:
    document: dict[str, Any] = {
        "unit": one.target.unit,
        "wanted": one.wanted,
        "allowed": one.target.deviation * one.target.per_shown,
        "value": one.value,
        "deviation_percent": 100 * one.deviation,
        "met": one.met,
        "derivatives": dict(one.slopes),
    }
    if one.spread is not None:
        document["tolerances"] = {
            "contributions": dict(one.spread.contributions),
            "worst": one.spread.worst,
            "std": one.spread.std,
            "share": one.spread.share,
        }
    return document


def overrides(found: Design) -> list[str]:
    """Return the design as values of ``--set``."""
    return [f"{key}={one.value:.8g}" for key, one in found.keys.items()]


def design_text(found: Design) -> Group:
    """Return the verdict, the tables and the problems of a design."""
    parts: list[object] = [Text(f"{design_headline(found)}.", "bold")]
    for table in design_tables(found):
        parts += [Text(), Shown(table)]
    parts += [Text(), Text(" ".join(f"--set {text}" for text in overrides(found)), "dim")]
    parts += problem_parts(found.conditions)
    return Group(*parts)  # type: ignore[arg-type]  # every part is a renderable


def design_headline(found: Design) -> str:
    """Return the result in one sentence."""
    values = ", ".join(f"{key} = {number(one.value, 5)}" for key, one in found.keys.items())
    missed = [one.target.name for one in found.targets if not one.met]
    if missed:
        return f"Nearest design: {values}; it misses {', '.join(missed)}"
    return f"Design: {values}"


def design_tables(found: Design) -> list[ReportTable]:
    """Return tables of targets, keys, and effects of tolerances."""
    targets = tuple(
        (
            one.target.name,
            one.target.unit,
            number(one.wanted, 5),
            number(one.value, 5),
            f"{round(100 * one.deviation, 3) + 0.0:+.3f} %",
            "reached" if one.met else "missed",
        )
        for one in found.targets
    )
    keys = tuple(
        (
            key,
            number(one.value, 6),
            number(one.start, 5),
            number(one.lower, 5),
            number(one.upper, 5),
            "at its bound" if one.at_bound else "",
        )
        for key, one in found.keys.items()
    )
    made = [
        ReportTable("Targets", ("target", "", "wanted", "value", "deviation", ""), targets, left=2),
        ReportTable("Design", ("key", "value", "started at", "lower bound", "upper bound", ""), keys),
        _slopes(found),
    ]
    return [*made, *_spreads(found)]


def _slopes(found: Design) -> ReportTable:
    keys = list(found.targets[0].slopes)
    rows: tuple[Row, ...] = tuple(
        (one.target.name, one.target.unit, *(number(one.slopes[key], 4) for key in keys))
        for one in found.targets
    )
    return ReportTable("Derivatives, per unit of each key", ("target", "", *keys), rows, left=2)


def _spreads(found: Design) -> list[ReportTable]:
    with_spread = [(one, one.spread) for one in found.targets if one.spread is not None]
    if not with_spread:
        return []
    keys = list(with_spread[0][1].contributions)
    rows: list[Row] = []
    for one, spread in with_spread:
        row: Row = (one.target.name, one.target.unit, *(number(spread.contributions[key], 3) for key in keys))
        share = "-" if math.isnan(spread.share) else f"{100 * spread.share:.1f} %"
        rows.append((*row, number(spread.worst, 3), number(spread.std, 3), share))
    heads = ("target", "", *keys, "worst case", "std", "within allowed")
    return [
        ReportTable("Effect of the tolerances: change at the upper limit of each", heads, tuple(rows), left=2)
    ]
