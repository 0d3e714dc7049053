"""A direct prediction -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bushcli.report.cycles import by_name, energy_unit, response_histories
from bushcli.report.json.common import cleaned, faults_json, head, material_json, part
from bushcli.report.json.cycles import history_json
from bushcli.report.json.fit import fit_part
from bushcli.report.quantity import quantities, shown_motion
from bushcli.report.verdict import Verdict, all_within_10_percent, judge
from bushcli.report.views.direct import displacement_at, problems_of
from cases.mode import modes
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response, Simulated


def direct_json(response: Response, misfits: Mapping[str, Misfit], fit: Fit | None) -> dict[str, Any]:
    """Return a direct prediction, and the coupon fit that preceded it, as JSON-ready data.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    """
    document = head("direct", response.case, problems_of(response, misfits, fit))
    document["data_faults"] = faults_json(response.faults)
    document["complete"] = response.complete
    document["material"] = material_json(response.material)
    document["verdict"] = _verdict(judge(response, misfits), misfits)
    document["load_cases"] = [_channel(c, misfits.get(c.name)) for c in response.channels]
    histories = by_name(response_histories(response, misfits))
    for entry in (one for one in document["load_cases"] if one["name"] in histories):
        entry |= history_json(histories[entry["name"]])
    if fit is not None:
        document["fit"] = fit_part(fit)
    return cleaned(document)


def _channel(channel: Simulated, found: Misfit | None) -> dict[str, Any]:
    shown = quantities(channel.mode)
    coupon = modes()[channel.mode].specimen == "coupon"
    document: dict[str, Any] = {
        "name": channel.name,
        "mode": channel.mode,
        "units": {
            "displacement": "stretch - 1"
            if coupon and shown.rest
            else shown.displacement_unit or shown.displacement,
            "force": shown.force_unit,
            "stiffness": shown.stiffness_unit,
            "energy": energy_unit(channel.mode),
        },
        "time": channel.curve.time,
        # A stretch is given relative to rest, where it is zero, as in the case file's path; that of the leading one of
        # six motions is no displacement of the path.
        **({} if channel.six else {"displacement": shown.shown(channel.curve.displacement) - shown.rest}),
        "force": channel.curve.force,
        "stiffness": {
            "initial": shown.stiffness(channel.curve.initial_stiffness()),
            "secant": shown.stiffness(channel.curve.secant_stiffness()),
        },
        "complete": not channel.stopped,
        "stopped": channel.stopped,
        "reach": shown.at(channel.reach) - shown.rest,
        "newton_iterations": channel.newton,
        "steps_tried": len(channel.attempts),
        "steps_rejected": sum(not attempt.accepted for attempt in channel.attempts),
        "unknowns": channel.unknowns,
        "principal_stretches": list(channel.strained.range),
        "unstable_percent": 100 * channel.strained.unstable,
        "mesh_error_percent": channel.mesh_error,
        "seconds": dict(channel.seconds),
    }
    if found is not None:
        source = channel.recording.source if channel.recording else None
        document["recording"] = {
            "file": str(source) if source else None,
            "samples": len(channel.recording.displacement) if channel.recording else 0,
            **part(found, "rms_percent peak_percent noise_percent"),
            "stiffness_measured": shown.stiffness(found.measured.secant),
            "stiffness_simulated": shown.stiffness(found.predicted.secant),
            "stiffness_ratio": found.stiffness_ratio,
            "initial_stiffness_measured": shown.stiffness(found.measured.initial),
            "initial_stiffness_simulated": shown.stiffness(found.predicted.initial),
            "within_10_percent": found.within_10_percent,
            "within_tolerance": found.within,
            "tolerance_percent": found.tolerance.percent,
            **part(found, "compared force_range"),
        }
    document |= _six(channel)
    document["contact"] = [
        {
            "surfaces": one.surfaces,
            "first": one.first if channel.in_time else shown.at(one.first),
            "largest_force": one.force,
            "at": one.at if channel.in_time else shown.at(one.at),
            **part(one, "radius height"),
        }
        for one in channel.touched
    ]
    return document


def _six(channel: Simulated) -> dict[str, Any]:
    """Return motions, reactions and stiffness matrices of a channel as JSON-ready data, where there are any."""
    document: dict[str, Any] = {}
    if channel.six is not None:
        six, motion = channel.six, shown_motion(channel.six)
        document = {
            "mode": "path",
            "units": {
                "motion": "mm, deg",
                "force": "N, N mm",
                "stiffness": quantities(channel.mode).stiffness_unit,
            },
            "time": six.time,
            "motion": {name: motion[:, k] for k, name in enumerate(MOTIONS)},
            "force": {name: six.force[:, k] for k, name in enumerate(REACTIONS)},
            "free": [MOTIONS[k] for k in six.free if k not in six.loaded],
            **({"by_force": [MOTIONS[k] for k in six.loaded]} if six.loaded else {}),
            "lead": MOTIONS[six.lead],
            "reach": channel.reach if channel.stopped else float(six.time[-1]),
        }
    for state, (displacement, matrix) in (channel.stiffness or {}).items():
        name = "stiffness_matrix" if state == "end" else f"stiffness_matrix_{state}"
        document[name] = matrix.tolist()
        document["stiffness_matrix_state"] = "unrelaxed" if channel.unrelaxed else "relaxed"
        if state == "at":
            document["stiffness_matrix_at_displacement"] = displacement_at(channel, displacement)
    return document


def _verdict(verdict: Verdict, misfits: Mapping[str, Misfit]) -> dict[str, Any]:
    document: dict[str, Any] = {
        **part(verdict, "headline text"),
        "within_10_percent": all_within_10_percent(verdict, misfits),
        "within_tolerance": verdict.within,
        "channels": {},
        "single_factor": None,
    }
    for channel in verdict.channels:
        found = misfits.get(channel.name)
        entry: dict[str, Any] = {
            "text": channel.text,
            "within_10_percent": found.within_10_percent if found else None,
            "within_tolerance": channel.within,
        }
        if found is not None:
            shown = quantities(channel.mode)
            entry |= {
                "stiffness_simulated": shown.stiffness(found.predicted.secant),
                "stiffness_measured": shown.stiffness(found.measured.secant),
                "stiffness_ratio": found.stiffness_ratio,
                "unit": shown.stiffness_unit,
            }
        document["channels"][channel.name] = entry
    factor = verdict.single_factor
    if factor is not None:
        document["single_factor"] = {
            **part(factor, "factor by_channel"),
            "rms_percent_before": factor.rms_before,
            "rms_percent_after": factor.rms_after,
            "explains_most": factor.explains,
        }
    return document
