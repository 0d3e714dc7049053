"""Dynamic stiffness -> JSON-ready data."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bushcli.report.json.common import cleaned, head, material_json
from bushcli.report.json.fit import fit_part
from bushcli.report.quantity import quantities
from bushcli.report.views.dynamic import stiffness_unit
from cases.six import MOTIONS

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.simulate.dynamic import DynamicResponse
    from bushcli.simulate.vibrations import DynamicCurve


def dynamic_json(response: DynamicResponse, fit: Fit | None) -> dict[str, Any]:
    """Return dynamic stiffness as JSON-ready data.

    Parameters
    ----------
    response : DynamicResponse
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    """
    document = head("dynamic", response.case, response.conditions, response.seconds)
    document["complete"] = response.complete
    document["material"] = material_json(response.material)
    document["load_cases"] = [_curve(one) for one in response.curves]
    if fit is not None:
        document["fit"] = fit_part(fit)
    return cleaned(document)


def _curve(curve: DynamicCurve) -> dict[str, Any]:
    shown, test = quantities(curve.mode), curve.test
    preload: dict[str, Any] = {"displacement": shown.at(curve.preload), "force": curve.force}
    preload["stiffness"] = curve.static
    entry: dict[str, Any] = {
        "name": curve.name,
        "mode": test.mode,
        "units": {
            "displacement": shown.displacement_unit,
            "force": shown.force_unit,
            "stiffness": stiffness_unit(curve.mode),
        },
        "preload": preload,
        "amplitude": None if curve.amplitude is None else shown.per_internal * curve.amplitude,
        "temperature": test.temperature,
        "point": "transfer" if test.transfer else "driving",
        "frequency": curve.frequency,
        "stiffness": np.abs(curve.stiffness),
        "storage": curve.stiffness.real,
        "loss": curve.stiffness.imag,
        "loss_angle_deg": np.degrees(curve.loss_angle),
        "reduction_error": curve.reduction_error,
        "reduction_vectors": curve.vectors,
    }
    if curve.third_harmonic is not None:
        entry["third_harmonic"] = curve.third_harmonic
    if curve.matrix is not None and (pose := test.pose) is not None:
        preload["motion"] = {
            name: math.degrees(pose[k]) if k >= 3 else float(pose[k]) for k, name in enumerate(MOTIONS)
        }
        entry["motion"] = MOTIONS[test.motion]
        entry["storage_matrix"] = curve.matrix.real.tolist()
        entry["loss_matrix"] = curve.matrix.imag.tolist()
    return entry
