"""The page of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from bushcli.report.document import Picture
from bushcli.report.html import PageSection, by_kind, page
from bushcli.report.study import headline, lines, tables
from bushcli.study.study import Study

_SOBOL = (
    " Sobol indices are shares of the variance, of the key alone (first) and with all its interactions (total); ± is "
    "the half width of the 95 % interval."
)
_NOTES = {
    "Answers": "Quantiles are of the designs that have a result. initial is the stiffness at rest, secant that from "
    "one end of the curve to the other.",
    "Worst cases": "Among the designs that were simulated; design is their number in designs.parquet, from 0. A sample "
    "seldom reaches all limits at once; --sampling corners does.",
    "Effect of each key alone": "At 5 % and at 95 %: the change of the answer from its mean when the key goes to that "
    "quantile and the others stay, by linear regression on all keys. Correlations are of values and of their ranks.",
}


def study_html(result: Mapping[str, Any], found: Study, pictures: Sequence[Picture]) -> str:
    """Return the page of a study.

    Parameters
    ----------
    result : mapping of str to object
        What `study_json` returned.
    found : Study
    pictures : sequence of Picture
        What `study_figures` returned.
    """
    kinds = by_kind(pictures)
    shown = {table.title: table for table in tables(found)}
    sections = [
        PageSection("What matters", kinds.get("tornado", [])),
        PageSection("Curves of all designs", kinds.get("band", [])),
        PageSection("Answers against the varied keys", kinds.get("scatter", [])),
        PageSection("Spread of the answers", kinds.get("histogram", [])),
    ]
    for title, table in shown.items():
        note = _NOTES.get(title, "") + (_SOBOL if any("Sobol" in head for head in table.heads) else "")
        sections.append(PageSection(title, tables=[replace(table, title="")], note=note))
    worst = min((one.limits.share for one in found.summaries.values() if one.limits), default=None)
    tone = "plain" if worst is None else "good" if worst > 0.99 else "bad"
    return page(result, found.case, found.task.material, headline(found), lines(found), tone, sections)
