"""A study of many designs -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.report.json.common import cleaned, head, part
from bushcli.report.json.direct import direct_json
from bushcli.report.results import DirectResult
from bushcli.simulate.misfit import misfits
from bushcli.simulate.response import Response
from bushcli.study.analysis import Summary
from bushcli.study.study import Study


def described(response: Response) -> Mapping[str, Any]:
    """Return the result of a design as from `bushcli direct`, for answers that are keys of it."""
    return direct_json(DirectResult(response, misfits(response)))


def study_json(found: Study) -> dict[str, Any]:
    """Return a study as JSON-ready data."""
    document = head("study", found.case, found.conditions)
    document["sampling"] = found.plan.sampling
    document["designs"] = len(found.plan.rows)
    document["failed"] = found.failed
    document["resumed"] = found.resumed
    document["seconds_of_designs"] = found.seconds
    document["variables"] = {one.key: part(one, "spec low high nominal") for one in found.plan.variables}
    document["failures"] = found.failures
    units = {one.name: one.unit for one in found.task.answers}
    document["answers"] = {name: _answer(one, units[name]) for name, one in found.summaries.items()}
    return cleaned(document)


def _answer(found: Summary, unit: str) -> dict[str, Any]:
    document: dict[str, Any] = {
        "unit": unit,
        **part(found, "count mean std"),
        **{f"p{level:02d}": value for level, value in zip((5, 50, 95), found.quantiles, strict=True)},
        "worst": {"lowest": found.lowest, "highest": found.highest},
        "linear_share": found.linear,
        # Sobol indices that were not calculated are nan.
        "influences": {
            key: {k: v for k, v in vars(one).items() if v == v} for key, one in found.influences.items()
        },
    }
    if found.limits is not None:
        limits = found.limits
        document["limits"] = {"low": limits.low, "high": limits.high}
        document["yield"] = {"share": limits.share, "lower": limits.interval[0], "upper": limits.interval[1]}
    return document
