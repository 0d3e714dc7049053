"""Diagnosis -> one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from markupsafe import Markup

from bushcli.diagnosis.result import Diagnosis, Named
from bushcli.diagnosis.words import sentences
from bushcli.report.diagnosis import map_lines, rival_lines
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_tables import (
    effect_table,
    hypothesis_table,
    misfit_table,
    parameter_table,
    path_table,
    untested_table,
)
from bushcli.report.diagnosis_words import headline, tone
from bushcli.report.figures.diagnosis_curves import curve_plot, time_plot
from bushcli.report.figures.picture import Picture
from bushcli.report.figures.plot import svg
from bushcli.report.html import Section, by_kind, page

_HOW = (
    "Coloured areas lie between the recording and the plain law where they differ by more than noise: orange where the "
    "simulation is too stiff or too high, green where it is too soft or too low. Click a number to go there, a name to "
    "hide its line; drag to move, double click for all; the wheel zooms once the plot has been clicked."
)


def diagnosis_html(result: Mapping[str, Any], found: Diagnosis, pictures: Iterable[Picture]) -> str:
    """Return the page of a diagnosis.

    Parameters
    ----------
    result
        What `diagnosis_json` returned.
    pictures
        What `diagnosis_figures` returned; the curves among them are in the page as plots to zoom instead.
    """
    kinds = by_kind(pictures)
    sections = [
        Section("Before and after", tables=[misfit_table(found)]),
        Section(
            "Recorded and simulated curves",
            plots=[Markup(svg(curve_plot(found, one))) for one in found.channels],
            note=_HOW,
        ),
        Section(
            "Misfit over time",
            plots=[Markup(svg(time_plot(found, one))) for one in found.channels],
            note="Simulated minus recorded force. The grey band is the noise, two standard deviations to either side; "
            "what is shaded from top to bottom was held out of the fits that the predictions were judged by.",
        ),
        _record(found, kinds.get("record_map", [])),
        Section(
            "Where in the bushing",
            kinds.get("bushing_map", []),
            lines=_sentences(map_lines(found)),
        ),
    ]
    if found.effects:
        sections.append(Section("What was left out", tables=[effect_table(found)], lines=_effects(found)))
    if found.parameters:
        note = "Standard errors and intervals are from the noise; they know nothing of what the model still lacks."
        sections.append(Section("Parameters", tables=[parameter_table(found)], note=note))
    sections.append(
        Section("Rivals and next test", kinds.get("next_test", []), lines=_sentences(rival_lines(found)))
    )
    sections.append(_hypotheses(found))
    sections.append(
        Section(
            "How the model was selected",
            tables=[path_table(found, reasons=True)],
        )
    )
    return page(
        result,
        found.case,
        found.material,
        f"{headline(found)}.",
        [paragraph(found)],
        tone(found),
        sections,
        found.law_from if found.law_fixed else "recordings",
    )


def _record(found: Diagnosis, pictures: list[Picture]) -> Section:
    # What there is stands beside the curves, with the numbers that it has there.
    lines = [] if found.location.mismatch else _sentences(list(sentences(found.location)))
    if found.remaining.mismatch and found.effects:
        lines += ["After the final model:", *_sentences(list(sentences(found.remaining)))]
    note = (
        "A rectangle for each cycle and band of displacement: orange where the simulated force is too large, purple "
        "where it is too small. The places in words stand beside the curves, with their numbers."
    )
    return Section("Where in the record", pictures, lines=lines, note=note if found.location.mismatch else "")


def _effects(found: Diagnosis) -> list[str]:
    """A paragraph per effect: what it is, and whether its parameters are plausible."""
    return [f"{effect.label}: {_sentence(effect.summary)} {_plausible(effect)}" for effect in found.effects]


def _plausible(effect: Named) -> str:
    if effect.plausible:
        return _sentence(effect.remark or "its parameters are plausible")
    return _sentence(
        f"not plausible: {effect.remark}" if effect.remark else "its parameters are not plausible"
    )


def _hypotheses(found: Diagnosis) -> Section:
    note = (
        "The fall of chi square is what a score test expects of the effect beside the plain law; z and p are its "
        "significance. BIC (change against the plain law; negative is better) and misfit are of the refit together "
        "with the law, for those that were refitted."
    )
    tables = [table for table in (hypothesis_table(found), untested_table(found)) if table.rows]
    return Section("What was thought of", tables=tables, note=note)


def _sentences(lines: list[str]) -> list[str]:
    return [_sentence(line) for line in lines]


def _sentence(text: str) -> str:
    """Begin with a capital, unless that would change a name; end with a full stop."""
    first = text.split(maxsplit=1)[0] if text else ""
    begun = text if "_" in first or first.endswith(":") else text[:1].upper() + text[1:]
    return begun if begun.endswith((".", ":")) else f"{begun}."
