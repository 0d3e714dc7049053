"""A direct prediction -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bushcli.report.cycles import energy_unit
from bushcli.report.json.common import faults_json, material_json, result_json, select
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
    histories = {history.name: history_json(history) for history in result.histories}
    entries = {
        "data_faults": faults_json(response.faults),
        "complete": response.complete,
        "material": material_json(response.material),
        "verdict": _verdict(result.verdict, result.misfits),
        "load_cases": [
            _channel(channel, result.misfits.get(channel.name)) | histories.get(channel.name, {})
            for channel in response.channels
        ],
        **({} if result.fit is None else {"fit": fit_part(result.fit)}),
        **({} if result.tables is None else {"dynamic": compared_json(result.tables)}),
    }
    return result_json("direct", response.case, result.conditions, entries)


def _channel(channel: Simulated, misfit: Misfit | None) -> dict[str, Any]:
    units, curve, recorded = quantities(channel.mode), channel.curve, channel.recording
    # A stretch is given relative to rest, where it is zero, as in the case file's path.
    document: dict[str, Any] = {
        **select(channel, "name mode"),
        "units": {
            "displacement": "stretch - 1" if units.rest else units.displacement_unit or units.displacement,
            "force": units.force_unit,
            "stiffness": units.stiffness_unit,
            "energy": energy_unit(channel.mode),
        },
        "time": curve.time,
        "displacement": units.convert(curve.displacement) - units.rest,
        "force": curve.force,
        "stiffness": {
            "initial": units.stiffness(curve.initial_stiffness()),
            "secant": units.stiffness(curve.secant_stiffness()),
        },
        "complete": not channel.stopped,
        "stopped": channel.stopped,
        "reach": units.at(channel.reach) - units.rest,
        "newton_iterations": channel.newton,
        "steps_tried": len(channel.attempts),
        "steps_rejected": sum(not attempt.accepted for attempt in channel.attempts),
        "unknowns": channel.unknowns,
        "principal_stretches": channel.strained.range,
        "unstable_percent": 100 * channel.strained.unstable,
        "mesh_error_percent": channel.mesh_error,
        "seconds": channel.seconds,
    }
    if misfit is not None:
        document["recording"] = {
            "file": str(recorded.source) if recorded and recorded.source else None,
            "samples": len(recorded.displacement) if recorded else 0,
            **select(misfit, "rms_percent peak_percent noise_percent"),
            **_stiffnesses(misfit, units),
            "initial_stiffness_measured": units.stiffness(misfit.measured.initial),
            "initial_stiffness_simulated": units.stiffness(misfit.predicted.initial),
            "within_10_percent": misfit.within_10_percent,
            "within_tolerance": misfit.within,
            "tolerance_percent": misfit.tolerance.percent,
            **select(misfit, "compared force_range"),
        }
    if channel.six is not None:
        six, motion = channel.six, shown_motion(channel.six)
        # The displacement of the leading motion is none of the path.
        del document["displacement"]
        document |= {
            "mode": "path",
            "units": {"motion": "mm, deg", "force": "N, N mm", "stiffness": units.stiffness_unit},
            "time": six.time,
            "motion": dict(zip(MOTIONS, motion.T, strict=True)),
            "force": dict(zip(REACTIONS, six.force.T, strict=True)),
            "free": [MOTIONS[k] for k in six.free if k not in six.loaded],
            **({"by_force": [MOTIONS[k] for k in six.loaded]} if six.loaded else {}),
            "lead": MOTIONS[six.lead],
            "reach": channel.reach if channel.stopped else six.time[-1],
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


def _stiffnesses(misfit: Misfit, units: Quantities) -> dict[str, float]:
    return {
        "stiffness_measured": units.stiffness(misfit.measured.secant),
        "stiffness_simulated": units.stiffness(misfit.predicted.secant),
        "stiffness_ratio": misfit.stiffness_ratio,
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
            simulated = {"stiffness_simulated": units.stiffness(misfit.predicted.secant)}  # stands first here
            channels[channel.name] |= simulated | _stiffnesses(misfit, units) | {"unit": units.stiffness_unit}
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
