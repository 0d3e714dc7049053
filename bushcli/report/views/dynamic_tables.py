"""Measured tables of dynamic stiffness -> a section of a document."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.document import Columns, Section, figures, paragraphs, table_of
from bushcli.report.quantity import number, percent, quantities
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
    parts = [table.rows(rows) for table in tables for rows in table.conditions()]
    remarks = [f"{one.name}: {text}" for one in tables for text in one.remarks]
    table = table_of("Dynamic tables", parts, _MEASURED, left=2)
    return Section("Dynamic tables", [table, *paragraphs(remarks)])


def misfit_lines(compared: Sequence[ComparedTable]) -> list[str]:
    """Return a sentence with the misfit of each table."""
    return [
        f"{one.table.name}: dynamic stiffness within {percent(one.stiffness_percent)} and "
        f"{number(one.loss_angle_deg)} degrees of its table (rms)"
        for one in compared
    ]


def compared_section(compared: Sequence[ComparedTable]) -> Section:
    """Return a table with the misfit of each curve of each measured table."""
    parts = [
        (one.table.rows(rows), one.simulated[rows]) for one in compared for rows in one.table.conditions()
    ]
    title, drawn = "Dynamic stiffness: simulated and measured", figures("table")
    remarks = [f"{one.table.name}: {text}" for one in compared for text in one.table.remarks]
    blocks = [table_of(title, parts, _COMPARED), *paragraphs(remarks), drawn]
    return Section(title, blocks if parts else [])


def preload_of(table: DynamicTable) -> str:
    """Return the preload of rows in words: "preload 1500 N"; with their temperature and amplitude, if these differ."""
    first = table.rows(table.conditions()[0])
    shown = [one for one in (_preload(first), _span(first.temperature, "°C")) if one != "-"]
    return f"preload {', '.join(shown)}" if shown else "at rest"


def _motion(part: DynamicTable, values: Array) -> str:
    """Return the range of a motion: mm, degrees, or a strain in percent."""
    unit = table_units(part)[0]
    return (
        _span(100.0 * values, "%")
        if unit == "strain"
        else _span(quantities(part.mode).per_internal * values, unit)
    )


def _preload(part: DynamicTable) -> str:
    """Return the preload as a motion, or else as a force."""
    moved = _motion(part, part.preload)
    return _span(part.preload_force, table_units(part)[1]) if moved == "-" else moved


def _span(values: Array, unit: str) -> str:
    """Return the range of values, or their mean where they differ by less than is shown."""
    known = values[~np.isnan(values)]
    if not len(known):
        return "-"
    ends = [number(float(end)) for end in (known.min(), known.max())]
    return (ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}") + (f" {unit}" if unit else "")


# Of the rows of one curve.
_MEASURED: Columns[DynamicTable] = (
    ("channel", lambda part: part.name),
    ("quantity", lambda part: f"{part.quantity.replace('stiffness', 'K')}* [{table_units(part)[2]}]"),
    ("rows", lambda part: str(len(part))),
    ("frequency", lambda part: _span(part.frequency, "Hz")),
    ("amplitude", lambda part: _motion(part, part.amplitude)),
    ("preload", _preload),
    ("temperature", lambda part: _span(part.temperature, "°C")),
    ("magnitude", lambda part: _span(part.stiffness, "")),
    ("loss angle", lambda part: _span(np.degrees(part.loss_angle), "°")),
)
# Of the same, and their simulated stiffness.
_COMPARED: Columns[tuple[DynamicTable, NDArray[np.complex128]]] = (
    ("channel", lambda one: one[0].name),
    ("frequency", lambda one: _span(one[0].frequency, "Hz")),
    ("amplitude", lambda one: _motion(one[0], one[0].amplitude)),
    ("preload", lambda one: _preload(one[0])),
    ("|K*|", lambda one: _span(one[0].stiffness, "")),
    ("simulated", lambda one: _span(np.abs(one[1]), "")),
    ("misfit", lambda one: percent(100.0 * _rms(np.abs(one[1]) / one[0].stiffness - 1.0))),
    ("loss angle", lambda one: _span(np.degrees(one[0].loss_angle), "°")),
    ("simulated", lambda one: _span(np.degrees(np.angle(one[1])), "°")),
    ("misfit", lambda one: f"{number(np.degrees(_rms(np.angle(one[1]) - one[0].loss_angle)))} °"),
)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
