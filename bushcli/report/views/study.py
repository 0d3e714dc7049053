"""A study of many designs -> its document: answers, worst cases, influences, failures."""

from __future__ import annotations

import math

from bushcli.errors import count_of
from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Row, Section, Table, Tone, figures, note, table_of
from bushcli.report.quantity import number
from bushcli.report.results import StudyResult
from bushcli.runtime.digits import with_decimals
from bushcli.study.analysis import Failure, Influence, Summary
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
# A rank correlation is stated in a sentence if it exceeds this value and this number of standard deviations
# 1 / sqrt(n - 1), which unrelated columns exceed once in twenty times.
_WEAK, _CHANCE = 0.1, 1.96
_ANSWERS = (
    "Quantiles are of the designs that have a result. initial is the stiffness at rest, secant that from one end of "
    "the curve to the other."
)
_WORST = (
    "Among the designs that were simulated; design is their number in designs.parquet, from 0. A sample seldom reaches "
    "all limits at once; --sampling corners does."
)
_ALONE = (
    "At 5 % and at 95 %: the change of the answer from its mean when the key goes to that quantile and the others "
    "stay, by linear regression on all keys. Correlations are of values and of their ranks."
)
_SOBOL = (
    " Sobol indices are shares of the variance, of the key alone (first) and with all its interactions (total); ± is "
    "the half width of the 95 % interval."
)


def study_document(result: StudyResult) -> Document:
    """Return the document of a study."""
    study = result.study
    alone = _ALONE + (_SOBOL if study.plan.sampling == "saltelli" else "")
    tables = (answer_table(study), worst_table(study), influence_table(study))
    explained = zip(tables, (_ANSWERS, _WORST, alone), strict=True)
    failed = table_of("Designs without a result", study.failures, _FAILURES, left=3)
    sections = [
        Section("What matters", [figures("tornado")]),
        Section("Curves of all designs", [figures("band")]),
        Section("Answers against the varied keys", [figures("scatter")]),
        Section("Spread of the answers", [figures("histogram")]),
        *(Section(table.title, [table, note(text)]) for table, text in explained),
        Section(failed.title, [failed]),
    ]
    worst = min(
        (summary.limits.share for summary in study.summaries.values() if summary.limits), default=None
    )
    tone: Tone = "plain" if worst is None else "good" if worst > 0.99 else "bad"
    condition_rows = conditions(study.case, study.task.material)
    return Document(headline(study), lines(study), tone, sections, study.conditions, condition_rows)


def headline(study: Study) -> str:
    """Return the result in one sentence: the yield where there are limits, else the number of designs."""
    total = len(study.plan.rows)
    designs = f"{count_of(total, 'design')} ({NAMES[study.plan.sampling]})"
    shares = {name: summary.limits.share for name, summary in study.summaries.items() if summary.limits}
    if shares:
        worst = min(shares, key=lambda name: shares[name])
        summary = study.summaries[worst]
        whole = f" with a result, of {total}" if summary.count < total else ""
        sample = f"{count_of(summary.count, 'design')}{whole} ({NAMES[study.plan.sampling]})"
        return f"{share_percent(shares[worst])} of {sample} are within the limits of {worst}"
    if study.failed:
        return f"{total - study.failed} of {designs} have a result"
    return f"{designs}, all with a result"


def share_percent(share: float) -> str:
    """Return a share in percent: 100 % and 0 % only where no design is on the other side."""
    return f"{with_decimals(100 * share, 0.0, 100.0, decimals=1)} %"


