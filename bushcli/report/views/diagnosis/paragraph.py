"""A diagnosis in plain sentences, one short paragraph for each question."""

from __future__ import annotations

import math

from bushcli.diagnosis.result import Diagnosis
from bushcli.effects.titles import NOTHING
from bushcli.report.quantity import join_names, percent
from bushcli.report.verdict import fault_lines
from bushcli.report.views.diagnosis import words
from bushcli.report.views.diagnosis.values import parameters_text

# Largest number of sets of effects that are named; the report has the others in a table.
_SETS = 6
# An effect that is less probable than this is always named with its probability.
_SURE = 0.95
# Probability of no effect from which on it is said that something is only probably left out.
_DOUBT = 0.05
# An error of the law's formula is mentioned where it exceeds this many times the noise.
NOTABLE = 1.0


def paragraph(diagnosis: Diagnosis) -> str:
    """Return the diagnosis in one paragraph."""
    return " ".join(short_paragraphs(diagnosis))


def short_paragraphs(diagnosis: Diagnosis) -> list[str]:
    """Return what was found, where, why, the improvement, what is missing, alternatives, and what to do next."""
    if diagnosis.verdict == "faulty_data":
        return [_opening(diagnosis), *words.as_sentences(fault_lines(diagnosis.faults))]
    explained, unexplained = diagnosis.verdict == "explained", diagnosis.verdict == "unexplained"
    missing = words.as_sentences(words.missing_lines(diagnosis))
    parts = [
        [_opening(diagnosis), *(missing[1:] if unexplained and not diagnosis.is_unsearched else [])],
        [] if explained else words.as_sentences(diagnosis.places[:2]),
        _effects(diagnosis) if diagnosis.effects else [],
        [] if explained else [_gain(diagnosis), *words.as_sentences([words.form_error_line(diagnosis)])],
        missing if words.is_missing(diagnosis) and not unexplained else [],
        [_rivals(diagnosis)],
        [] if diagnosis.next_test is None else [f"Next test: {diagnosis.next_test.text.rstrip('.')}."],
        [] if diagnosis.searched.complete else words.as_sentences(words.searched_lines(diagnosis)[:1]),
    ]
    joined = [" ".join(sentence for sentence in part if sentence) for part in parts]
    return [text for text in joined if text]


def _opening(diagnosis: Diagnosis) -> str:
    law = words.law_title(diagnosis.plain.law)
    fitted = [channel for channel in diagnosis.measured_channels if not channel.held_out]
    kind = "table" if all(channel.kind == "dynamic" for channel in fitted) else "recording"
    plural = "s" if len(fitted) > 1 else ""
    channels = f"{join_names([channel.name for channel in fitted])} {kind}{plural}"
    origin = {
        "recordings": f"The {law} law alone, fitted to the {channels}",
        "coupons": f"The {law} law, fitted to the coupon tests and compared with the {channels}",
    }[diagnosis.law_from]
    best = words.best_probability(diagnosis)
    match diagnosis.verdict:
        case "explained":
            return f"{origin}, describes {'them' if plural else 'it'}{best}: {_nothing_missing(diagnosis)}."
        case "law_too_poor":
            does, rest = "describes the same rubber", ""
            if any(condition.name == "misfit_above_noise" for condition in diagnosis.conditions):
                does, rest = "fits better", ", but not to within the noise"
            return (
                f"{origin}, leaves a misfit larger than the noise because the law is too poor: "
                f"{words.law_title(diagnosis.material.law)} {does} without any further physics{best}{rest}."
            )
        case "unexplained" if diagnosis.is_unsearched:
            return (
                f"{origin}, may lack something. The search ended before it could tell which effects are probable: "
                f"none of them is ruled out.{_so_far(diagnosis)}"
            )
        case "unexplained":
            reasons = [*words.missing_lines(diagnosis), f"Nothing {words.catalogue(diagnosis)} explains it"]
            return f"{origin}, leaves a misfit larger than the noise. {reasons[0]}."
        case "faulty_data":
            return "A diagnosis is possible only after the data are corrected."
        case "missing_physics":
            if words.group_of(diagnosis) is not None:
                return f"{origin}, leaves something out: {words.missing_physics(diagnosis)}."
            effects, leaves = join_names(words.effects_with_chance(diagnosis)), "leaves something out"
            if len(words.likely(diagnosis)) > 1:
                # Several effects may be probable together though none of them is alone.
                effects, none = f"most probably {effects}", diagnosis.probability.get(NOTHING, 0.0)
                leaves = f"probably {leaves} ({words.chance(1.0 - none)})" if none >= _DOUBT else leaves
            return f"{origin}, {leaves}: {effects}."


