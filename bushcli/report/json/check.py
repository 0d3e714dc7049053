"""A checked case and the protocol of its tests -> JSON-ready data."""

from __future__ import annotations

from typing import Any

import numpy as np

from bushcli.recording import Recording
from bushcli.report.json.common import faults_json, result_json, select
from bushcli.report.json.dynamic import table_json
from bushcli.report.quantity import quantities
from bushcli.report.results import CheckResult


def check_json(checked: CheckResult) -> dict[str, Any]:
    """Return a checked case, the contents of its recordings, their faults and their protocol as JSON-ready data."""
    tests = checked.tests
    entries = {
        "data_faults": faults_json(checked.faults),
        "recordings": [_summary(curve) for curve in checked.curves],
        "coupons": [_summary(curve) for curve in checked.coupons],
        **({"dynamic": [table_json(table) for table in checked.tables]} if checked.tables else {}),
        "protocol": [
            {
                "channel": test.channel,
                "cycles": len(test.compared),
                "conditioning": test.conditioning,
                "amplitudes": [per * value for value in test.compared],
                "conditioning_amplitudes": [per * value for value in test.amplitudes[: test.conditioning]],
                "rates": [per * rate for rate in test.rates],
                "holds_s": test.holds,
                "rests_s": test.rests,
                "pauses_s": test.pauses,
                **select(test, "timed from_rest unloads"),
            }
            for test in (*tests.recordings, *tests.coupons)
            for per in [quantities(test.mode).per_internal]
        ],
        "standards": [
            {"channel": channel, "standard": name, "clauses": clauses}
            for channel, name, clauses in tests.judged
        ],
        "open_questions": tests.lacks,
        "sources": [{"channel": file.name, **select(file, "columns unused")} for file in tests.files],
        "remarks": [{"channel": channel, "text": text} for channel, text in tests.remarks],
    }
    return result_json("check", checked.case, checked.conditions, entries)


def _summary(curve: Recording) -> dict[str, Any]:
    units = quantities(curve.mode)
    return {
        **select(curve, "name mode"),
        "file": str(curve.source) if curve.source else None,
        "samples": len(curve.displacement),
        "cycles": len({branch.cycle for branch in curve.branches}),
        "holds": sum(branch.kind == "hold" for branch in curve.branches),
        "duration_s": None if curve.time is None else np.ptp(curve.time),
        "units": {"displacement": units.displacement_unit or units.displacement, "force": units.force_unit},
        "displacement": [units.at(q) for q in (curve.displacement.min(), curve.displacement.max())],
        "force": [curve.force.min(), curve.force.max()],
        "noise_percent": 100 * curve.force_noise / np.ptp(curve.force),
    }
