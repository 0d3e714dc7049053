"""A study -> JSON, tables and sentences, for both the terminal and the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich.console import Group
from rich.text import Text

from bushcli.report.json.direct import cleaned, direct_json, head
from bushcli.report.quantity import number
from bushcli.report.tables import ReportTable, Row
from bushcli.report.text import Shown, problem_parts
from bushcli.simulate.misfit import misfits
from bushcli.simulate.response import Response
from bushcli.study.analysis import Failure, Limits, Summary
from bushcli.study.study import Study

#: Names of the ways to choose designs.
NAMES = {
    "grid": "grid",
    "list": "list",
    "lhs": "Latin hypercube",
    "sobol": "Sobol sequence",
    "random": "random sample",
    "saltelli": "Saltelli design",
    "corners": "nominal design and corners",
}


def described(response: Response) -> Mapping[str, Any]:
    """Return the result of a design as from `bushcli direct`, for answers that are keys of it."""
    return direct_json(response, misfits(response), None, {})


def study_json(found: Study, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a study as JSON-ready data.

    Parameters
    ----------
    found : Study
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("study", found.case, found.conditions, timings)
    document["sampling"] = found.plan.sampling
    document["designs"] = len(found.plan.rows)
    document["failed"] = found.failed
    document["resumed"] = found.resumed
    document["seconds_of_designs"] = found.seconds
    document["variables"] = {
        one.key: {"spec": one.spec, "low": one.low, "high": one.high, "nominal": one.nominal}
        for one in found.plan.variables
    }
    document["failures"] = [vars(reason) for reason in found.failures]
    units = {one.name: one.unit for one in found.task.answers}
    document["answers"] = {name: _answer(one, units[name]) for name, one in found.summaries.items()}
    return cleaned(document)


def _answer(found: Summary, unit: str) -> dict[str, Any]:
    document: dict[str, Any] = {
        "unit": unit,
        "count": found.count,
        "mean": found.mean,
        "std": found.std,
        **{f"p{level:02d}": value for level, value in zip((5, 50, 95), found.quantiles, strict=True)},
        "worst": {"lowest": vars(found.lowest), "highest": vars(found.highest)},
        "linear_share": found.linear,
        "influences": {key: _influence(vars(one)) for key, one in found.influences.items()},
    }
    if found.limits is not None:
        limits = found.limits
        document["limits"] = {"low": limits.low, "high": limits.high}
        document["yield"] = {"share": limits.share, "lower": limits.interval[0], "upper": limits.interval[1]}
    return document


def _influence(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return an influence, with Sobol indices only if there are any."""
    return {k: v for k, v in values.items() if not (isinstance(v, float) and math.isnan(v))}


# A rank correlation is stated in a sentence if it exceeds this value and this number of standard deviations
# 1 / sqrt(n - 1), which unrelated columns exceed once in twenty times.
_WEAK, _CHANCE = 0.1, 1.96


def study_text(found: Study) -> Group:
    """Return the verdict, the tables and the problems of a study."""
    parts: list[object] = [Text(f"{headline(found)}.", "bold")]
    parts += [Text(f"  {line}") for line in lines(found)]
    for table in tables(found):
        parts += [Text(), Shown(table)]
    parts += problem_parts(found.conditions)
    return Group(*parts)  # type: ignore[arg-type]  # every part is a renderable


def headline(found: Study) -> str:
    """Return the result in one sentence: the yield where there are limits, else the number of designs."""
    total = len(found.plan.rows)
    of = f"{total} design{'s' if total != 1 else ''} ({NAMES[found.plan.sampling]})"
    shares = {name: one.limits.share for name, one in found.summaries.items() if one.limits is not None}
    if shares:
        worst = min(shares, key=lambda name: shares[name])
        one = found.summaries[worst]
        whole = f" with a result, of {total}" if one.count < total else ""
        sample = f"{one.count} designs{whole} ({NAMES[found.plan.sampling]})"
        return f"{100 * shares[worst]:.1f} % of {sample} are within the limits of {worst}"
    if found.failed:
        return f"{total - found.failed} of {of} have a result"
    return f"{of}, all with a result"


