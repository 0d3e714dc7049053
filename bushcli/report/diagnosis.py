"""Diagnosis -> text for the terminal: verdict, places, effects, probabilities and the next test."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.padding import Padding
from rich.text import Text

from bushcli.diagnosis.result import Diagnosis
from bushcli.diagnosis.words import sentences
from bushcli.effects.titles import phrase
from bushcli.report.data_faults import FAULTS, fault_lines
from bushcli.report.diagnosis_names import chance, law_title
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_tables import (
    effect_table,
    misfit_table,
    model_table,
    probability_table,
)
from bushcli.report.diagnosis_values import shown
from bushcli.report.diagnosis_words import (
    effect_names,
    ended,
    form_error_line,
    headline,
    is_missing,
    missing_lines,
    next_test_lines,
    rival_lines,
    searched_lines,
    tone,
)
from bushcli.report.quantity import listed, number
from bushcli.report.tables import ReportTable
from bushcli.report.text import Shown, problem_parts

# Rows of the table of models on the terminal; the report has all of them.
_MODELS = 6
_SECOND, _THIRD = (0, 0, 0, 2), (0, 0, 0, 4)


def diagnosis_text(found: Diagnosis) -> Group:
    """Return the text for the terminal; sentences are wrapped, tables fit into 100 columns."""
    style = {"good": "bold green", "bad": "bold red", "plain": "bold"}[tone(found)]
    parts: list[object] = [Text(f"{headline(found)}.", style)]
    # If the verdict is faulty data, its paragraph has the faults.
    faults = [] if found.verdict == "faulty_data" else fault_lines(found.faults)
    parts += [*_block("Data faults", faults), *([Text()] if faults else []), Text(paragraph(found))]
    if found.verdict != "faulty_data":
        parts += [Text(), Text("Where", "bold")]
        parts += _indented(points(sentences(found.location)))
    if found.remaining.mismatch and found.effects:
        parts += _indented(["Misfit that the most probable model leaves:"])
        parts += [Padding(Text(line), _THIRD) for line in points(sentences(found.remaining))]
    parts += _indented(ended(map_lines(found)))
    if found.effects:
        parts += _block("What was left out", effect_lines(found))
        parts.append(Shown(effect_table(found, brief=True)))
    if is_missing(found):
        parts += _block("What is missing", ended(missing_lines(found)))
    parts += _block("What these recordings cannot tell apart", ended(rival_lines(found)))
    parts += _table(probability_table(found))
    parts += _table(model_table(found, _MODELS))
    parts += _table(misfit_table(found))
    parts += [Text(line) for line in ended([form_error_line(found)])]
    if found.verdict != "faulty_data":
        parts += [Text(), Text(f"{law_title(found.material.law)} law: {_law_values(found)}")]
    parts += _block("Next test", ended(next_test_lines(found)))
    parts += _block("Search", ended([*searched_lines(found), *untestable_lines(found)]))
    if found.verdict != "faulty_data":
        parts.append(Text(f"{_solves(found)}, {found.seconds:.0f} s", "dim"))
    parts += problem_parts(one for one in found.conditions if one.name not in FAULTS)
    return Group(*parts)  # type: ignore[arg-type]  # every part is a renderable


def effect_lines(found: Diagnosis) -> list[str]:
    """Return a line for each effect: probability, summary, whether its values are plausible, and a remark."""
    lines = []
    for effect in found.effects:
        doubt = "" if effect.plausible else " Hardly plausible."
        remark = f" {ended([effect.remark])[0]}" if effect.remark else ""
        lines.append(
            f"{effect.label} ({chance(effect.probability)}): {ended([effect.summary])[0]}{doubt}{remark}"
        )
    return lines


def map_lines(found: Diagnosis) -> list[str]:
    """Return a paragraph for each map of the bushing, with its channels if the diagnosis has several."""
    lines = []
    for one in found.maps:
        both = " together" if len(one.channels) > 1 else ""
        where = f"In the rubber ({listed(list(one.channels))}{both}): " if len(found.channels) > 1 else ""
        lines.append(f"{where}{one.text}")
    cause = {
        "missing_physics": listed(effect_names(found)),
        "law_too_poor": f"that the {law_title(found.plain.law)} law is too poor",
    }.get(found.verdict)
    if lines and cause and any(one.helps_locally for one in found.maps):
        lines.append(f"The map shows the misfit of the plain law; the most probable cause is {cause}.")
    return lines


def untestable_lines(found: Diagnosis) -> list[str]:
    """Return a line that lists the effects which these recordings cannot show; the report gives the reasons."""
    names = [phrase(name) for name in found.searched.untestable]
    if not names:
        return []
    return [
        f"Not detectable in these recordings: {listed(names)} (reasons: result.json and report.html, -o DIR)"
    ]


def _solves(found: Diagnosis) -> str:
    failed = f"{found.failed_solves} trial{'s' * (found.failed_solves != 1)} failed"
    return f"{found.forward_solves} simulations of one channel, {failed}"


def _law_values(found: Diagnosis) -> str:
    if found.law_fixed:
        values = ", ".join(f"{name} {number(value, 4)}" for name, value in found.material.parameters.items())
        return f"{values} (fixed, from the {found.law_from})"
    own = {name: quantity for name, quantity in found.parameters.items() if "." not in name}
    if not own:
        return ", ".join(f"{name} {number(value, 4)}" for name, value in found.material.parameters.items())
    return ", ".join(f"{name} {shown(name, q, found.channels).text}" for name, q in own.items())


def points(lines: Sequence[str]) -> list[str]:
    """Number the lines where there is more than one."""
    return [f"{i}. {line}" for i, line in enumerate(lines, start=1)] if len(lines) > 1 else list(lines)


def _block(heading: str, lines: Sequence[str]) -> list[object]:
    """Return lines under a heading; nothing if there are no lines."""
    return [Text(), Text(heading, "bold"), *_indented(lines)] if lines else []


def _indented(lines: Sequence[str]) -> list[object]:
    return [Padding(Text(line), _SECOND) for line in lines]


def _table(table: ReportTable) -> list[object]:
    return [Text(), Shown(table)] if table.rows else []
