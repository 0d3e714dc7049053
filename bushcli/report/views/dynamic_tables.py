"""Measured tables of dynamic stiffness -> a section of a document."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.document import Document, Section, Table, figures, paragraphs
from bushcli.report.quantity import number, percent, quantities
from bushcli.runtime.condition import Condition
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.simulate.dynamic_tables import ComparedTable

Array = NDArray[np.float64]


def table_units(table: DynamicTable) -> tuple[str, str, str]:
    """Return the units of displacement, force and stiffness that are shown."""
    mode, shown = modes()[table.mode], quantities(table.mode)
    if mode.specimen == "coupon":
        return "strain", "MPa", "MPa"
    return shown.displacement_unit, shown.force_unit, "N mm/rad" if mode.rotational else "N/mm"


def dynamic_tables_section(tables: Sequence[DynamicTable]) -> Section:
    """Return a table with a row for each curve of each measured table, and what was understood from the files."""
    heads = (
        "channel",
        "quantity",
        "rows",
        "frequency",
        "amplitude",
        "preload",
        "temperature",
        "magnitude",
        "loss angle",
    )
    rows = tuple(row for table in tables for row in _rows(table))
    remarks = [f"{one.name}: {text}" for one in tables for text in one.remarks]
    return Section("Dynamic tables", [Table("Dynamic tables", heads, rows, left=2), *paragraphs(remarks)])


def with_tables(
    static: Document,
    compared: Sequence[ComparedTable],
    problems: Sequence[Condition],
    alone: bool,
) -> Document:
    """Return the document of a direct prediction with the misfit of the tables.

    Parameters
    ----------
    static : Document
        Of the curves, of which there may be none.
    compared : sequence of ComparedTable
    problems : sequence of Condition
        What has to be known about the comparison.
    alone : bool
        Whether there are no curves.
    """
    if not compared:
        return replace(static, problems=[*static.problems, *problems])
    lines = misfit_lines(compared)
    headline = f"{len(compared)} table{'s' if len(compared) > 1 else ''} of dynamic stiffness compared"
    return replace(
        static,
        headline=headline if alone else static.headline,
        lines=[*static.lines, *lines],
        sections=[*static.sections, compared_section(compared)],
        problems=[*static.problems, *problems],
    )


def misfit_lines(compared: Sequence[ComparedTable]) -> list[str]:
    """Return a sentence with the misfit of each table."""
    return [
        f"{one.table.name}: dynamic stiffness within {percent(one.stiffness_percent)} and "
        f"{number(one.loss_angle_deg)} degrees of its table (rms)"
        for one in compared
    ]


def compared_section(compared: Sequence[ComparedTable]) -> Section:
    """Return a table with the misfit of each curve of each measured table."""
    heads = (
        *("channel", "frequency", "amplitude", "preload", "|K*|", "simulated", "misfit"),
        *("loss angle", "simulated", "misfit"),
    )
    rows = []
    for one in compared:
        for own, shown in zip(one.table.conditions(), _rows(one.table), strict=True):
            part, simulated = one.table.rows(own), one.simulated[own]
            size = float(np.sqrt(np.mean((np.abs(simulated) / part.stiffness - 1.0) ** 2)))
            angle = float(np.sqrt(np.mean((np.angle(simulated) - part.loss_angle) ** 2)))
            rows.append(
                (
                    *(shown[0], *shown[3:6], shown[7], _span(np.abs(simulated), ""), percent(100.0 * size)),
                    *(
                        shown[8],
                        _span(np.degrees(np.angle(simulated)), "°"),
                        f"{number(np.degrees(angle))} °",
                    ),
                )
            )
    title, drawn = "Dynamic stiffness: simulated and measured", [figures("table")]
    remarks = [f"{one.table.name}: {text}" for one in compared for text in one.table.remarks]
    return Section(title, [Table(title, heads, tuple(rows)), *paragraphs(remarks), *drawn] if rows else [])


def preload_of(table: DynamicTable) -> str:
    """Return the preload of rows in words: "preload 1500 N"; with their temperature and amplitude, if these differ."""
    (shown,) = {row[5:7] for row in _rows(table)[:1]}
    return "preload " + ", ".join(one for one in shown if one != "-") if shown != ("-", "-") else "at rest"


def _rows(table: DynamicTable) -> list[tuple[str, ...]]:
    per = quantities(table.mode).per_internal
    displacement, force, stiffness = table_units(table)
    percent = displacement == "strain"
    scale, unit = (100.0, "%") if percent else (per, displacement)
    named = f"{table.quantity}*" if table.quantity != "stiffness" else "K*"
    shown: list[tuple[str, ...]] = []
    for rows in table.conditions():
        part = table.rows(rows)
        preload = _span(scale * part.preload, unit)
        shown.append(
            (
                table.name,
                f"{named} [{stiffness}]",
                str(len(part)),
                _span(part.frequency, "Hz"),
                _span(scale * part.amplitude, unit),
                _span(part.preload_force, force) if preload == "-" else preload,
                _span(part.temperature, "°C"),
                _span(part.stiffness, ""),
                _span(np.degrees(part.loss_angle), "°"),
            )
        )
    return shown


def _span(values: Array, unit: str) -> str:
    """Return the range of values, or their mean where they differ by less than is shown."""
    known = values[~np.isnan(values)]
    if not len(known):
        return "-"
    ends = [number(float(end)) for end in (known.min(), known.max())]
    return (ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}") + (f" {unit}" if unit else "")
