"""Dynamic stiffness, and measured tables of it beside their simulation -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.report.json.common import material_json, result_json, select
from bushcli.report.json.fit import fit_part
from bushcli.report.quantity import quantities
from bushcli.report.results import DynamicResult
from bushcli.report.views.dynamic import stiffness_unit, table_units
from cases.six import MOTIONS

if TYPE_CHECKING:
    from bushcli.recording.dynamic.table import DynamicTable
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.vibrations import DynamicCurve


def dynamic_json(result: DynamicResult) -> dict[str, Any]:
    """Return dynamic stiffness as JSON-ready data."""
    response = result.response
    entries = {
        "complete": response.complete,
        "material": material_json(response.material),
        "load_cases": [_curve(curve) for curve in response.curves],
        **({} if result.fit is None else {"fit": fit_part(result.fit)}),
    }
    return result_json("dynamic", response.case, response.conditions, entries, response.seconds)


def _curve(curve: DynamicCurve) -> dict[str, Any]:
    units, test = quantities(curve.mode), curve.test
    preload = {"displacement": units.at(curve.preload), "force": curve.force, "stiffness": curve.static}
    entry: dict[str, Any] = {
        "name": curve.name,
        "mode": test.mode,
        "units": {
            "displacement": units.displacement_unit,
            "force": units.force_unit,
            "stiffness": stiffness_unit(curve.mode),
        },
        "preload": preload,
        "amplitude": None if curve.amplitude is None else units.per_internal * curve.amplitude,
        "temperature": test.temperature,
        "point": "transfer" if test.transfer else "driving",
        "frequency": curve.frequency,
        **_moduli(curve.stiffness),
        "reduction_error": curve.reduction_error,
        "reduction_vectors": curve.vectors,
    }
    if curve.third_harmonic is not None:
        entry["third_harmonic"] = curve.third_harmonic
    if curve.matrix is not None and (pose := test.pose) is not None:
        motion = dict(zip(MOTIONS, (*pose[:3], *np.degrees(pose[3:])), strict=True))
        entry["preload"] = {**preload, "motion": motion}
        entry |= {
            "motion": MOTIONS[test.motion],
            "storage_matrix": curve.matrix.real,
            "loss_matrix": curve.matrix.imag,
        }
    return entry


def compared_json(compared: Iterable[ComparedTable]) -> list[dict[str, Any]]:
    """Return simulated beside measured stiffness as JSON-ready data: the measured columns are in "recorded"."""
    return [
        {
            **select(comparison.table, "name mode"),
            "units": recorded["units"],
            "preload": {
                "displacement": quantities(comparison.table.mode).per_internal * comparison.preload,
                "force": comparison.table.preload_force,
            },
            **{key: recorded[key] for key in ("amplitude", "temperature")},
            "point": "transfer",
            "frequency": comparison.table.frequency,
            **_moduli(comparison.simulated),
            "reduction_error": comparison.reduction_error,
            "recorded": recorded,
            "misfit": select(comparison, "stiffness_percent loss_angle_deg"),
        }
        for comparison in compared
        for recorded in [table_json(comparison.table)]
    ]


def _moduli(K: NDArray[np.complex128]) -> dict[str, Any]:
    loss_angle = np.degrees(np.angle(K))
    return {"stiffness": np.abs(K), "storage": K.real, "loss": K.imag, "loss_angle_deg": loss_angle}


def table_json(table: DynamicTable) -> dict[str, Any]:
    """Return a table as JSON-ready data: columns of equal length, null where a condition is not known."""
    per = quantities(table.mode).per_internal
    return {
        **select(table, "name mode quantity"),
        "files": [str(file) for file in table.files],
        "rows": len(table),
        "curves": len(table.conditions()),
        "units": dict(zip(("displacement", "force", "stiffness"), table_units(table), strict=True)),
        "frequency": table.frequency,
        "amplitude": per * table.amplitude,
        "preload": {"displacement": per * table.preload, "force": table.preload_force},
        **select(table, "temperature stiffness storage loss"),
        "loss_angle_deg": np.degrees(table.loss_angle),
        **select(table, "storage_error loss_error third_harmonic remarks"),
    }
