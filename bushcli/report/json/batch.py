"""A batch of parts -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.inverse.file_units import in_file_units
from bushcli.report.json.common import cleaned, faults_json, head, part
from bushcli.report.quantity import quantities
from bushcli.report.views.batch import stiffness
from bushcli.study.batch import Batch
from bushcli.study.outliers import CONFIDENCE, CONTENT, FALSE_ALARM


def batch_json(found: Batch) -> dict[str, Any]:
    """Return a batch as JSON-ready data."""
    fit = in_file_units(found.fit)
    document = head("batch", found.case, found.conditions)
    document |= {
        "law": fit.material.law,
        "bulk_modulus": fit.material.bulk_modulus,
        "parameters": {
            name: part(one, "value std lower upper at_bound") for name, one in fit.parameters.items()
        },
        "converged": fit.converged,
        "forward_solves": fit.forward_solves,
        "programs": found.programs,
        "test": {
            "name": "generalised extreme studentised deviate",
            "of": ["logarithm of the stiffness factor", "logarithm of the rms misfit with it"],
            "false_alarm": FALSE_ALARM,
        },
        "parts": [
            {
                **part(one, "name mode factor std deviation rms_percent noise_percent"),
                "stiffness": stiffness(one),
                "own_simulation": one.simulated,
                **part(one, "outlier"),
                "causes": one.causes,
            }
            for one in found.parts
        ],
        "outliers": [one.name for one in found.outliers],
        "curves": [
            {
                **part(one, "mode parts"),
                "stiffness": shown.stiffness(one.mean.secant_stiffness()),
                "scatter_percent": 100.0 * one.scatter,
                "k": one.k,
                "content": CONTENT,
                "confidence": CONFIDENCE,
                "displacement": shown.shown(one.mean.displacement),
                "force": one.mean.force,
                **part(one, "lower upper"),
            }
            for one in found.curves
            for shown in [quantities(one.mode)]
        ],
        "data_faults": faults_json(found.faults),
    }
    return cleaned(document)
