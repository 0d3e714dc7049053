"""Identified laws -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.report.json.common import faults_json, result_json, select
from bushcli.report.json.cycles import history_json
from bushcli.report.json.dynamic import compared_json
from bushcli.report.json.fit import curves_by_mode, fit_part
from bushcli.report.ranking import effective_samples, information_criterion
from bushcli.report.results import InverseResult
from bushcli.report.views.inverse import answer


def inverse_json(result: InverseResult) -> dict[str, Any]:
    """Return identified laws as JSON-ready data; the entries at the top level describe the best law."""
    fits, best = result.fits, result.best_fit
    entries = fit_part(best) | {
        "data_faults": faults_json(best.faults),
        "verdict": select(answer(best), "headline text"),
        "misfit": {
            key: {
                "rms_percent": curve.rms_percent,
                "before_percent": curve.started_percent,
                **select(curve, "noise_percent held_out"),
            }
            for key, curve in curves_by_mode(best).items()
        },
        "channels": {history.name: history_json(history) for history in result.histories},
        **select(best, "method message cost"),
        "bic": information_criterion(best),
        "effective_samples": sum(effective_samples(c) for c in best.curves if not c.held_out),
        **({"dynamic": compared_json(best.tables)} if best.tables else {}),
        **select(best, "leverage profile_sweeps end_points profiles"),
        "evaluations": [vars(evaluation) | {"step": None, "radius": None} for evaluation in best.evaluations],
    }
    del entries["weighting"]
    if len(fits) > 1:
        entries["models"] = [
            {
                "law": fit.material.law,
                "number_of_parameters": len(fit.parameters),
                "parameters": {name: estimate.value for name, estimate in fit.parameters.items()},
                "misfit": {key: c.rms_percent for key, c in curves.items() if not c.held_out},
                "held_out": {key: c.rms_percent for key, c in curves.items() if c.held_out},
                "cost": fit.cost,
                "bic": information_criterion(fit),
                **select(fit, "converged sweeps forward_solves failed_solves seconds"),
                "problems": [condition.name for condition in fit.conditions],
            }
            for fit in fits
            for curves in [curves_by_mode(fit)]
        ]
    return result_json("inverse", result.case, result.conditions, entries)
