"""A study of many designs -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.report.json.common import result_json, select
from bushcli.report.json.direct import direct_json
from bushcli.report.results import DirectResult, StudyResult
from bushcli.simulate.misfit import misfits
from bushcli.simulate.response import Response


def response_json(response: Response) -> Mapping[str, Any]:
    """Return the result of a design as from `bushcli direct`, for answers that are keys of it."""
    return direct_json(DirectResult(response, misfits(response)))


def study_json(result: StudyResult) -> dict[str, Any]:
    """Return a study as JSON-ready data."""
    study = result.study
    units, answers = {answer.name: answer.unit for answer in study.task.answers}, {}
    for name, summary in study.summaries.items():
        answers[name] = {
            "unit": units[name],
            **select(summary, "count mean std"),
            **{f"p{q:02d}": value for q, value in zip((5, 50, 95), summary.quantiles, strict=True)},
            "worst": {"lowest": summary.lowest, "highest": summary.highest},
            "linear_share": summary.linear,
            # Sobol indices that were not calculated are nan.
            "influences": {
                key: {k: v for k, v in vars(influence).items() if v == v}
                for key, influence in summary.influences.items()
            },
        }
        if (limits := summary.limits) is not None:
            answers[name] |= {
                "limits": select(limits, "low high"),
                "yield": {"share": limits.share, "lower": limits.interval[0], "upper": limits.interval[1]},
            }
    entries = {
        "sampling": study.plan.sampling,
        "designs": len(study.plan.rows),
        **select(study, "failed resumed"),
        "seconds_of_designs": study.seconds,
        "variables": {
            variable.key: select(variable, "spec low high nominal") for variable in study.plan.variables
        },
        "failures": study.failures,
        "answers": answers,
    }
    return result_json("study", study.case, study.conditions, entries)
