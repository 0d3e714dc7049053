"""Dynamic stiffness: as JSON, as table of text, as CSV."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group

from bushcli.report.contents import number_table
from bushcli.report.document import cleaned, head
from bushcli.report.fit_part import fit_part
from bushcli.report.folder import RESULT, Content, write_files
from bushcli.report.output import inputs_of
from bushcli.report.quantity import number, quantities
from bushcli.report.tables import ReportTable, Row
from bushcli.report.text import Shown, problem_parts
from bushcli.runtime.names import file_names
from cases.six import MOTIONS, PAIR_MODES

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.simulate.dynamic import DynamicCurve, DynamicResponse

# Rows of a printed table of one preload; the whole is in the CSV file and in the JSON.
_ROWS = 9


def dynamic_json(response: DynamicResponse, fit: Fit | None, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return dynamic stiffness as JSON-ready data.

    Parameters
    ----------
    response : DynamicResponse
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("dynamic", response.case, response.conditions, {**response.seconds, **timings})
    document["complete"] = response.complete
    document["load_cases"] = [_curve(one) for one in response.curves]
    if fit is not None:
        document["fit"] = fit_part(fit)
    return cleaned(document)


def _mode(curve: DynamicCurve) -> str:
    """Return the mode whose displacement and force are those of the vibration."""
    return curve.test.mode if curve.test.six is None else PAIR_MODES[curve.test.motion]


def _curve(curve: DynamicCurve) -> dict[str, Any]:
    shown, test = quantities(_mode(curve)), curve.test
    preload: dict[str, Any] = {"displacement": shown.at(curve.preload), "force": curve.force}
    entry: dict[str, Any] = {
        "name": curve.name,
        "mode": test.mode,
        "units": {
            "displacement": shown.displacement_unit,
            "force": shown.force_unit,
            "stiffness": shown.stiffness_unit.replace("deg", "rad"),
        },
        "preload": preload,
        "amplitude": None if test.amplitude is None else shown.per_internal * test.amplitude,
        "point": "transfer" if test.transfer else "driving",
        "frequency": curve.frequency,
        "stiffness": np.abs(curve.stiffness),
        "storage": curve.stiffness.real,
        "loss": curve.stiffness.imag,
        "loss_angle_deg": np.degrees(curve.loss_angle),
        "reduction_error": curve.reduction_error,
        "reduction_vectors": curve.vectors,
    }
    if test.six is not None and curve.matrix is not None:
        preload["motion"] = {name: _pose(test.six.motion[-1], k) for k, name in enumerate(MOTIONS)}
        entry["motion"] = MOTIONS[test.motion]
        entry["storage_matrix"] = curve.matrix.real.tolist()
        entry["loss_matrix"] = curve.matrix.imag.tolist()
    return entry


def _pose(motion: np.ndarray[Any, Any], k: int) -> float:
    return math.degrees(motion[k]) if k >= 3 else float(motion[k])


def dynamic_text(response: DynamicResponse, fit: Fit | None) -> Group:
    """Return a table for each preload, and the problems.

    Parameters
    ----------
    response : DynamicResponse
    fit : Fit or None
        As for `dynamic_json`.
    """
    parts: list[Any] = [Shown(_table(one)) for one in response.curves]
    parts += problem_parts(response.conditions)
    return Group(*parts)


def _title(curve: DynamicCurve) -> str:
    shown = quantities(_mode(curve))
    point = "transfer" if curve.test.transfer else "driving-point"
    unit = f" {shown.displacement_unit}" if shown.displacement_unit else ""
    preload = (
        f"preload {number(shown.at(curve.preload), 4)}{unit}, {number(curve.force, 4)} {shown.force_unit}"
    )
    vibrating = f", {MOTIONS[curve.test.motion]}" if curve.test.six is not None else ""
    return f"{curve.name}{vibrating}: {point} stiffness, {preload}"


def _table(curve: DynamicCurve) -> ReportTable:
    unit = quantities(_mode(curve)).stiffness_unit.replace("deg", "rad")
    heads = ("frequency", "", "|K*|", "K'", "K''", "", "loss angle", "")
    count = len(curve.frequency)
    shown = np.unique(np.linspace(0, count - 1, min(_ROWS, count)).round().astype(int))

    def row(i: int) -> Row:
        K = curve.stiffness[i]
        moduli = (number(value, 4) for value in (abs(K), K.real, K.imag))
        return (f"{curve.frequency[i]:.4g}", "Hz", *moduli, unit, f"{math.degrees(np.angle(K)):.2f}", "deg")

    return ReportTable(_title(curve), heads, tuple(row(int(i)) for i in shown), left=0)


def write_dynamic(directory: Path, result: Mapping[str, Any], response: DynamicResponse) -> tuple[Path, ...]:
    """Write dynamic stiffness: result.json, and a table of each load case with a row per preload and frequency.

    Parameters
    ----------
    directory : Path
        Created if necessary.
    result : mapping
        What `dynamic_json` returned.
    response : DynamicResponse
        As given to it.

    Raises
    ------
    InputError
        The folder is a file or cannot be written, or a file to be replaced is not bushcli's.
    """
    files: dict[str, Content] = {RESULT: result}
    names = list(dict.fromkeys(curve.name for curve in response.curves))
    for name, file in file_names(names).items():
        files[f"{file}-dynamic.csv"] = number_table(
            *_columns([curve for curve in response.curves if curve.name == name])
        )
    return write_files(directory, files, inputs_of(response.case))


def _columns(curves: list[DynamicCurve]) -> tuple[tuple[str, ...], tuple[np.ndarray[Any, Any], ...]]:
    """Return names and columns of a load case: what `bushcli` reads as a table of a rig."""
    shown = quantities(_mode(curves[0]))
    per, kind = ("mm", "N") if shown.per_internal == 1.0 else ("deg", "Nmm")
    unit = "N_per_mm" if per == "mm" else "Nmm_per_rad"
    if shown.force_unit == "MPa":
        per, kind, unit = "1", "MPa", "MPa"
    moduli = (f"{name}_{unit}" for name in ("stiffness", "storage", "loss"))
    names = ("frequency_Hz", f"preload_{per}", f"preload_{kind}", *moduli, "loss_angle_deg")
    rows = [
        np.column_stack(
            [
                curve.frequency,
                np.full(len(curve.frequency), shown.at(curve.preload)),
                np.full(len(curve.frequency), curve.force),
                np.abs(curve.stiffness),
                curve.stiffness.real,
                curve.stiffness.imag,
                np.degrees(curve.loss_angle),
            ]
        )
        for curve in curves
    ]
    return names, tuple(np.vstack(rows).T)