def _nothing_missing(diagnosis: Diagnosis) -> str:
    """Return what is said of the rest where the law alone describes the recordings."""
    statement = "nothing is missing that these recordings could show"
    if words.shows_nothing(diagnosis):
        statement += ", and they can show none of the effects considered"
    noise, errors = (
        {c.name: c.noise_percent for c in diagnosis.measured_channels},
        diagnosis.form_error.percent,
    )
    sizes = [f"{percent(size)} in {name}" for name, size in errors.items() if size > NOTABLE * noise[name]]
    relative = f"{join_names(sizes)} (rms, {words.relative_to(diagnosis)})"
    return f"{statement}, if the formula of the law may err by {relative}" if sizes else statement


def _so_far(diagnosis: Diagnosis) -> str:
    """Return a sentence on the best model of a search that ended too early; empty if only laws were fitted."""
    trials = [trial for trial in diagnosis.searched.trials if math.isfinite(trial.log_evidence)]
    best = max(trials, key=lambda trial: trial.log_evidence, default=None)
    if best is None or not best.effects:
        return ""
    model = words.model_title(best.law, best.effects)
    return f" Of the {len(trials)} models fitted so far {model} is the most probable."


def _effects(diagnosis: Diagnosis) -> list[str]:
    """Return sentences on the effects of the most probable model, and on its law if that is not the plain one."""
    parts: list[str] = []
    for effect in diagnosis.effects:
        values = parameters_text(effect, diagnosis.measured_channels)
        chance = "" if effect.probability >= _SURE else f", {words.chance(effect.probability)}"
        parts.append(f"{effect.summary.rstrip('.')} ({effect.label}{chance}: {values}).")
        if not effect.plausible:
            why = f": {effect.remark}" if effect.remark else ""
            parts += words.as_sentences([f"{effect.label} is hardly plausible{why}"])
    if diagnosis.material.law != diagnosis.plain.law:
        law, plain = words.law_title(diagnosis.material.law), words.law_title(diagnosis.plain.law)
        parts.append(
            f"The model also has the {law} law in place of {plain}: both changes together reduce the misfit."
        )
    elif diagnosis.law_from == "coupons" and not diagnosis.law_fixed:
        parts.append(
            "The law, too, is no longer that of the coupons but identified from the recordings: both together reduce "
            "the misfit."
        )
    return parts


def _gain(diagnosis: Diagnosis) -> str:
    parts: list[str] = []
    for channel in diagnosis.measured_channels:
        sizes = (channel.before_percent, channel.after_percent, channel.noise_percent)
        before, after, noise = (f"{size:.2g}" for size in sizes)
        held_out = ", held out," if channel.held_out else ""
        if before != after:
            parts.append(
                f"{channel.name}{held_out} from {before} to {after} % {channel.of} (noise {noise} %)"
            )
    if not parts:
        return ""
    what = "with it" if len(diagnosis.effects) == 1 else "with them" if diagnosis.effects else ""
    if not what and diagnosis.material.law != diagnosis.plain.law:
        what = f"with the {words.law_title(diagnosis.material.law)} law"
    falls = all(channel.after_percent <= channel.before_percent for channel in diagnosis.measured_channels)
    text = f"{what} the misfit {'falls' if falls else 'changes'}: {', '.join(parts)}."
    return words.as_sentences([text.strip()])[0]


def _rivals(diagnosis: Diagnosis) -> str:
    """Return a sentence with the other sets of effects that are possible, with their probabilities."""
    others = words.first_few([candidate.text() for candidate in words.likely(diagnosis)[1:]], _SETS)
    if not others:
        return ""
    if diagnosis.verdict == "explained":
        return f"Not ruled out: {', '.join(others)}."
    return f"These recordings cannot tell {words.likely(diagnosis)[0].text()} from: {'; '.join(others)}."
