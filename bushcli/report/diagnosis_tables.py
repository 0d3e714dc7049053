"""Tables of a diagnosis, for both the terminal and the report."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bushcli.diagnosis.result import SMALL, Diagnosis
from bushcli.effects.titles import title
from bushcli.report.data_faults import fault_kind
from bushcli.report.diagnosis_names import model_title, short_chance
from bushcli.report.diagnosis_unlikely import undetectable, unlikely
from bushcli.report.diagnosis_values import derived_text, shown
from bushcli.report.diagnosis_words import channel_label
from bushcli.report.quantity import number, percent
from bushcli.report.tables import ReportTable, Row
from bushcli.selection.searched import TriedModel

# The models that are shown hold together this share of the probability, as in the set of rivals.
_CREDIBLE = 0.95
_BAR = 24
_EIGHTHS = " ▏▎▍▌▋▊▉"


def probability_table(found: Diagnosis) -> ReportTable:
    """Return the probability of each effect as a bar, the most probable one first; no rows without models."""
    ranked = sorted(found.probability.items() if found.models else (), key=lambda one: -one[1])
    rows: list[Row] = [(title(name), bar(p), short_chance(p)) for name, p in ranked if p >= SMALL]
    if not rows:
        return ReportTable("", ("", "", ""), ())
    few, hidden = unlikely(found, SMALL), undetectable(found, SMALL)
    if few:
        rows.append((_counted(few, "others, each"), bar(0.0), short_chance(0.0)))
    if hidden:
        rows.append((_counted(hidden, "not detectable"), bar(0.0), short_chance(math.nan)))
    return ReportTable("Probability that the effect is present", ("", "", ""), tuple(rows), left=2)


def _counted(names: Sequence[str], words: str) -> str:
    """Return the title of a single effect, otherwise the number of effects with words behind it."""
    return f"{len(names)} {words}" if len(names) > 1 else title(names[0])


def bar(share: float, width: int = _BAR) -> str:
    """Return a share as a bar of block characters; a share above zero has at least an eighth of a character.

    Parameters
    ----------
    share : float
        Share of the full bar, from 0 to 1.
    width : int
        Characters of the full bar.
    """
    eighths = max(round(8 * width * share), 1 if share > 0 else 0)
    return "█" * (eighths // 8) + _EIGHTHS[eighths % 8].strip()


def model_table(found: Diagnosis, most: int | None = None) -> ReportTable:
    """Return the most probable models, as many as hold 95 % of the probability together.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    most : int or None
        Largest number of rows; None for no limit.
    """
    rows: list[Row] = []
    so_far = 0.0
    for one in found.models:
        if so_far >= _CREDIBLE or (most is not None and len(rows) >= most):
            break
        so_far += one.probability
        rows.append(
            (
                model_title(one.law, one.effects, one.variants),
                short_chance(one.probability),
                short_chance(so_far),
                logarithm(one.log_evidence),
                "predicted" if one.misfit is None else number(one.misfit),
                "-" if one.form_error is None else percent(100 * one.form_error),
            )
        )
    heads = ("model", "probability", "together", "ln evidence", "misfit/noise", "error/effect")
    return ReportTable("Models that hold 95 % of the probability together", heads, tuple(rows))


def logarithm(value: float) -> str:
    """Return the natural logarithm of an evidence, relative to that of the plain law, as text."""
    return f"{value:+.1f}" if math.isfinite(value) else "-"


def effect_table(found: Diagnosis, brief: bool = False) -> ReportTable:
    """Return each effect that was left out, with its parameters before and after the recordings.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    brief : bool
        Whether to leave out the columns for rarity, reciprocal names and evidence, as on the terminal.
    """
    rows: list[Row] = []
    also = any(derived_text(quantity) for one in found.effects for quantity in one.parameters.values())
    for effect in found.effects:
        first = [effect.label, number(effect.evidence, 2)]
        for name, quantity in effect.parameters.items():
            value = shown(f"{effect.name}.{name}", quantity, found.channels)
            own = [name, value.text, value.interval, value.prior_text]
            if not brief:
                far = "-" if quantity.prior is None else short_chance(quantity.prior_tail)
                own += [far, *([derived_text(quantity)] if also else []), *first[1:]]
            rows.append((first[0], *own))
            first = ["", ""]
    heads: Row = ("effect", "parameter", "value", "95 % interval", "before, 95 %")
    if not brief:
        heads = (*heads, "as far out", *(("that is",) if also else ()), "evidence")
    name = "" if brief else "Values with 95 % intervals: posterior and prior"
    return ReportTable(name, heads, tuple(rows), left=2)


def source_table(found: Diagnosis) -> ReportTable:
    """Return the sources of the priors of the effects' parameters."""
    rows = [
        (effect.label, name, quantity.prior_source)
        for effect in found.effects
        for name, quantity in effect.parameters.items()
        if quantity.prior_source
    ]
    return ReportTable("", ("effect", "parameter", "source"), tuple(rows), left=3)


