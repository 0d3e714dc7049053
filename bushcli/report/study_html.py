"""The page of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from bushcli.report.figures.picture import Picture
from bushcli.report.html import Section, by_kind, page
from bushcli.report.study import headline, lines, tables
from bushcli.study.study import Study

_NOTES = {
    "Answers": "Quantiles are of the designs that have a result.",
    "Effect of each key alone": "The last columns are the change of the answer from its mean when the key goes to its "
    "5 % and to its 95 % quantile and the others stay, by linear regression on all keys. Sobol indices are shares of "
    "the variance, of the key alone and with all its interactions; ± is the half width of the 95 % interval.",
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
        Section("What matters", kinds.get("tornado", [])),
        Section("Curves of all designs", kinds.get("band", [])),
        Section("Answers against the varied keys", kinds.get("scatter", [])),
        Section("Spread of the answers", kinds.get("histogram", [])),
    ]
    sections += [
        Section(title, tables=[replace(table, title="")], note=_NOTES.get(title, ""))
        for title, table in shown.items()
    ]
    worst = min((one.limits.share for one in found.summaries.values() if one.limits), default=None)
    tone = "plain" if worst is None else "good" if worst > 0.99 else "bad"
    return page(result, found.case, found.task.material, headline(found), lines(found), tone, sections)
