"""Measured tables of dynamic stiffness -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.json.common import cleaned, part
from bushcli.report.quantity import quantities
from bushcli.report.views.dynamic_tables import table_units

if TYPE_CHECKING:
    from bushcli.simulate.dynamic_tables import ComparedTable


def dynamic_tables_json(tables: Sequence[DynamicTable]) -> list[dict[str, Any]]:
    """Return tables as JSON-ready data: columns of equal length, null where a condition is not known."""
    return [_shown(table) for table in tables]


def compared_json(compared: Iterable[ComparedTable]) -> list[dict[str, Any]]:
    """Return simulated beside measured stiffness as JSON-ready data: the measured columns are in "recorded"."""
    found = []
    for one in compared:
        recorded = _shown(one.table)
        preload = quantities(one.table.mode).per_internal * one.preload
        simulated = {
            "name": one.table.name,
            "mode": one.table.mode,
            "units": recorded["units"],
            "preload": {"displacement": preload, "force": recorded["preload"]["force"]},
            "amplitude": recorded["amplitude"],
            "temperature": recorded["temperature"],
            "point": "transfer",
            "frequency": recorded["frequency"],
            "stiffness": np.abs(one.simulated),
            "storage": one.simulated.real,
            "loss": one.simulated.imag,
            "loss_angle_deg": np.degrees(np.angle(one.simulated)),
            "reduction_error": one.reduction_error,
            "recorded": recorded,
            "misfit": part(one, "stiffness_percent loss_angle_deg"),
        }
        found.append(cleaned(simulated))
    return found


def _shown(table: DynamicTable) -> dict[str, Any]:
    per = quantities(table.mode).per_internal
    columns = {
        **part(table, "name mode quantity"),
        "files": [str(file) for file in table.files],
        "rows": len(table),
        "curves": len(table.conditions()),
        "units": dict(zip(("displacement", "force", "stiffness"), table_units(table), strict=True)),
        "frequency": table.frequency,
        "amplitude": per * table.amplitude,
        "preload": {"displacement": per * table.preload, "force": table.preload_force},
        **part(table, "temperature stiffness storage loss"),
        "loss_angle_deg": np.degrees(table.loss_angle),
        **part(table, "storage_error loss_error third_harmonic remarks"),
    }
    shown: dict[str, Any] = cleaned(columns)
    return shown
