"""A batch of parts -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.inverse.file_units import in_file_units
from bushcli.report.json.common import faults_json, result_json, select
from bushcli.report.quantity import quantities
from bushcli.report.views.batch import stiffness
from bushcli.study.batch import Batch
from bushcli.study.outliers import CONFIDENCE, CONTENT, FALSE_ALARM


def batch_json(batch: Batch) -> dict[str, Any]:
    """Return a batch as JSON-ready data."""
    fit = in_file_units(batch.fit)
    entries = {
        **select(fit.material, "law bulk_modulus"),
        "parameters": {
            name: select(estimate, "value std lower upper at_bound")
            for name, estimate in fit.parameters.items()
        },
        **select(fit, "converged forward_solves"),
        "programs": batch.programs,
        "test": {
            "name": "generalised extreme studentised deviate",
            "of": ["logarithm of the stiffness factor", "logarithm of the rms misfit with it"],
            "false_alarm": FALSE_ALARM,
        },
        "parts": [
            {
                **select(member, "name mode factor std deviation rms_percent noise_percent"),
                "stiffness": stiffness(member),
                "own_simulation": member.simulated,
                **select(member, "outlier causes"),
            }
            for member in batch.parts
        ],
        "outliers": [member.name for member in batch.outliers],
        "curves": [
            {
                **select(curve, "mode parts"),
                "stiffness": units.stiffness(curve.mean.secant_stiffness()),
                "scatter_percent": 100.0 * curve.scatter,
                "k": curve.k,
                "content": CONTENT,
                "confidence": CONFIDENCE,
                "displacement": units.convert(curve.mean.displacement),
                "force": curve.mean.force,
                **select(curve, "lower upper"),
            }
            for curve in batch.curves
            for units in [quantities(curve.mode)]
        ],
        "data_faults": faults_json(batch.faults),
    }
    return result_json("batch", batch.case, batch.conditions, entries)
