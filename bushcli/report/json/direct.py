"""A direct prediction -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from bushcli.report.cycles import energy_unit
from bushcli.report.json.common import cleaned, faults_json, head, material_json, part
from bushcli.report.json.cycles import history_json
from bushcli.report.json.dynamic import compared_json
from bushcli.report.json.fit import fit_part
from bushcli.report.quantity import Quantities, quantities, shown_motion
from bushcli.report.results import DirectResult
from bushcli.report.verdict import DirectVerdict, all_within_10_percent
from bushcli.report.views.direct import displacement_at
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Simulated


def direct_json(found: DirectResult) -> dict[str, Any]:
    """Return a direct prediction, and the coupon fit that preceded it, as JSON-ready data."""
    response = found.response
    document = head("direct", response.case, found.conditions)
    document["data_faults"] = faults_json(response.faults)
    document["complete"] = response.complete
    document["material"] = material_json(response.material)
    document["verdict"] = _verdict(found.verdict, found.misfits)
    histories = {history.name: history_json(history) for history in found.histories}
    document["load_cases"] = [
        _channel(one, found.misfits.get(one.name)) | histories.get(one.name, {}) for one in response.channels
    ]
    if found.fit is not None:
        document["fit"] = fit_part(found.fit)
    if found.tables is not None:
        document["dynamic"] = compared_json(found.tables)
    return cleaned(document)


def _channel(channel: Simulated, found: Misfit | None) -> dict[str, Any]:
    shown, recorded = quantities(channel.mode), channel.recording
    document: dict[str, Any] = {key: of(channel, shown) for key, of in _CURVE.items()}
    if found is not None:
        document["recording"] = {
            "file": str(recorded.source) if recorded and recorded.source else None,
            "samples": len(recorded.displacement) if recorded else 0,
            **{key: of(found, shown) for key, of in _MISFIT.items()},
        }
    if channel.six is not None:
        six, motion = channel.six, shown_motion(channel.six)
        # The displacement of the leading motion is none of the path.
        del document["displacement"]
        document |= {
            "mode": "path",
            "units": {"motion": "mm, deg", "force": "N, N mm", "stiffness": shown.stiffness_unit},
            "time": six.time,
            "motion": {name: motion[:, k] for k, name in enumerate(MOTIONS)},
            "force": {name: six.force[:, k] for k, name in enumerate(REACTIONS)},
            "free": [MOTIONS[k] for k in six.free if k not in six.loaded],
            **({"by_force": [MOTIONS[k] for k in six.loaded]} if six.loaded else {}),
            "lead": MOTIONS[six.lead],
            "reach": channel.reach if channel.stopped else float(six.time[-1]),
        }
    for state, (displacement, matrix) in (channel.stiffness or {}).items():
        document["stiffness_matrix" if state == "end" else f"stiffness_matrix_{state}"] = matrix
        document["stiffness_matrix_state"] = "unrelaxed" if channel.unrelaxed else "relaxed"
        if state == "at":
            document["stiffness_matrix_at_displacement"] = displacement_at(channel, displacement)
    document["contact"] = [
        {
            "surfaces": one.surfaces,
            "first": displacement_at(channel, one.first),
            "largest_force": one.force,
            "at": displacement_at(channel, one.at),
            **part(one, "radius height"),
        }
        for one in channel.touched
    ]
    return document


# A stretch is given relative to rest, where it is zero, as in the case file's path.
_CURVE: dict[str, Callable[[Simulated, Quantities], Any]] = {
    "name": lambda one, _: one.name,
    "mode": lambda one, _: one.mode,
    "units": lambda one, shown: {
        "displacement": "stretch - 1" if shown.rest else shown.displacement_unit or shown.displacement,
        "force": shown.force_unit,
        "stiffness": shown.stiffness_unit,
        "energy": energy_unit(one.mode),
    },
    "time": lambda one, _: one.curve.time,
    "displacement": lambda one, shown: shown.shown(one.curve.displacement) - shown.rest,
    "force": lambda one, _: one.curve.force,
    "stiffness": lambda one, shown: {
        "initial": shown.stiffness(one.curve.initial_stiffness()),
        "secant": shown.stiffness(one.curve.secant_stiffness()),
    },
    "complete": lambda one, _: not one.stopped,
    "stopped": lambda one, _: one.stopped,
    "reach": lambda one, shown: shown.at(one.reach) - shown.rest,
    "newton_iterations": lambda one, _: one.newton,
    "steps_tried": lambda one, _: len(one.attempts),
    "steps_rejected": lambda one, _: sum(not attempt.accepted for attempt in one.attempts),
    "unknowns": lambda one, _: one.unknowns,
    "principal_stretches": lambda one, _: one.strained.range,
    "unstable_percent": lambda one, _: 100 * one.strained.unstable,
    "mesh_error_percent": lambda one, _: one.mesh_error,
    "seconds": lambda one, _: one.seconds,
}
_MISFIT: dict[str, Callable[[Misfit, Quantities], Any]] = {
    "rms_percent": lambda one, _: one.rms_percent,
    "peak_percent": lambda one, _: one.peak_percent,
    "noise_percent": lambda one, _: one.noise_percent,
    "stiffness_measured": lambda one, shown: shown.stiffness(one.measured.secant),
    "stiffness_simulated": lambda one, shown: shown.stiffness(one.predicted.secant),
    "stiffness_ratio": lambda one, _: one.stiffness_ratio,
    "initial_stiffness_measured": lambda one, shown: shown.stiffness(one.measured.initial),
    "initial_stiffness_simulated": lambda one, shown: shown.stiffness(one.predicted.initial),
    "within_10_percent": lambda one, _: one.within_10_percent,
    "within_tolerance": lambda one, _: one.within,
    "tolerance_percent": lambda one, _: one.tolerance.percent,
    "compared": lambda one, _: one.compared,
    "force_range": lambda one, _: one.force_range,
}


def _verdict(verdict: DirectVerdict, misfits: Mapping[str, Misfit]) -> dict[str, Any]:
    channels: dict[str, Any] = {}
    for channel in verdict.channels:
        found, shown = misfits.get(channel.name), quantities(channel.mode)
        channels[channel.name] = {
            "text": channel.text,
            "within_10_percent": found.within_10_percent if found else None,
            "within_tolerance": channel.within,
        }
        if found is not None:
            keys = ("stiffness_simulated", "stiffness_measured", "stiffness_ratio")
            known = {key: _MISFIT[key](found, shown) for key in keys}
            channels[channel.name] |= known | {"unit": shown.stiffness_unit}
    factor = verdict.single_factor
    return {
        **part(verdict, "headline text"),
        "within_10_percent": all_within_10_percent(verdict, misfits),
        "within_tolerance": verdict.within,
        "channels": channels,
        "single_factor": factor
        and {
            **part(factor, "factor by_channel"),
            "rms_percent_before": factor.rms_before,
            "rms_percent_after": factor.rms_after,
            "explains_most": factor.explains,
        },
    }
