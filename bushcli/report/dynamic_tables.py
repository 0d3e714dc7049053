"""Measured tables of dynamic stiffness as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.padding import Padding
from rich.text import Text

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.quantity import number, quantities
from bushcli.report.tables import ReportTable
from bushcli.report.text import Shown
from cases.mode import modes

Array = NDArray[np.float64]


def dynamic_tables_json(tables: Sequence[DynamicTable]) -> list[dict[str, Any]]:
    """Return tables as JSON-ready data: columns of equal length, null where a condition is not known.

    Parameters
    ----------
    tables : sequence of DynamicTable
    """
    return [_shown(table) for table in tables]


def _shown(table: DynamicTable) -> dict[str, Any]:
    per = quantities(table.mode).per_internal
    units = _units(table)
    return {
        "name": table.name,
        "mode": table.mode,
        "quantity": table.quantity,
        "files": [str(file) for file in table.files],
        "rows": len(table),
        "curves": len(table.conditions()),
        "units": {"displacement": units[0], "force": units[1], "stiffness": units[2]},
        "frequency": _listed(table.frequency),
        "amplitude": _listed(per * table.amplitude),
        "preload": {"displacement": _listed(per * table.preload), "force": _listed(table.preload_force)},
        "temperature": _listed(table.temperature),
        "stiffness": _listed(table.stiffness),
        "storage": _listed(table.storage),
        "loss": _listed(table.loss),
        "loss_angle_deg": _listed(np.degrees(table.loss_angle)),
        "storage_error": _listed(table.storage_error),
        "loss_error": _listed(table.loss_error),
        "third_harmonic": _listed(table.third_harmonic),
        "remarks": list(table.remarks),
    }


def _listed(values: Array) -> list[float | None]:
    return [None if math.isnan(value) else float(value) for value in values]


def _units(table: DynamicTable) -> tuple[str, str, str]:
    """Return the units of displacement, force and stiffness that are shown."""
    mode, shown = modes()[table.mode], quantities(table.mode)
    if mode.specimen == "coupon":
        return "strain", "MPa", "MPa"
    return shown.displacement_unit, shown.force_unit, "N mm/rad" if mode.rotational else "N/mm"


def dynamic_tables_parts(tables: Sequence[DynamicTable]) -> tuple[Any, ...]:
    """Return a table with a row for each curve of each measured table, and what was understood from the files.

    Parameters
    ----------
    tables : sequence of DynamicTable
    """
    if not tables:
        return ()
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
    parts: list[Any] = [Text(), Shown(ReportTable("Dynamic tables", heads, rows, left=2))]
    parts += [Padding(Text(f"{one.name}: {text}"), (0, 0, 0, 2)) for one in tables for text in one.remarks]
    return tuple(parts)


def _rows(table: DynamicTable) -> list[tuple[str, ...]]:
    per = quantities(table.mode).per_internal
    displacement, force, stiffness = _units(table)
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