def lines(found: Study) -> list[str]:
    """Return sentences on the varied keys and the strongest influences, or the answers of a single design."""
    said = [f"{one.key} = {one.spec}" for one in found.plan.variables]
    text = [f"Varied: {'; '.join(said)}."]
    for name, one in found.summaries.items():
        chance = _CHANCE / math.sqrt(max(one.count - 1, 1))
        strongest = max(one.influences.items(), key=lambda pair: abs(pair[1].spearman), default=None)
        if strongest is not None and abs(strongest[1].spearman) > max(_WEAK, chance):
            key, influence = strongest
            grows = "grows" if influence.spearman > 0 else "falls"
            text.append(f"{name} {grows} with {key} (rank correlation {influence.spearman:.2f}).")
    if not found.summaries:
        for answer in found.task.answers:
            value = next(iter(found.samples.get(answer.name, ())), None)
            if isinstance(value, float):
                text.append(f"{answer.name}: {number(value, 4)} {answer.unit}".rstrip() + ".")
    return text


def _share(limits: Limits) -> str:
    return f"{100 * limits.share:.1f} %"


def tables(found: Study) -> list[ReportTable]:
    """Return answers, worst cases, influences and failures."""
    made = [_answers(found), _worst(found), _influences(found), _failures(found)]
    return [table for table in made if table.rows]


def _answers(found: Study) -> ReportTable:
    limited = any(one.limits for one in found.summaries.values())
    heads: Row = ("answer", "", "designs", "mean", "std", "5 %", "median", "95 %")
    heads += ("limits", "within", "95 % interval") if limited else ()
    units = {one.name: one.unit for one in found.task.answers}
    rows: list[Row] = []
    for name, one in found.summaries.items():
        row: Row = (name, units[name], str(one.count), number(one.mean, 4), number(one.std, 3))
        row += tuple(number(value, 4) for value in one.quantiles)
        if limited and one.limits is not None:
            low, high = one.limits.interval
            row += (f"{number(one.limits.low, 4)} to {number(one.limits.high, 4)}", _share(one.limits))
            row += (f"{100 * low:.1f} to {100 * high:.1f} %",)
        elif limited:
            row += ("-", "-", "-")
        rows.append(row)
    return ReportTable("Answers", heads, tuple(rows), left=2)


def _worst(found: Study) -> ReportTable:
    rows: list[Row] = []
    for name, one in found.summaries.items():
        for what, extreme in (("lowest", one.lowest), ("highest", one.highest)):
            at = tuple(v if isinstance(v, str) else number(float(v), 5) for v in extreme.at.values())
            rows.append((name, what, number(extreme.value, 4), str(extreme.design), *at))
    return ReportTable(
        "Worst cases", ("answer", "", "value", "design", *found.plan.keys), tuple(rows), left=2
    )


def _influences(found: Study) -> ReportTable:
    indices = found.plan.sampling == "saltelli"
    heads: Row = ("answer", "key", "correlation", "of ranks", "at 5 %", "at 95 %")
    heads += ("Sobol first", "±", "Sobol total", "±") if indices else ()
    rows = []
    for name, one in found.summaries.items():
        ordered = sorted(one.influences.items(), key=lambda pair: -abs(pair[1].swing[1] - pair[1].swing[0]))
        for key, influence in ordered:
            row: Row = (name, key, f"{influence.pearson:.2f}", f"{influence.spearman:.2f}")
            row += tuple(f"{'+' if change > 0 else ''}{number(change, 3)}" for change in influence.swing)
            if indices:
                values = (influence.first, influence.first_error, influence.total, influence.total_error)
                row += tuple("-" if math.isnan(value) else f"{value:.2f}" for value in values)
            rows.append(row)
    return ReportTable("Effect of each key alone", heads, tuple(rows), left=2)


def _few(one: Failure) -> str:
    more = ", ..." if one.count > len(one.designs) else ""
    return ", ".join(map(str, one.designs)) + more


def _failures(found: Study) -> ReportTable:
    rows = tuple(
        (one.kind.replace("_", " "), one.reason, _few(one), str(one.count)) for one in found.failures
    )
    return ReportTable(
        "Designs without a result", ("kind", "reason, of the first", "designs", "number"), rows, left=3
    )
