"""Measured tables of dynamic stiffness -> a section of a document."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.document import Section, Table, paragraphs
from bushcli.report.quantity import number, quantities
from cases.mode import modes

Array = NDArray[np.float64]


def table_units(table: DynamicTable) -> tuple[str, str, str]:
    """Return the units of displacement, force and stiffness that are shown.

    Parameters
    ----------
    table : DynamicTable
    """
    mode, shown = modes()[table.mode], quantities(table.mode)
    if mode.specimen == "coupon":
        return "strain", "MPa", "MPa"
    return shown.displacement_unit, shown.force_unit, "N mm/rad" if mode.rotational else "N/mm"


def dynamic_tables_section(tables: Sequence[DynamicTable]) -> Section:
    """Return a table with a row for each curve of each measured table, and what was understood from the files.

    Parameters
    ----------
    tables : sequence of DynamicTable
    """
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
