"""A study of many designs -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.report.json.common import cleaned, head, part
from bushcli.report.json.direct import direct_json
from bushcli.report.results import DirectResult, StudyResult
from bushcli.simulate.misfit import misfits
from bushcli.simulate.response import Response


def described(response: Response) -> Mapping[str, Any]:
    """Return the result of a design as from `bushcli direct`, for answers that are keys of it."""
    return direct_json(DirectResult(response, misfits(response)))


def study_json(result: StudyResult) -> dict[str, Any]:
    """Return a study as JSON-ready data."""
    found = result.study
    document = head("study", found.case, found.conditions)
    document |= {
        "sampling": found.plan.sampling,
        "designs": len(found.plan.rows),
        **part(found, "failed resumed"),
        "seconds_of_designs": found.seconds,
        "variables": {one.key: part(one, "spec low high nominal") for one in found.plan.variables},
        "failures": found.failures,
        "answers": {},
    }
    units = {one.name: one.unit for one in found.task.answers}
    for name, one in found.summaries.items():
        document["answers"][name] = {
            "unit": units[name],
            **part(one, "count mean std"),
            **{f"p{level:02d}": value for level, value in zip((5, 50, 95), one.quantiles, strict=True)},
            "worst": {"lowest": one.lowest, "highest": one.highest},
            "linear_share": one.linear,
            # Sobol indices that were not calculated are nan.
            "influences": {
                key: {k: v for k, v in vars(influence).items() if v == v}
                for key, influence in one.influences.items()
            },
        }
        if (limits := one.limits) is not None:
            document["answers"][name] |= {
                "limits": part(limits, "low high"),
                "yield": {"share": limits.share, "lower": limits.interval[0], "upper": limits.interval[1]},
            }
    return cleaned(document)
