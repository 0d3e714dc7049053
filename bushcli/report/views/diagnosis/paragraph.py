"""A diagnosis in plain sentences, one short paragraph for each question."""

from __future__ import annotations

import math

from bushcli.diagnosis.result import Diagnosis
from bushcli.effects.titles import NOTHING
from bushcli.report.quantity import listed, percent
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


def paragraph(found: Diagnosis) -> str:
    """Return the diagnosis in one paragraph."""
    return " ".join(short_paragraphs(found))


def short_paragraphs(found: Diagnosis) -> list[str]:
    """Return what was found, where, why, the improvement, what is missing, alternatives, and what to do next."""
    if found.verdict == "faulty_data":
        return [_opening(found), *words.ended(fault_lines(found.faults))]
    explained, unexplained = found.verdict == "explained", found.verdict == "unexplained"
    missing = words.ended(words.missing_lines(found))
    parts = [
        [_opening(found), *(missing[1:] if unexplained and not found.unsearched else [])],
        [] if explained else words.ended(found.places[:2]),
        _effects(found) if found.effects else [],
        [] if explained else [_gain(found), *words.ended([words.form_error_line(found)])],
        missing if words.is_missing(found) and not unexplained else [],
        [_rivals(found)],
        [] if found.next_test is None else [f"Next test: {found.next_test.text.rstrip('.')}."],
        [] if found.searched.complete else words.ended(words.searched_lines(found)[:1]),
    ]
    joined = [" ".join(sentence for sentence in part if sentence) for part in parts]
    return [text for text in joined if text]


def _opening(found: Diagnosis) -> str:
    law = words.law_title(found.plain.law)
    fitted = [channel for channel in found.measured if not channel.held_out]
    what = "table" if all(one.kind == "dynamic" for one in fitted) else "recording"
    many = "s" if len(fitted) > 1 else ""
    channels = f"{listed([channel.name for channel in fitted])} {what}{many}"
    origin = {
        "recordings": f"The {law} law alone, fitted to the {channels}",
        "coupons": f"The {law} law, fitted to the coupon tests and compared with the {channels}",
    }[found.law_from]
    best = words.best_probability(found)
    match found.verdict:
        case "explained":
            return f"{origin}, describes {'them' if many else 'it'}{best}: {_nothing_missing(found)}."
        case "law_too_poor":
            other = words.law_title(found.material.law)
            short = any(condition.name == "misfit_above_noise" for condition in found.conditions)
            return f"{origin}, leaves a misfit larger than the noise because the law is too poor: " + (
                f"{other} fits better without any further physics{best}, but not to within the noise."
                if short
                else f"{other} describes the same rubber without any further physics{best}."
            )
        case "unexplained" if found.unsearched:
            return (
                f"{origin}, may lack something. The search ended before it could tell which effects are probable: "
                f"none of them is ruled out.{_so_far(found)}"
            )
        case "unexplained":
            sure = words.missing_lines(found)[:1] or [f"Nothing {words.catalogue(found)} explains it"]
            return f"{origin}, leaves a misfit larger than the noise. {sure[0]}."
        case "faulty_data":
            return "A diagnosis is possible only after the data are corrected."
        case "missing_physics":
            if words.group_of(found) is not None:
                return f"{origin}, leaves something out: {words.missing_physics(found)}."
            if len(words.likely(found)) > 1:
                # Several effects may be probable together though none of them is alone.
                none = found.probability.get(NOTHING, 0.0)
                leaves = (
                    f"probably leaves something out ({words.chance(1.0 - none)})"
                    if none >= _DOUBT
                    else "leaves something out"
                )
                return f"{origin}, {leaves}: most probably {listed(words.effects_with_chance(found))}."
            return f"{origin}, leaves something out: {listed(words.effects_with_chance(found))}."


def _nothing_missing(found: Diagnosis) -> str:
    """Return what is said of the rest where the law alone describes the recordings."""
    said = "nothing is missing that these recordings could show"
    if words.shows_nothing(found):
        said += ", and they can show none of the effects considered"
    noise = {channel.name: channel.noise_percent for channel in found.measured}
    errors = {name: size for name, size in found.form_error.percent.items() if size > NOTABLE * noise[name]}
    if not errors:
        return said
    sizes = listed([f"{percent(size)} in {name}" for name, size in errors.items()])
    return f"{said}, if the formula of the law may err by {sizes} (rms, {words.relative_to(found)})"


def _so_far(found: Diagnosis) -> str:
    """Return a sentence on the best model of a search that ended too early; empty if only laws were fitted."""
    trials = [one for one in found.searched.trials if math.isfinite(one.log_evidence)]
    best = max(trials, key=lambda one: one.log_evidence, default=None)
    if best is None or not best.effects:
        return ""
    model = words.model_title(best.law, best.effects)
    return f" Of the {len(trials)} models fitted so far {model} is the most probable."


def _effects(found: Diagnosis) -> list[str]:
    """Return sentences on the effects of the most probable model, and on its law if that is not the plain one."""
    parts: list[str] = []
    for one in found.effects:
        values = parameters_text(one, found.measured)
        sure = "" if one.probability >= _SURE else f", {words.chance(one.probability)}"
        parts.append(f"{one.summary.rstrip('.')} ({one.label}{sure}: {values}).")
        if not one.plausible:
            parts += words.ended(
                [f"{one.label} is hardly plausible" + (f": {one.remark}" if one.remark else "")]
            )
    if found.material.law != found.plain.law:
        replaced = (
            f"the {words.law_title(found.material.law)} law in place of {words.law_title(found.plain.law)}"
        )
        parts.append(f"The model also has {replaced}: both changes together reduce the misfit.")
    elif found.law_from == "coupons" and not found.law_fixed:
        parts.append(
            "The law, too, is no longer that of the coupons but identified from the recordings: both together reduce "
            "the misfit."
        )
    return parts


def _gain(found: Diagnosis) -> str:
    parts: list[str] = []
    for channel in found.measured:
        if f"{channel.before_percent:.2g}" == f"{channel.after_percent:.2g}":
            continue
        held = ", held out," if channel.held_out else ""
        parts.append(
            f"{channel.name}{held} from {channel.before_percent:.2g} to {channel.after_percent:.2g} % {channel.of} "
            f"(noise {channel.noise_percent:.2g} %)"
        )
    if not parts:
        return ""
    what = "With it" if len(found.effects) == 1 else "With them" if found.effects else ""
    if not what and found.material.law != found.plain.law:
        what = f"With the {words.law_title(found.material.law)} law"
    falls = all(channel.after_percent <= channel.before_percent for channel in found.measured)
    change = "the misfit falls" if falls else "the misfit changes"
    return f"{what} {change}: {', '.join(parts)}." if what else f"{change.capitalize()}: {', '.join(parts)}."


def _rivals(found: Diagnosis) -> str:
    """Return a sentence with the other sets of effects that are possible, with their probabilities."""
    others = [one.text() for one in words.likely(found)[1:]]
    if not others:
        return ""
    if len(others) > _SETS:
        others = [*others[: _SETS - 1], "others"]
    if found.verdict == "explained":
        return f"Not ruled out: {', '.join(others)}."
    return f"These recordings cannot tell {words.likely(found)[0].text()} from: {'; '.join(others)}."
