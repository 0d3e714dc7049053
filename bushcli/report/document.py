"""Result -> JSON, on which scripts rely. It has JSON's own types only: nan becomes null, infinity "inf"."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bushcli.case import Case, resolved
from bushcli.case.typical import unusual
from bushcli.faults import DataFault, condition
from bushcli.recording import Recording, branches, force_noise
from bushcli.report.contact import contact_json
from bushcli.report.cycles import (
    by_name,
    energy_unit,
    history_json,
    response_histories,
    with_hysteresis,
)
from bushcli.report.fit_part import fit_part
from bushcli.report.quantity import quantities
from bushcli.report.six import six_json
from bushcli.report.verdict import Verdict, all_within_10_percent, judge
from bushcli.report.versions import versions
from bushcli.runtime.condition import Condition
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response, Simulated


def direct_json(
    response: Response, misfits: Mapping[str, Misfit], fit: Fit | None, timings: Mapping[str, float]
) -> dict[str, Any]:
    """Return a direct prediction, and the coupon fit that preceded it, as JSON-ready data.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("direct", response.case, problems_of(response, misfits, fit), timings)
    document["data_faults"] = faults_json(response.faults)
    document["complete"] = response.complete
    document["material"] = {
        "law": response.material.law,
        "bulk_modulus": response.material.bulk_modulus,
        "parameters": dict(response.material.parameters),
    }
    document["verdict"] = _verdict(judge(response, misfits), misfits)
    document["load_cases"] = [_channel(c, misfits.get(c.name)) for c in response.channels]
    histories = by_name(response_histories(response, misfits))
    for entry in (one for one in document["load_cases"] if one["name"] in histories):
        entry |= history_json(histories[entry["name"]])
    if fit is not None:
        document["fit"] = fit_part(fit)
    return cleaned(document)


