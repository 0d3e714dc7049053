"""A diagnosis -> its document."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from bushcli.diagnosis.result import SMALL, Diagnosis
from bushcli.effects.titles import phrase, title
from bushcli.errors import count_of
from bushcli.report.conditions import conditions
from bushcli.report.document import (
    Block,
    Document,
    On,
    Row,
    Section,
    Table,
    figures,
    note,
    paragraphs,
)
from bushcli.report.quantity import channel_label, join_names, number, percent
from bushcli.report.verdict import FAULTS, doubt_lines, fault_kind, fault_lines
from bushcli.report.views.diagnosis import words
from bushcli.report.views.diagnosis.paragraph import short_paragraphs
from bushcli.report.views.diagnosis.values import reciprocals_text, shown_quantity
from bushcli.report.views.dynamic import compared_section

# The models that are shown hold together this share of the probability, as in the set of rivals.
_CREDIBLE = 0.95
_BAR, _EIGHTHS = 24, " ▏▎▍▌▋▊▉"
# Head of the column of reciprocals and exponentials.
_DERIVED = "that is"
# Rows of the table of models on the terminal.
_MODELS = 6
_HOW = (
    "Coloured areas lie between the recording and the plain law where they differ by more than noise: orange where the "
    "simulation is too stiff or too high, purple where it is too soft or too low. Click a number to go there, a name "
    "to hide its line; drag to move, double click for all; the wheel zooms once the plot has been clicked. "
    "Below: simulated minus recorded force over time; the grey band is the noise, two standard deviations either way."
)
_SHADED = " Samples shaded from top to bottom are faulty and were left out."
_PROBABILITIES = (
    "The probability of an effect is the sum over all models that have it. A model is a law with a set of effects; its "
    "error/effect is the assumed error of its formulas, as a share of the misfit of the plain law that it explains."
)
_UNIFORM = "All effects had the same prior odds (--uniform-odds), however common they are in bushings."
_VALUES = (
    "Before: 95 % interval of the prior. As far out: prior probability that a bushing's "
    "value lies at least as far out as this one. Evidence: twice the logarithm of the Bayes factor against the "
    "same model without the effect."
)
_RECORD = (
    "A rectangle for each cycle and band of displacement: orange where the simulated force is too large, purple where "
    "it is too small. The places are described beside the curves, under the same numbers."
)
_TRIALS = (
    "Predicted: from the linearised problem around a model that was fitted before. Found: after the fit. Both relative "
    "to the plain law."
)


def diagnosis_document(diagnosis: Diagnosis) -> Document:
    """Return the document of a diagnosis."""
    is_faulty = diagnosis.verdict == "faulty_data"
    missing = missing_section(diagnosis)
    left_out = Section(
        "What was left out",
        [*paragraphs(effect_lines(diagnosis)), effect_table(diagnosis), note(_VALUES), figures("priors")],
        fold="Where the priors come from",
        folded=[source_table(diagnosis)],
    )
    any_faulty = any(channel.faulty.any() for channel in diagnosis.channels)
    caption = note(_HOW + (_SHADED if any_faulty else ""))
    curves = Section("Recorded and simulated curves", [figures("diagnosed"), caption])
    if is_faulty:
        curves = Section("Recorded curves", [figures("diagnosed")])
    sections = [
        Section(
            "How probable each effect is",
            [
                *sentences(words.rival_lines(diagnosis)),
                *paragraphs([_UNIFORM] if diagnosis.uniform_odds and diagnosis.models else []),
                probability_table(diagnosis),
                figures("probabilities"),
            ],
        ),
        Section("The most probable models", [model_table(diagnosis), note(_PROBABILITIES)]),
        *([missing] if words.is_missing(diagnosis) else []),
        *([left_out] if diagnosis.effects else []),
        Section(
            "Before and after", [misfit_table(diagnosis), *sentences([words.form_error_line(diagnosis)])]
        ),
        *([curves] if diagnosis.channels or is_faulty else []),
        compared_section([table.compared for table in diagnosis.tables]),
        *([] if words.is_missing(diagnosis) else [missing]),
        record_section(diagnosis),
        Section("Where in the bushing", [*sentences(map_lines(diagnosis)), figures("bushing_map")]),
        Section(
            "Parameters",
            [parameter_table(diagnosis), *paragraphs([] if is_faulty else [law_line(diagnosis)], "terminal")],
        ),
        Section("Next test", [*sentences(words.next_test_lines(diagnosis)), figures("next_test")]),
        search_section(diagnosis),
    ]
    # Where the verdict is faulty data, its paragraph has the faults.
    faults = [] if is_faulty else fault_lines(diagnosis.faults)
    doubts = [] if is_faulty else doubt_lines(diagnosis.faults)
    tone = words.tone(diagnosis)
    return Document(
        words.headline(diagnosis),
        [*doubts, *short_paragraphs(diagnosis)],
        "plain" if doubts and tone == "good" else tone,
        sections,
        # The faults of the data are in the warning.
        [condition for condition in diagnosis.conditions if condition.name not in FAULTS],
        # A diagnosis does not assume the effects of the case.
        conditions(
            replace(diagnosis.case, effects=()),
            diagnosis.material,
            diagnosis.law_from if diagnosis.law_fixed else "recordings",
        ),
        Section("Data faults", [fault_table(diagnosis), *paragraphs(faults, "terminal")]),
    )


def sentences(lines: Iterable[str], on: On = "both") -> list[Block]:
    """Return a paragraph for each line, with an initial capital and a full stop."""
    return paragraphs(words.as_sentences(lines), on)


def missing_section(diagnosis: Diagnosis) -> Section:
    """Return the section on unknown physics; on the terminal only where it may be missing."""
    caption = "Recorded minus simulated force of the most probable model, without noise"
    caption += ": the force that the unknown physics adds." if words.is_missing(diagnosis) else "."
    blocks = sentences(words.missing_lines(diagnosis))
    if diagnosis.missing and diagnosis.missing.profiles:
        blocks += [note(caption), figures("missing")]
    if words.is_missing(diagnosis):
        return Section("What is missing", blocks)
    return Section("Misfit that the most probable model leaves", blocks, on="page")


def record_section(diagnosis: Diagnosis) -> Section:
    """Return the places of the misfit; the page describes them beside the curves, with the same numbers."""
    if diagnosis.verdict == "faulty_data":
        return Section("Where in the record", [figures("record_map")])
    blocks = paragraphs(points(diagnosis.places), "terminal" if diagnosis.location.mismatch else "both")
    if diagnosis.remaining_places and diagnosis.effects:
        remaining = words.as_sentences(points(diagnosis.remaining_places))
        blocks += paragraphs(["After the most probable model:", *remaining])
    explained = [note(_RECORD)] if diagnosis.location.mismatch else []
    return Section("Where in the record", [*blocks, *explained, figures("record_map")])


def search_section(diagnosis: Diagnosis) -> Section:
    """Return how many models were fitted, and what these recordings cannot show."""
    failed = f"{count_of(diagnosis.failed_solves, 'trial')} failed"
    solved = f"{count_of(diagnosis.forward_solves, 'simulation')} of one channel, {failed}, {diagnosis.seconds:.0f} s"
    undetectable = tuple((title(name), why) for name, why in diagnosis.searched.untestable.items())
    blocks = [
        *sentences(words.searched_lines(diagnosis)),
        *sentences(untestable_lines(diagnosis), "terminal"),
        Table("Not detectable in these recordings", ("effect", "why"), undetectable, left=2, on="page"),
        *paragraphs([solved] if diagnosis.verdict != "faulty_data" else [], kind="note"),
    ]
    folded: list[Block] = [trial_table(diagnosis), note(_TRIALS)]
    return Section("How far the search went", blocks, fold="The models that were fitted", folded=folded)


def effect_lines(diagnosis: Diagnosis) -> list[str]:
    """Return a line for each effect: probability, summary, whether its values are plausible, and a remark."""
    lines = []
    for effect in diagnosis.effects:
        doubt = "" if effect.plausible else "hardly plausible"
        text = " ".join(words.as_sentences([effect.summary, doubt, effect.remark]))
        lines.append(f"{effect.label} ({words.chance(effect.probability)}): {text}")
    return lines


def map_lines(diagnosis: Diagnosis) -> list[str]:
    """Return a paragraph for each map of the bushing, with its channels if the diagnosis has several."""
    lines = []
    for bushing_map in diagnosis.maps:
        both = " together" if len(bushing_map.channels) > 1 else ""
        place = f"In the rubber ({join_names(list(bushing_map.channels))}{both}): "
        lines.append(f"{place if len(diagnosis.channels) > 1 else ''}{bushing_map.text}")
    cause = {
        "missing_physics": join_names(list(words.effect_chances(diagnosis))),
        "law_too_poor": f"that the {words.law_title(diagnosis.plain.law)} law is too poor",
    }.get(diagnosis.verdict)
    if lines and cause and any(bushing_map.helps_locally for bushing_map in diagnosis.maps):
        lines.append(f"The map shows the misfit of the plain law; the most probable cause is {cause}.")
    return lines


def untestable_lines(diagnosis: Diagnosis) -> list[str]:
    """Return a line that lists the effects which these recordings cannot show; the report gives the reasons."""
    names = join_names([phrase(name) for name in diagnosis.searched.untestable])
    reasons = "(reasons: result.json and report.html, -o DIR)"
    return [f"Not detectable in these recordings: {names} {reasons}"] if names else []


def law_line(diagnosis: Diagnosis) -> str:
    """Return the law of the most probable model with its values."""
    channels, fixed = diagnosis.measured_channels, ""
    identified = {name: quantity for name, quantity in diagnosis.parameters.items() if "." not in name}
    values = [f"{name} {shown_quantity(name, q, channels).text}" for name, q in identified.items()]
    if not values or diagnosis.law_fixed:
        values = [f"{name} {number(value, 4)}" for name, value in diagnosis.material.parameters.items()]
        fixed = f" (fixed, from the {diagnosis.law_from})" if diagnosis.law_fixed else ""
    return f"{words.law_title(diagnosis.material.law)} law: {', '.join(values)}{fixed}"


def points(lines: Sequence[str]) -> list[str]:
    """Number the lines where there is more than one."""
    return [f"{i}. {line}" for i, line in enumerate(lines, start=1)] if len(lines) > 1 else list(lines)


def probability_table(diagnosis: Diagnosis) -> Table:
    """Return the probability of each effect as a bar, the most probable one first; no rows without models."""
    shares = [(title(name), p) for name, p in words.ranked_effects(diagnosis) if p >= SMALL]
    name = "Probability that the effect is present"
    if not shares or not diagnosis.models:
        return Table(name, ("", "", ""), ())
    for names, kind, p in (
        (words.unlikely(diagnosis), "others, each", 0.0),
        (list(diagnosis.searched.untestable), "not detectable", math.nan),
    ):
        if names:
            shares.append((title(names[0]) if len(names) == 1 else f"{len(names)} {kind}", p))
    rows = tuple((label, bar(p), words.short_chance(p)) for label, p in shares)
    return Table(name, ("", "", ""), rows, left=2, on="terminal")


def bar(share: float) -> str:
    """Return a share, 0 to 1, as a bar of block characters; one above zero has at least an eighth of a character."""
    share = 0.0 if math.isnan(share) else share
    eighths = max(round(8 * _BAR * share), 1 if share > 0 else 0)
    return "█" * (eighths // 8) + _EIGHTHS[eighths % 8].strip()


def model_table(diagnosis: Diagnosis) -> Table:
    """Return the most probable models, as many as hold 95 % of the probability together."""
    rows: list[Row] = []
    so_far = 0.0
    for model in diagnosis.models:
        if so_far >= _CREDIBLE:
            break
        so_far += model.probability
        misfit = "predicted" if model.misfit is None else number(model.misfit)
        error = "-" if model.form_error is None else percent(100 * model.form_error)
        shares = map(words.short_chance, (model.probability, so_far))
        name = words.model_title(model.law, model.effects, model.variants)
        rows.append((name, *shares, logarithm(model.log_evidence), misfit, error))
    heads = ("model", "probability", "together", "ln evidence", "misfit/noise", "error/effect")
    return Table("Models that hold 95 % of the probability together", heads, tuple(rows), most=_MODELS)


def logarithm(value: float) -> str:
    """Return the natural logarithm of an evidence, relative to that of the plain law, as text."""
    return f"{value:+.1f}" if math.isfinite(value) else "-"


def effect_table(diagnosis: Diagnosis) -> Table:
    """Return each effect that was left out, with its parameters before and after the recordings."""
    rows: list[Row] = []
    for effect in diagnosis.effects:
        label, evidence = effect.label, number(effect.evidence, 2)
        for name, quantity in effect.parameters.items():
            value = shown_quantity(f"{effect.name}.{name}", quantity, diagnosis.measured_channels)
            tail = "-" if quantity.prior is None else words.short_chance(quantity.prior_tail)
            cells = (value.text, value.interval, value.prior_text, tail, reciprocals_text(quantity))
            rows.append((label, name, *cells, evidence))
            label, evidence = "", ""
    heads = (
        "effect",
        "parameter",
        "value",
        "95 % interval",
        "before, 95 %",
        "as far out",
        _DERIVED,
        "evidence",
    )
    name = "Values with 95 % intervals: posterior and prior"
    table = Table(name, heads, tuple(rows), left=2).without_empty(_DERIVED)
    return replace(table, detail=range(5, len(table.heads)))


def source_table(diagnosis: Diagnosis) -> Table:
    """Return the sources of the priors of the effects' parameters."""
    rows = [
        (effect.label, name, quantity.prior_source)
        for effect in diagnosis.effects
        for name, quantity in effect.parameters.items()
        if quantity.prior_source
    ]
    return Table("", ("effect", "parameter", "source"), tuple(rows), left=3)


