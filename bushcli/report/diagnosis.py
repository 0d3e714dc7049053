"""Diagnosis -> text for the terminal: the verdict first, then where, what, how much better, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group
from rich.padding import Padding
from rich.text import Text

from bushcli.diagnosis.result import Diagnosis
from bushcli.diagnosis.words import sentences
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_tables import (
    hypothesis_table,
    misfit_table,
    path_table,
)
from bushcli.report.diagnosis_words import (
    effect_names,
    headline,
    model_name,
    parameters_text,
    shown,
    strength,
    tone,
)
from bushcli.report.quantity import listed, number
from bushcli.report.text import Shown, problem_parts

# Rows of the table of hypotheses on the terminal; the report has all of them.
_HYPOTHESES = 6
_SECOND = (0, 0, 0, 2)


def diagnosis_text(found: Diagnosis) -> Group:
    """Return what a person reads at the terminal; lines of words wrap, tables fit into 100 columns."""
    style = {"good": "bold green", "bad": "bold red", "plain": "bold"}[tone(found)]
    parts: list[object] = [Text(f"{headline(found)}.", style), Text(paragraph(found))]
    parts += [Text(), Text("Where", "bold")]
    parts += [Padding(Text(line), _SECOND) for line in points(sentences(found.location))]
    if found.remaining.mismatch and found.effects:
        parts += [Padding(Text("What is left after the final model:"), _SECOND)]
        parts += [Padding(Text(line), (0, 0, 0, 4)) for line in points(sentences(found.remaining))]
    parts += [Padding(Text(line), _SECOND) for line in map_lines(found)]
    if found.effects:
        parts += [Text(), Text("What was left out", "bold")]
        parts += [Padding(Text(line), _SECOND) for line in effect_lines(found)]
    parts += [Text(), Shown(misfit_table(found))]
    parts += [Text(), Text(f"Law {found.material.law}: {_law_values(found)}")]
    parts += _rivals(found)
    parts += _hypotheses(found)
    parts += [Text(), Shown(path_table(found))]
    spent = f"{found.forward_solves} forward solves, {found.failed_solves} failed, {found.seconds:.0f} s"
    parts.append(Text(spent, "dim"))
    parts += problem_parts(found.conditions)
    return Group(*parts)  # type: ignore[arg-type]  # every part is a renderable


def effect_lines(found: Diagnosis) -> list[str]:
    """A line per effect: parameters, evidence, whether they are plausible, and what else to know."""
    lines = []
    for effect in found.effects:
        said = f"evidence {number(effect.evidence, 2)}, {strength(effect.evidence)}"
        doubt = "" if effect.plausible else "; not plausible"
        remark = f": {effect.remark}" if effect.remark else ""
        lines.append(f"{effect.label}: {parameters_text(effect, found.channels)} ({said}{doubt}){remark}")
    return lines


def map_lines(found: Diagnosis) -> list[str]:
    """Where in the bushing, a paragraph per map; which channels say so, where there are several."""
    lines = []
    for one in found.maps:
        together = " together" if len(one.channels) > 1 else ""
        said = f"In the rubber ({listed(list(one.channels))}{together}): " if len(found.channels) > 1 else ""
        lines.append(f"{said}{one.text}")
    cause = {
        "missing_physics": listed(effect_names(found)),
        "law_too_poor": f"the law {found.material.law}",
    }.get(found.verdict)
    if lines and cause and any(one.helps_locally for one in found.maps):
        lines.append(f"It is the plain law's misfit that is mapped: {cause} was found to explain it.")
    return lines


def rival_lines(found: Diagnosis) -> list[str]:
    """Which models cannot be told apart, and the recording that would do it."""
    lines = []
    if len(found.rivals) > 1 and not found.effects:
        names = ", ".join(model_name(names) for names in found.rivals[1:])
        lines.append(f"What these recordings could not show if it were there: {names}.")
    elif len(found.rivals) > 1:
        names = "; or ".join(model_name(names) for names in found.rivals)
        lines.append(f"These recordings cannot tell apart: {names}.")
    if found.next_test is not None:
        lines.append(f"Next test: {found.next_test.text}")
    return lines


def _rivals(found: Diagnosis) -> list[object]:
    lines = rival_lines(found)
    if not lines:
        return []
    return [Text(), Text("Rivals", "bold"), *(Padding(Text(line), _SECOND) for line in lines)]


def _hypotheses(found: Diagnosis) -> list[object]:
    """The most promising ones, and how many more there are."""
    tested = sum(one.testable for one in found.hypotheses)
    untested = len(found.hypotheses) - tested
    parts: list[object] = [Text(), Shown(hypothesis_table(found, _HYPOTHESES))] if tested else []
    more = []
    if tested > _HYPOTHESES:
        more.append(f"{tested - _HYPOTHESES} more")
    if untested:
        more.append(f"{untested} that cannot be tested with these recordings")
    if more:
        parts += [] if tested else [Text()]
        parts.append(Text(f"{' and '.join(more)}: see result.json and report.html (-o DIR)", "dim"))
    return parts


def _law_values(found: Diagnosis) -> str:
    if found.law_fixed:
        values = ", ".join(f"{name} {number(value, 4)}" for name, value in found.material.parameters.items())
        return f"{values} (fixed, from the {found.law_from})"
    if not any("." not in name for name in found.parameters):
        return ", ".join(f"{name} {number(value, 4)}" for name, value in found.material.parameters.items())
    own = {name: quantity for name, quantity in found.parameters.items() if "." not in name}
    return ", ".join(f"{name} {shown(name, q, found.channels).text}" for name, q in own.items())


def points(lines: Sequence[str]) -> list[str]:
    """Number the lines where there is more than one."""
    return [f"{i}. {line}" for i, line in enumerate(lines, start=1)] if len(lines) > 1 else list(lines)
