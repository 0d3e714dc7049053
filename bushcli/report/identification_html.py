"""Identified laws -> one HTML page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from bushcli.case import Case
from bushcli.inverse import Fit
from bushcli.report.cycles import fit_histories
from bushcli.report.document import Picture
from bushcli.report.html import PageSection, by_kind, history_sections, page
from bushcli.report.identification_tables import curve_table, estimate_table, leverage_table, model_table
from bushcli.report.identification_words import answer, determined, search
from bushcli.report.tables import curves_of


def inverse_html(
    result: Mapping[str, Any], case: Case, fits: Sequence[Fit], pictures: Iterable[Picture]
) -> str:
    """Return the page of identified laws, best first.

    Parameters
    ----------
    result : mapping of str to object
        What `inverse_json` returned.
    case : Case
        The case with the recordings.
    fits : sequence of Fit
        Identified laws, the best first.
    pictures : iterable of Picture
        What `inverse_figures` and `history_figures` returned.
    """
    best, kinds = fits[0], by_kind(pictures)
    found = answer(best)
    sections = [
        PageSection(
            f"Parameters identified from {curves_of(best)}",
            tables=[estimate_table(best)],
            note="Standard errors follow from the remaining misfit, its autocorrelation included; the 95 % interval is "
            "given where a parameter is poorly determined, from its profile.",
        ),
        PageSection("Curves before and after", kinds.get("curve", []), [curve_table(best)]),
        *history_sections(fit_histories(best), kinds),
    ]
    if len(fits) > 1:
        note = (
            "BIC above the smallest one: 6 or more is clearly worse. Where a channel was held out, its "
            "prediction decides: the identification has not seen it."
        )
        sections.append(PageSection("Laws compared", kinds.get("ranking", []), [model_table(fits)], note))
    doubtful = [*kinds.get("certainty", []), *kinds.get("profiles", [])]
    tables = [leverage_table(best)] if best.leverage else []
    open_ones = " ".join(f"{c.text[:1].upper()}{c.text[1:]}." for c in best.undetermined)
    note = " ".join([*determined(best), open_ones]).strip()
    sections.append(PageSection("What the curves determine", doubtful, tables, note))
    searched = [*kinds.get("convergence", []), *kinds.get("starts", [])]
    sections.append(PageSection("The search", searched, note=". ".join(search(best)) + "."))
    return page(
        result, case, best.material, f"{found.headline}.", found.lines, found.tone, sections, "recordings"
    )
