"""A checked case and the protocol of its tests -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bushcli.recording import Recording, branches, force_noise
from bushcli.report.json.common import cleaned, faults_json, head, part
from bushcli.report.json.dynamic_tables import dynamic_tables_json
from bushcli.report.quantity import quantities
from bushcli.report.views.check import Checked
from bushcli.standards import Observed
from bushcli.standards.protocol import Protocol


def check_json(found: Checked, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a checked case, the contents of its recordings, their faults and their protocol as JSON-ready data.

    Parameters
    ----------
    found : Checked
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("check", found.case, found.conditions, timings)
    document["data_faults"] = faults_json(found.faults)
    document["recordings"] = [_summary(curve) for curve in found.curves]
    document["coupons"] = [_summary(curve) for curve in found.coupons]
    if found.tables:
        document["dynamic"] = dynamic_tables_json(found.tables)
    return cleaned(document | _protocol(found.tests))


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


def _protocol(found: Protocol) -> dict[str, Any]:
    return {
        "protocol": [_observed(one) for one in (*found.recordings, *found.coupons)],
        "standards": [
            {"channel": channel, "standard": name, "clauses": [vars(clause) for clause in asked]}
            for channel, name, asked in found.judged
        ],
        "open_questions": [vars(lack) | {"channels": list(lack.channels)} for lack in found.lacks],
        "sources": [
            {
                "channel": one.name,
                "columns": [vars(column) for column in one.columns],
                "unused": list(one.unused),
            }
            for one in found.files
        ],
        "remarks": [{"channel": channel, "text": text} for channel, text in found.remarks],
    }


def _observed(one: Observed) -> dict[str, Any]:
    shown = quantities(one.mode)
    return {
        "channel": one.channel,
        "cycles": len(one.compared),
        "conditioning": one.conditioning,
        "amplitudes": [shown.per_internal * value for value in one.compared],
        "conditioning_amplitudes": [
            shown.per_internal * value for value in one.amplitudes[: one.conditioning]
        ],
        "rates": [shown.per_internal * rate for rate in one.rates],
        "holds_s": list(one.holds),
        "rests_s": list(one.rests),
        "pauses_s": list(one.pauses),
        **part(one, "timed from_rest unloads"),
    }