def parameter_table(diagnosis: Diagnosis) -> Table:
    """Return all parameters of the most probable model."""
    rows: list[Row] = []
    for name, quantity in diagnosis.parameters.items():
        value = shown_quantity(name, quantity, diagnosis.measured_channels)
        effect, _, key = name.rpartition(".")
        label, unit = f"{title(effect)}: {key}" if effect else key, "-" if value.unit == "1" else value.unit
        std = "-" if value.word else number(value.std, 2)
        values = (value.word or number(value.value, 4), number(value.with_form_error, 4), std)
        ranges = (value.interval, value.prior_text, reciprocals_text(quantity))
        rows.append((label, quantity.meaning, unit, *values, *ranges))
    allowed = "with form error"
    heads = ("parameter", "meaning", "unit", "value", allowed, "std", "95 % interval", "prior 95 %", _DERIVED)
    table = Table("Parameters of the most probable model", heads, tuple(rows), left=3, on="page")
    return table.without_empty(_DERIVED, allowed)


def misfit_table(diagnosis: Diagnosis) -> Table:
    """Return the misfit before and after, the noise, and the form error of each channel; no rows without a fit."""
    if diagnosis.verdict == "faulty_data":
        return Table("", (), ())
    rows: list[Row] = []
    form = diagnosis.form_error.percent
    for channel in diagnosis.measured_channels:
        sizes = (channel.before_percent, channel.after_percent, channel.noise_percent, form.get(channel.name))
        rows.append((channel_label(channel.name, channel.held_out), *map(percent, sizes)))
    heads = ("channel", "before", "after", "noise", "form error")
    table = Table(f"Rms misfit, % {words.relative_to(diagnosis)}", heads, tuple(rows))
    return table.without_empty("form error")


def trial_table(diagnosis: Diagnosis) -> Table:
    """Return all models that were fitted, in the order of the search."""
    rows = []
    for i, trial in enumerate(diagnosis.searched.trials, start=1):
        evidence = (logarithm(trial.predicted), logarithm(trial.log_evidence))
        name = words.model_title(trial.law, trial.effects)
        rows.append((str(i), name, trial.text, *evidence, number(trial.misfit), str(trial.solves)))
    heads = ("", "model", "remark", "predicted", "found", "misfit/noise", "simulations")
    return Table("Models in the order of the search (ln of evidence times odds)", heads, tuple(rows), left=3)


def fault_table(diagnosis: Diagnosis) -> Table:
    """Return the faults of the recordings with their remedies, the fatal ones first."""
    rows = []
    for fault in sorted(diagnosis.faults, key=lambda fault: not fault.fatal):
        state = f"{count_of(int(fault.samples.sum()), 'sample')} left out"
        state = f"{words.chance(fault.probability)} probable" if fault.is_doubtful else state
        state = "correct first" if fault.fatal else state
        rows.append((fault.channel, fault_kind(fault), fault.where, state, fault.remedy))
    return Table("", ("channel", "fault", "where", "", "what to do"), tuple(rows), left=5, on="page")
