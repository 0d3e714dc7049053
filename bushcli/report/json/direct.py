"""A direct prediction -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from bushcli.report.cycles import energy_unit
from bushcli.report.json.common import faults_json, head, json_value, material_json, select
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


def direct_json(result: DirectResult) -> dict[str, Any]:
    """Return a direct prediction, and the coupon fit that preceded it, as JSON-ready data."""
    response = result.response
    document = head("direct", response.case, result.conditions)
    document["data_faults"] = faults_json(response.faults)
    document["complete"] = response.complete
    document["material"] = material_json(response.material)
    document["verdict"] = _verdict(result.verdict, result.misfits)
    histories = {history.name: history_json(history) for history in result.histories}
    document["load_cases"] = [
        _channel(channel, result.misfits.get(channel.name)) | histories.get(channel.name, {})
        for channel in response.channels
    ]
    if result.fit is not None:
        document["fit"] = fit_part(result.fit)
    if result.tables is not None:
        document["dynamic"] = compared_json(result.tables)
    return json_value(document)


def _channel(channel: Simulated, misfit: Misfit | None) -> dict[str, Any]:
    units, recorded = quantities(channel.mode), channel.recording
    document: dict[str, Any] = {key: entry(channel, units) for key, entry in _CURVE.items()}
    if misfit is not None:
        document["recording"] = {
            "file": str(recorded.source) if recorded and recorded.source else None,
            "samples": len(recorded.displacement) if recorded else 0,
            **{key: entry(misfit, units) for key, entry in _MISFIT.items()},
        }
    if channel.six is not None:
        six, motion = channel.six, shown_motion(channel.six)
        # The displacement of the leading motion is none of the path.
        del document["displacement"]
        document |= {
            "mode": "path",
            "units": {"motion": "mm, deg", "force": "N, N mm", "stiffness": units.stiffness_unit},
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
            "surfaces": contact.surfaces,
            "first": displacement_at(channel, contact.first),
            "largest_force": contact.force,
            "at": displacement_at(channel, contact.at),
            **select(contact, "radius height"),
        }
        for contact in channel.touched
    ]
    return document


# A stretch is given relative to rest, where it is zero, as in the case file's path.
_CURVE: dict[str, Callable[[Simulated, Quantities], Any]] = {
    "name": lambda channel, _: channel.name,
    "mode": lambda channel, _: channel.mode,
    "units": lambda channel, units: {
        "displacement": "stretch - 1" if units.rest else units.displacement_unit or units.displacement,
        "force": units.force_unit,
        "stiffness": units.stiffness_unit,
        "energy": energy_unit(channel.mode),
    },
    "time": lambda channel, _: channel.curve.time,
    "displacement": lambda channel, units: units.shown_displacement(channel.curve.displacement) - units.rest,
    "force": lambda channel, _: channel.curve.force,
    "stiffness": lambda channel, units: {
        "initial": units.stiffness(channel.curve.initial_stiffness()),
        "secant": units.stiffness(channel.curve.secant_stiffness()),
    },
    "complete": lambda channel, _: not channel.stopped,
    "stopped": lambda channel, _: channel.stopped,
    "reach": lambda channel, units: units.at(channel.reach) - units.rest,
    "newton_iterations": lambda channel, _: channel.newton,
    "steps_tried": lambda channel, _: len(channel.attempts),
    "steps_rejected": lambda channel, _: sum(not attempt.accepted for attempt in channel.attempts),
    "unknowns": lambda channel, _: channel.unknowns,
    "principal_stretches": lambda channel, _: channel.strained.range,
    "unstable_percent": lambda channel, _: 100 * channel.strained.unstable,
    "mesh_error_percent": lambda channel, _: channel.mesh_error,
    "seconds": lambda channel, _: channel.seconds,
}
_MISFIT: dict[str, Callable[[Misfit, Quantities], Any]] = {
    "rms_percent": lambda misfit, _: misfit.rms_percent,
    "peak_percent": lambda misfit, _: misfit.peak_percent,
    "noise_percent": lambda misfit, _: misfit.noise_percent,
    "stiffness_measured": lambda misfit, units: units.stiffness(misfit.measured.secant),
    "stiffness_simulated": lambda misfit, units: units.stiffness(misfit.predicted.secant),
    "stiffness_ratio": lambda misfit, _: misfit.stiffness_ratio,
    "initial_stiffness_measured": lambda misfit, units: units.stiffness(misfit.measured.initial),
    "initial_stiffness_simulated": lambda misfit, units: units.stiffness(misfit.predicted.initial),
    "within_10_percent": lambda misfit, _: misfit.within_10_percent,
    "within_tolerance": lambda misfit, _: misfit.within,
    "tolerance_percent": lambda misfit, _: misfit.tolerance.percent,
    "compared": lambda misfit, _: misfit.compared,
    "force_range": lambda misfit, _: misfit.force_range,
}


def _verdict(verdict: DirectVerdict, misfits: Mapping[str, Misfit]) -> dict[str, Any]:
    channels: dict[str, Any] = {}
    for channel in verdict.channels:
        misfit, units = misfits.get(channel.name), quantities(channel.mode)
        channels[channel.name] = {
            "text": channel.text,
            "within_10_percent": misfit.within_10_percent if misfit else None,
            "within_tolerance": channel.within,
        }
        if misfit is not None:
            keys = ("stiffness_simulated", "stiffness_measured", "stiffness_ratio")
            stiffnesses = {key: _MISFIT[key](misfit, units) for key in keys}
            channels[channel.name] |= stiffnesses | {"unit": units.stiffness_unit}
    factor = verdict.single_factor
    return {
        **select(verdict, "headline text"),
        "within_10_percent": all_within_10_percent(verdict, misfits),
        "within_tolerance": verdict.within,
        "channels": channels,
        "single_factor": factor
        and {
            **select(factor, "factor by_channel"),
            "rms_percent_before": factor.rms_before,
            "rms_percent_after": factor.rms_after,
            "explains_most": factor.explains,
        },
    }