def lines(study: Study) -> list[str]:
    """Return sentences on the varied keys and the strongest influences, or the answers of a single design."""
    variables = [f"{variable.key} = {variable.spec}" for variable in study.plan.variables]
    sentences = [f"Varied: {'; '.join(variables)}."]
    for name, summary in study.summaries.items():
        chance = _CHANCE / math.sqrt(max(summary.count - 1, 1))
        strongest = max(summary.influences.items(), key=lambda pair: abs(pair[1].spearman), default=None)
        if strongest is not None and abs(strongest[1].spearman) > max(_WEAK, chance):
            key, influence = strongest
            grows = "grows" if influence.spearman > 0 else "falls"
            sentences.append(f"{name} {grows} with {key} (rank correlation {influence.spearman:.2f}).")
    if not study.summaries:
        for answer in study.task.answers:
            value = next(iter(study.samples.get(answer.name, ())), None)
            if isinstance(value, float):
                sentences.append(f"{answer.name}: {number(value, 4)} {answer.unit}".rstrip() + ".")
    return sentences


def answer_table(study: Study) -> Table:
    """Return the statistics of each answer, with the share within its limits."""
    of_limits = ("limits", "within", "95 % interval")
    units = {answer.name: answer.unit for answer in study.task.answers}
    rows: list[Row] = []
    for name, summary in study.summaries.items():
        row = (name, units[name], str(summary.count), number(summary.mean, 4), number(summary.std, 3))
        ends: tuple[float, ...] = ()
        shares = ("-", "-", "-")
        if (limits := summary.limits) is not None:
            ends, (low, high) = (limits.low, limits.high), map(share_percent, limits.interval)
            # As they were given: a rounded limit could be on the other side of a value.
            given = "{:.10g} to {:.10g}".format(*ends)
            shares = (given, share_percent(limits.share), f"{low.removesuffix(' %')} to {high}")
        rows.append((*row, *(number(value, 4, ends) for value in summary.quantiles), *shares))
    heads = ("answer", "", "designs", "mean", "std", "5 %", "median", "95 %", *of_limits)
    return Table("Answers", heads, tuple(rows), left=2).without_empty(*of_limits)


def worst_table(study: Study) -> Table:
    """Return the designs with the lowest and the highest value of each answer."""
    rows: list[Row] = []
    for name, summary in study.summaries.items():
        limits = (summary.limits.low, summary.limits.high) if summary.limits else ()
        for end, extreme in (("lowest", summary.lowest), ("highest", summary.highest)):
            keys = (v if isinstance(v, str) else number(float(v), 5) for v in extreme.at.values())
            rows.append((name, end, number(extreme.value, 4, limits), str(extreme.design), *keys))
    return Table("Worst cases", ("answer", "", "value", "design", *study.plan.keys), tuple(rows), left=2)


def by_swing(summary: Summary) -> list[tuple[str, Influence]]:
    """Return the keys with their influence on an answer, the strongest first."""
    return sorted(summary.influences.items(), key=lambda pair: -abs(pair[1].swing[1] - pair[1].swing[0]))


def influence_table(study: Study) -> Table:
    """Return the influence of each key on each answer, the strongest first."""
    indices = study.plan.sampling == "saltelli"
    heads: Row = ("answer", "key", "correlation", "of ranks", "at 5 %", "at 95 %")
    heads += ("Sobol first", "±", "Sobol total", "±") if indices else ()
    rows = []
    for name, summary in study.summaries.items():
        for key, influence in by_swing(summary):
            row: Row = (name, key, f"{influence.pearson:.2f}", f"{influence.spearman:.2f}")
            row += tuple(f"{'+' if change > 0 else ''}{number(change, 3)}" for change in influence.swing)
            if indices:
                values = (influence.first, influence.first_error, influence.total, influence.total_error)
                row += tuple("-" if math.isnan(value) else f"{value:.2f}" for value in values)
            rows.append(row)
    return Table("Effect of each key alone", heads, tuple(rows), left=2)


_FAILURES: Columns[Failure] = (
    ("kind", lambda failure: failure.kind.replace("_", " ")),
    ("reason, of the first", lambda failure: failure.reason),
    ("designs", lambda of: ", ".join([*map(str, of.designs), *["..."] * (of.count > len(of.designs))])),
    ("number", lambda failure: str(failure.count)),
)