def parameter_table(found: Diagnosis) -> ReportTable:
    """Return all parameters of the most probable model."""
    rows: list[Row] = []
    also = any(derived_text(quantity) for quantity in found.parameters.values())
    for name, quantity in found.parameters.items():
        value = shown(name, quantity, found.channels)
        effect, _, own = name.rpartition(".")
        rows.append(
            (
                f"{title(effect)}: {own}" if effect else own,
                quantity.meaning,
                "-" if value.unit == "1" else value.unit,
                value.word or number(value.value, 4),
                "-" if value.word else number(value.std, 2),
                value.interval,
                value.prior_text,
                *([derived_text(quantity)] if also else []),
            )
        )
    heads: Row = ("parameter", "meaning", "unit", "value", "std", "95 % interval", "prior 95 %")
    heads = (*heads, "that is") if also else heads
    return ReportTable("Parameters of the most probable model", heads, tuple(rows), left=3)


def misfit_table(found: Diagnosis) -> ReportTable:
    """Return the misfit before and after, the noise, and the form error of each channel; no rows without a fit."""
    if found.verdict == "faulty_data":
        return ReportTable("", (), ())
    rows = []
    form = found.form_error.percent
    for one in found.channels:
        row = [
            channel_label(one),
            percent(one.before_percent),
            percent(one.after_percent),
            percent(one.noise_percent),
        ]
        rows.append((*row, percent(form.get(one.name))) if form else tuple(row))
    heads: Row = ("channel", "before", "after", "noise")
    if form:
        heads = (*heads, "form error")
    return ReportTable("Rms misfit, % of the force range", heads, tuple(rows))


def trial_table(found: Diagnosis) -> ReportTable:
    """Return all models that were fitted, in the order of the search."""
    rows = [_trial(i, one) for i, one in enumerate(found.searched.trials, start=1)]
    heads = ("", "model", "remark", "predicted", "found", "misfit/noise")
    return ReportTable(
        "Models in the order of the search (ln of evidence times odds)", heads, tuple(rows), left=3
    )


def _trial(order: int, one: TriedModel) -> Row:
    found = logarithm(one.log_evidence), number(one.misfit)
    return (
        str(order),
        model_title(one.law, one.effects),
        one.text,
        logarithm(one.predicted),
        *found,
    )


def untestable_table(found: Diagnosis) -> ReportTable:
    """Return the effects that these recordings cannot show, with the reasons."""
    rows = [(title(name), reason) for name, reason in found.searched.untestable.items()]
    return ReportTable("Not detectable in these recordings", ("effect", "why"), tuple(rows), left=2)


def fault_table(found: Diagnosis) -> ReportTable:
    """Return the faults of the recordings with their remedies, the fatal ones first."""
    rows = [
        (
            one.channel,
            fault_kind(one),
            one.where,
            "correct first"
            if one.fatal
            else f"{100 * one.probability:.0f} % probable"
            if one.doubtful
            else f"{int(one.samples.sum())} samples left out",
            one.remedy,
        )
        for one in sorted(found.faults, key=lambda one: not one.fatal)
    ]
    return ReportTable("", ("channel", "fault", "where", "", "what to do"), tuple(rows), left=5)