def fit_json(case: Case, fit: Fit, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return an identified law as JSON-ready data.

    Parameters
    ----------
    case : Case
        The case with the coupon tests.
    fit : Fit
        The identified law.
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("fit", case, fit.conditions, timings) | {"data_faults": faults_json(fit.faults)}
    return cleaned(document | fit_part(fit))


def case_json(
    case: Case,
    curves: Sequence[Recording],
    coupons: Sequence[Recording],
    timings: Mapping[str, float],
    faults: Sequence[DataFault] = (),
) -> dict[str, Any]:
    """Return a checked case, the contents of its recordings and their faults as JSON-ready data.

    Parameters
    ----------
    case : Case
        The validated case.
    curves : sequence of Recording
        Recordings of the bushing.
    coupons : sequence of Recording
        Coupon tests.
    timings : mapping of str to float
        Seconds by stage.
    faults : sequence of DataFault
        Faults of recordings and coupon tests.
    """
    document = head("check", case, map(condition, faults), timings)
    document["data_faults"] = faults_json(faults)
    document["recordings"] = [_summary(curve) for curve in curves]
    document["coupons"] = [_summary(curve) for curve in coupons]
    return cleaned(document)


def mesh_json(case: Case, meshes: Sequence[Meshed], timings: Mapping[str, float]) -> dict[str, Any]:
    """Return the meshes of a case as JSON-ready data.

    Parameters
    ----------
    case : Case
        The validated case.
    meshes : sequence of Meshed
        Its meshes, in the order of the tables.
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("mesh", case, unusual(case, case.material), timings)
    document["geometry"] = {"notes": list(case.geometry.notes), "measures": dict(case.geometry.measures())}
    document["meshes"] = [
        {
            "name": mesh.name,
            "modes": list(mesh.modes),
            "dimension": mesh.dimension,
            "cells": mesh.cells,
            "nodes": mesh.nodes,
            "boundaries": dict(mesh.boundaries),
            "regions": dict(mesh.regions),
        }
        for mesh in meshes
    ]
    return cleaned(document)


def problems_of(response: Response, misfits: Mapping[str, Misfit], fit: Fit | None) -> tuple[Condition, ...]:
    """Return the conditions of a direct prediction.

    These are problems of the coupon fit and of the marches, recordings that were not compared, and recorded loops
    that are not simulated.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    """
    left = tuple(
        Condition(
            "not_compared",
            f"{channel.name}: the simulation ended before the recording could be compared with it",
            "see why the simulation stopped",
        )
        for channel in response.channels
        if channel.recording is not None and channel.name not in misfits
    )
    recorded = (channel.recording for channel in response.channels if channel.recording is not None)
    odd = unusual(
        response.case,
        response.material,
        [(one.name, one.mode, one.displacement, one.time) for one in recorded if one.six is None],
    )
    known = (*(fit.conditions if fit else ()), *response.conditions, *left, *odd)
    return with_hysteresis(known, response_histories(response, misfits))


def head(
    command: str, case: Case, problems: Iterable[Condition], timings: Mapping[str, float]
) -> dict[str, Any]:
    """Return the entries that every result has.

    Parameters
    ----------
    command : str
        Name of the command: "direct", "inverse".
    case : Case
        The validated case.
    problems : iterable of Condition
        Conditions of the result.
    timings : mapping of str to float
        Seconds by stage.
    """
    return {
        "command": command,
        "case": resolved(case),
        "versions": versions(),
        "timings_s": dict(timings),
        "problems": [{"name": p.name, "message": p.message, "remedy": p.remedy} for p in problems],
    }


def faults_json(faults: Iterable[DataFault]) -> list[dict[str, Any]]:
    """Return faults of recordings as JSON-ready data."""
    return [
        {
            "channel": fault.channel,
            "kind": fault.kind,
            "where": fault.where,
            "remedy": fault.remedy,
            "fatal": fault.fatal,
            "probability": fault.probability,
            "samples": int(np.count_nonzero(fault.samples)),
        }
        for fault in faults
    ]


def _summary(curve: Recording) -> dict[str, Any]:
    shown = quantities(curve.mode)
    found = branches(curve)
    return {
        "name": curve.name,
        "mode": curve.mode,
        "file": str(curve.source) if curve.source else None,
        "samples": len(curve.displacement),
        "cycles": len({branch.cycle for branch in found}),
        "holds": sum(branch.kind == "hold" for branch in found),
        "duration_s": None if curve.time is None else float(np.ptp(curve.time)),
        "units": {"displacement": shown.displacement_unit or shown.displacement, "force": shown.force_unit},
        "displacement": [shown.at(q) for q in (curve.displacement.min(), curve.displacement.max())],
        "force": [float(curve.force.min()), float(curve.force.max())],
        "noise_percent": 100 * force_noise(curve) / float(np.ptp(curve.force)),
    }


def _channel(channel: Simulated, found: Misfit | None) -> dict[str, Any]:
    shown = quantities(channel.mode)
    coupon = modes()[channel.mode].specimen == "coupon"
    rejected = sum(not attempt.accepted for attempt in channel.attempts)
    document = {
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
        # A stretch is given relative to rest, where it is zero, as in the case file's path.
        "displacement": shown.shown(channel.curve.displacement) - shown.rest,
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
        "steps_rejected": rejected,
        "unknowns": channel.unknowns,
        "principal_stretches": list(channel.strained.range),
        "unstable_percent": 100 * channel.strained.unstable,
        "mesh_error_percent": channel.mesh_error,
        "seconds": dict(channel.seconds),
    }
    if found is not None:
        document["recording"] = _recording(channel, found)
    if channel.six is not None:
        # It is that of the leading motion; six motions have no single displacement.
        document.pop("displacement")
    return document | six_json(channel) | contact_json(channel)


def _recording(channel: Simulated, found: Misfit) -> dict[str, Any]:
    shown = quantities(channel.mode)
    source = channel.recording.source if channel.recording else None
    return {
        "file": str(source) if source else None,
        "samples": len(channel.recording.displacement) if channel.recording else 0,
        "rms_percent": found.rms_percent,
        "peak_percent": found.peak_percent,
        "noise_percent": found.noise_percent,
        "stiffness_measured": shown.stiffness(found.measured.secant),
        "stiffness_simulated": shown.stiffness(found.predicted.secant),
        "stiffness_ratio": found.stiffness_ratio,
        "initial_stiffness_measured": shown.stiffness(found.measured.initial),
        "initial_stiffness_simulated": shown.stiffness(found.predicted.initial),
        "within_10_percent": found.within_10_percent,
        "within_tolerance": found.within,
        "tolerance_percent": found.tolerance.percent,
        "compared": found.compared,
        "force_range": found.force_range,
    }


def _verdict(verdict: Verdict, misfits: Mapping[str, Misfit]) -> dict[str, Any]:
    document: dict[str, Any] = {
        "headline": verdict.headline,
        "text": verdict.text,
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
            "factor": factor.factor,
            "by_channel": dict(factor.by_channel),
            "rms_percent_before": dict(factor.rms_before),
            "rms_percent_after": dict(factor.rms_after),
            "explains_most": factor.explains,
        }
    return document


def cleaned(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with JSON's own types only."""
    clean = _clean(document)
    assert isinstance(clean, dict)
    return clean


def _clean(value: Any) -> Any:
    """Convert arrays to lists, NumPy scalars to Python's, nan to None, infinities to text."""
    if isinstance(value, Mapping):
        return {str(key): _clean(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _clean(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_clean(item) for item in value]
    if isinstance(value, np.generic):
        return _clean(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value
