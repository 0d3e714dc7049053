"""Diagnosis -> one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from bushcli.diagnosis.result import DiagnosedEffect, Diagnosis
from bushcli.diagnosis.words import sentences
from bushcli.report.data_faults import FAULTS
from bushcli.report.diagnosis import map_lines
from bushcli.report.diagnosis_names import chance
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_tables import (
    effect_table,
    fault_table,
    misfit_table,
    model_table,
    parameter_table,
    source_table,
    trial_table,
    untestable_table,
)
from bushcli.report.diagnosis_words import (
    form_error_line,
    headline,
    is_missing,
    missing_lines,
    next_test_lines,
    rival_lines,
    searched_lines,
    tone,
)
from bushcli.report.document import Picture
from bushcli.report.drawing.zoom import svg
from bushcli.report.html import PageSection, by_kind, page
from bushcli.report.plots.diagnosis import curve_plot, time_plot
from bushcli.report.tables import ReportTable

_HOW = (
    "Coloured areas lie between the recording and the plain law where they differ by more than noise: orange where the "
    "simulation is too stiff or too high, purple where it is too soft or too low. Click a number to go there, a name to "
    "hide its line; drag to move, double click for all; the wheel zooms once the plot has been clicked."
)
_PROBABILITIES = (
    "The probability of an effect is the sum over all models that have it. A model is a law with a set of effects; its "
    "error/effect is the assumed error of its formulas, as a share of the misfit of the plain law that it explains."
)
_VALUES = (
    "Before: 95 % interval of the prior. As far out: prior probability that a bushing's "
    "value lies at least as far out as this one. Evidence: twice the logarithm of the Bayes factor against the "
    "same model without the effect."
)


def diagnosis_html(result: Mapping[str, Any], found: Diagnosis, pictures: Iterable[Picture]) -> str:
    """Return the page of a diagnosis.

    Parameters
    ----------
    result : mapping of str to object
        What `diagnosis_json` returned.
    found : Diagnosis
        The diagnosis.
    pictures : iterable of Picture
        What `diagnosis_figures` returned; pictures of curves are left out, since the page has zoomable plots of them.
    """
    kinds = by_kind(pictures)
    missing, first = _missing(found, kinds.get("missing", [])), is_missing(found)
    sections = [
        PageSection(
            "How probable each effect is",
            kinds.get("probabilities", []),
            lines=_sentences(rival_lines(found)),
        ),
        PageSection(
            "The most probable models",
            tables=_full(model_table(found)),
            note=_PROBABILITIES if found.models else "",
        ),
        *([missing] if first else []),
        *_left_out(found, kinds),
        PageSection(
            "Before and after", tables=_full(misfit_table(found)), lines=_sentences([form_error_line(found)])
        ),
        *_plots(found),
        *([] if first else [missing]),
        _record(found, kinds.get("record_map", [])),
        PageSection("Where in the bushing", kinds.get("bushing_map", []), lines=_sentences(map_lines(found))),
    ]
    if found.parameters:
        sections.append(PageSection("Parameters", tables=[parameter_table(found)]))
    sections.append(
        PageSection("Next test", kinds.get("next_test", []), lines=_sentences(next_test_lines(found)))
    )
    sections += _search(found)
    # Faults of the data are in a separate box.
    problems = [one for one in result["problems"] if one["name"] not in FAULTS]
    return page(
        {**result, "problems": problems},
        # A diagnosis does not assume the effects of the case.
        replace(found.case, effects=()),
        found.material,
        f"{headline(found)}.",
        [paragraph(found)],
        tone(found),
        sections,
        found.law_from if found.law_fixed else "recordings",
        PageSection("Data faults", tables=[fault_table(found)]) if found.faults else None,
    )


def _plots(found: Diagnosis) -> list[PageSection]:
    """Return the plots that can be zoomed: curves, and the misfit over time; of faulty data the recorded curves."""
    if found.verdict == "faulty_data":
        curves = [svg(curve_plot(found, one)) for one in found.channels]
        return [PageSection("Recorded curves", plots=curves)]
    return [
        PageSection(
            "Recorded and simulated curves",
            plots=[svg(curve_plot(found, one)) for one in found.channels],
            note=_HOW,
        ),
        PageSection(
            "Misfit over time",
            plots=[svg(time_plot(found, one)) for one in found.channels],
            note="Simulated minus recorded force. The grey band is the noise, two standard deviations to either side."
            + _out(found),
        ),
    ]


def _left_out(found: Diagnosis, kinds: Mapping[str, list[Picture]]) -> list[PageSection]:
    if not found.effects:
        return []
    return [
        PageSection(
            "What was left out",
            kinds.get("priors", []),
            [effect_table(found)],
            _VALUES,
            [_effect(one) for one in found.effects],
            fold="Where the priors come from",
            folded=_full(source_table(found)),
        )
    ]


def _effect(effect: DiagnosedEffect) -> str:
    """Return a sentence on an effect: its probability, and whether its values are plausible."""
    doubt = "" if effect.plausible else " Hardly plausible."
    remark = f" {_sentence(effect.remark)}" if effect.remark else ""
    return f"{effect.label} ({chance(effect.probability)}): {_sentence(effect.summary)}{doubt}{remark}"


def _missing(found: Diagnosis, pictures: list[Picture]) -> PageSection:
    heading = "What is missing" if is_missing(found) else "Misfit that the most probable model leaves"
    note = "Recorded minus simulated force of the most probable model, without noise"
    note += ": the force that the unknown physics adds." if is_missing(found) else "."
    return PageSection(
        heading, pictures, note=note if pictures else "", lines=_sentences(missing_lines(found))
    )


def _record(found: Diagnosis, pictures: list[Picture]) -> PageSection:
    # The places are listed beside the curves, with their numbers.
    is_told = found.location.mismatch or found.verdict == "faulty_data"
    lines = [] if is_told else _sentences(list(sentences(found.location)))
    if found.remaining.mismatch and found.effects:
        lines += ["After the most probable model:", *_sentences(list(sentences(found.remaining)))]
    note = (
        "A rectangle for each cycle and band of displacement: orange where the simulated force is too large, purple "
        "where it is too small. The places are described beside the curves, under the same numbers."
    )
    return PageSection(
        "Where in the record", pictures, lines=lines, note=note if found.location.mismatch else ""
    )


def _search(found: Diagnosis) -> list[PageSection]:
    note = (
        "Predicted: from the linearised problem around a model that was fitted before. Found: after the fit. Both "
        "relative to the plain law."
    )
    trials = _full(trial_table(found))
    return [
        PageSection(
            "How far the search went",
            tables=_full(untestable_table(found)),
            note=note if trials else "",
            lines=_sentences(searched_lines(found)),
            fold="The models that were fitted",
            folded=trials,
        )
    ]


def _out(found: Diagnosis) -> str:
    left = any(one.faulty.any() for one in found.channels)
    return " Samples shaded from top to bottom are faulty and were left out." if left else ""


def _full(table: ReportTable) -> list[ReportTable]:
    """Return a list with the table; empty if the table has no rows."""
    return [table] if table.rows else []


def _sentences(lines: list[str]) -> list[str]:
    return [_sentence(line) for line in lines if line]


def _sentence(text: str) -> str:
    """Begin with a capital, unless that would change a name; end with a full stop."""
    first = text.split(maxsplit=1)[0] if text else ""
    started = text if "_" in first or first.endswith(":") else text[:1].upper() + text[1:]
    return started if started.endswith((".", ":")) else f"{started}."
