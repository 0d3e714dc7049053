"""Measured tables of dynamic stiffness -> JSON-ready data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.quantity import quantities
from bushcli.report.views.dynamic_tables import table_units

if TYPE_CHECKING:
    from bushcli.simulate.dynamic_tables import ComparedTable

Array = NDArray[np.float64]


def dynamic_tables_json(tables: Sequence[DynamicTable]) -> list[dict[str, Any]]:
    """Return tables as JSON-ready data: columns of equal length, null where a condition is not known."""
    return [_shown(table) for table in tables]


def compared_json(compared: Iterable[ComparedTable]) -> list[dict[str, Any]]:
    """Return simulated beside measured stiffness as JSON-ready data: the measured columns are in "recorded"."""
    found = []
    for one in compared:
        recorded = _shown(one.table)
        per = quantities(one.table.mode).per_internal
        found.append(
            {
                "name": one.table.name,
                "mode": one.table.mode,
                "units": recorded["units"],
                "preload": {
                    "displacement": _listed(per * one.preload),
                    "force": recorded["preload"]["force"],
                },
                "amplitude": recorded["amplitude"],
                "temperature": recorded["temperature"],
                "point": "transfer",
                "frequency": recorded["frequency"],
                "stiffness": _listed(np.abs(one.simulated)),
                "storage": _listed(one.simulated.real),
                "loss": _listed(one.simulated.imag),
                "loss_angle_deg": _listed(np.degrees(np.angle(one.simulated))),
                "reduction_error": one.reduction_error,
                "recorded": recorded,
                "misfit": {"stiffness_percent": one.stiffness_percent, "loss_angle_deg": one.loss_angle_deg},
            }
        )
    return found


def _shown(table: DynamicTable) -> dict[str, Any]:
    per = quantities(table.mode).per_internal
    units = table_units(table)
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
