"""A diagnosis in sentences: names, headline, alternatives that it cannot distinguish, extent of the search."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from bushcli.diagnosis.result import SMALL, Diagnosis, Group
from bushcli.effects.names import effect_name
from bushcli.effects.titles import NOTHING, UNKNOWN, phrase, within
from bushcli.report.document import Tone
from bushcli.report.quantity import join_names, percent
from bushcli.report.verdict import faulty_data

# A probability beyond these is given as a limit, because no model is certain.
_ALMOST_NEVER, _ALMOST_CERTAIN = 0.01, 0.99
# Sets of effects that are less probable than this are in the tables only.
_NAMED = 0.05
# Largest number of sets of effects in the headline.
_SETS = 3
# Unknown physics less probable than this is reported with the remaining misfit and is not called missing.
_POSSIBLE = 0.05

# Percent, below which it would be printed as 0.00.
_SHOWN = 0.005


@dataclass(frozen=True)
class Likely:
    """A set of effects of the fewest that hold 95 % of the probability, which is the sum over the laws."""

    effects: tuple[str, ...]
    probability: float

    def text(self, none: str = "no effect") -> str:
        """Return the effects with their probability: "Mullins softening with friction and offset (97 %)"."""
        return f"{together(self.effects, none)} ({chance(self.probability)})"


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence, without its full stop, and that it misses what was held out, if it does."""
    missed = any(condition.name == "held_out_missed" for condition in diagnosis.conditions)
    note = "; but it does not predict what was held out" if missed else ""
    law, best = law_title(diagnosis.material.law), best_probability(diagnosis)
    match diagnosis.verdict:
        case "explained":
            blind = ", which can show none of the effects" if shows_nothing(diagnosis) else ""
            claim = f"the {law} law alone describes the recordings"
            return f"Explained: {claim}{best}{blind}{_not_ruled_out(diagnosis)}{note}"
        case "law_too_poor":
            claim = f"the {law} law describes the recordings without any effect{best}"
            return f"Law too poor: {law_title(diagnosis.plain.law)}; {claim}{_not_ruled_out(diagnosis)}{note}"
        case "missing_physics":
            return f"Missing physics: {missing_physics(diagnosis)}{note}"
        case "unexplained" if diagnosis.is_unsearched:
            return f"Not diagnosed: the search ended before it could tell which effects are probable{note}"
        case "unexplained":
            beside = f"; also {join_names(effects_with_chance(diagnosis))}" if diagnosis.effects else ""
            p = f" ({chance(diagnosis.probability[UNKNOWN])})" if UNKNOWN in diagnosis.probability else best
            rivals = _not_ruled_out(diagnosis, [UNKNOWN])
            rivals += ", with nothing unknown" if rivals else ""
            return f"Unexplained: something is missing that is not {catalogue(diagnosis)}{p}{beside}{rivals}{note}"
        case "faulty_data":
            return f"{faulty_data(diagnosis.faults)}{note}"


def shows_nothing(diagnosis: Diagnosis) -> bool:
    """Whether these recordings can show none of the effects considered, whatever their size."""
    considered = set(diagnosis.probability) - {NOTHING, UNKNOWN}
    return bool(considered) and considered <= set(diagnosis.searched.untestable)


def likely(diagnosis: Diagnosis) -> tuple[Likely, ...]:
    """Return the sets of effects to be named: the best model's, and those of the credible set with at least 5 %.

    A single other set of the credible set is named in any case.
    """
    if not diagnosis.models:
        return ()
    probability: defaultdict[frozenset[str], float] = defaultdict(float)
    for model in diagnosis.models:
        probability[frozenset(model.effects)] += model.probability
    names = (diagnosis.models[0].effects, *diagnosis.rivals)
    sets = [Likely(effects, probability[frozenset(effects)]) for effects in names]
    named = [candidate for candidate in sets[1:] if candidate.probability >= _NAMED]
    if not named and len(sets) == 2:
        # Without it the first set would be named alone, with less than what is certain.
        named = sets[1:]
    return (sets[0], *named)


def best_probability(diagnosis: Diagnosis) -> str:
    """Return the probability of the most probable set of effects in brackets; empty if no models were compared."""
    sets = likely(diagnosis)
    return f" ({chance(sets[0].probability)})" if sets else ""


def effects_with_chance(diagnosis: Diagnosis) -> list[str]:
    """Return the effects of the most probable model, each with its own probability."""
    return [f"{name} ({p})" for name, p in effect_chances(diagnosis).items()]


def effect_chances(diagnosis: Diagnosis) -> dict[str, str]:
    """Return the effects of the most probable model and their probabilities; with channels if one occurs twice."""
    names = [effect_name(effect.name) for effect in diagnosis.effects]
    chances = {}
    for effect, name in zip(diagnosis.effects, names, strict=True):
        if effect.channels and names.count(name) > 1:
            chances[f"{within(effect.title)} ({', '.join(effect.channels)})"] = chance(effect.probability)
        else:
            # Without a channel it is the effect in any of them.
            chances[within(effect.title)] = chance(diagnosis.probability.get(name, effect.probability))
    return chances


def catalogue(diagnosis: Diagnosis) -> str:
    """Return the words for the effects that were considered: "in the catalogue of effects"."""
    if diagnosis.searched.not_simulated:
        return "among the effects with which the bushing can be simulated"
    if diagnosis.asked is None:
        return "in the catalogue of effects"
    return f"among the effects asked for ({join_names([phrase(name) for name in diagnosis.asked])})"


def group_of(diagnosis: Diagnosis) -> Group | None:
    """Return the group of which each likely set has one member, not the same in all sets; None without such a group.

    Sets in which the unknown effect stands in place of known ones do not count.
    """
    rests = _without_unknown(diagnosis)
    for group in sorted(diagnosis.groups, key=lambda group: (len(group.effects), -group.probability)):
        members = {effect_name(name) for name in group.effects}
        # A set with two members says that both are there, which "one or the other" denies.
        if len(rests) > 1 and all(len(members & set(map(effect_name, rest.effects))) == 1 for rest in rests):
            return group
    return None


def group_text(group: Group) -> str:
    """Return a group with its probability: "dissipation (97 %): internal friction or viscoelasticity, ..."."""
    p = f" ({chance(group.probability)})"
    if group.name and group.text.startswith(group.name):
        return f"{group.name}{p}{group.text[len(group.name) :]}"
    return f"{group.text}{p}"


def missing_physics(diagnosis: Diagnosis) -> str:
    """Return what was left out: the certain effects, then the group or the alternative sets."""
    sets, effects = likely(diagnosis), effects_with_chance(diagnosis)
    if len(sets) < 2:
        chances, together_chance = effect_chances(diagnosis), chance(sets[0].probability)
        if len(chances) == 1 and together_chance not in chances.values():
            return f"{join_names(effects)}, with nothing else ({together_chance})"
        return f"{join_names(list(chances))} ({together_chance})"
    common, parts = _common(sets), _differing_parts(diagnosis)
    pairs = zip(effects, diagnosis.effects, strict=True)
    certain = [text for text, effect in pairs if effect.name in common]
    group = group_of(diagnosis)
    if group is not None:
        members = {effect_name(name) for name in group.effects}
        more = {name for candidate in _without_unknown(diagnosis) for name in candidate.effects}
        others = sorted(name for name in more if effect_name(name) not in members)
        possible = f"; perhaps also {join_names([phrase(name) for name in others])}" if others else ""
        unknown = [candidate for candidate in parts if candidate.effects == (UNKNOWN,)]
        besides = f"; not ruled out: {unknown[0].text()}" if unknown else ""
        # It follows a colon, and a sentence must not have two.
        return " and ".join([*certain, group_text(group).replace(": ", "; ", 1)]) + possible + besides
    if certain:
        rests = first_few([candidate.text("nothing else") for candidate in parts])
        return (
            f"{join_names(certain)}, with {', or with '.join(rests)}; these recordings cannot tell them apart"
        )
    # No effect is not missing: it is named as what else is possible.
    rests = first_few([candidate.text() for candidate in sets if candidate.effects])
    besides = "".join(f"; not ruled out: {candidate.text()}" for candidate in sets if not candidate.effects)
    apart = "; these recordings cannot tell them apart" if len(rests) > 1 else ""
    return f"{', or '.join(rests)}{apart}{besides}"


def first_few(sets: list[str], most: int = _SETS) -> list[str]:
    """Return what there is room for: the first sets, and a word for the others."""
    return [*sets[: most - 1], "others"] if len(sets) > most else sets


def _differing_parts(diagnosis: Diagnosis) -> list[Likely]:
    """Return the likely sets without the effects that all of them have."""
    sets = likely(diagnosis)
    common = _common(sets)
    return [
        replace(candidate, effects=tuple(n for n in candidate.effects if n not in common))
        for candidate in sets
    ]


def _common(sets: Iterable[Likely]) -> set[str]:
    return set.intersection(*(set(candidate.effects) for candidate in sets)) if sets else set()


def _without_unknown(diagnosis: Diagnosis) -> list[Likely]:
    """Return the differing parts without those that consist of the unknown effect alone."""
    return [candidate for candidate in _differing_parts(diagnosis) if candidate.effects != (UNKNOWN,)]


def _not_ruled_out(diagnosis: Diagnosis, without: Sequence[str] = ()) -> str:
    """Return the other likely sets, except those that have one of the effects `without`."""
    others = [
        candidate.text() for candidate in likely(diagnosis)[1:] if not set(candidate.effects) & set(without)
    ]
    return f"; not ruled out: {', '.join(first_few(others))}" if others else ""


def tone(diagnosis: Diagnosis) -> Tone:
    """Return the tone of the verdict, which selects its colour."""
    tones: dict[str, Tone] = {"explained": "good", "unexplained": "bad", "faulty_data": "bad"}
    return tones.get(diagnosis.verdict, "plain")


def is_missing(diagnosis: Diagnosis) -> bool:
    """Whether unknown physics is probable enough to be reported as missing."""
    return diagnosis.missing is not None and (
        diagnosis.verdict == "unexplained" or diagnosis.missing.probability >= _POSSIBLE
    )


def missing_lines(diagnosis: Diagnosis) -> list[str]:
    """Return sentences on the unknown physics: its probability, its share of the misfit, its appearance."""
    missing = diagnosis.missing
    if missing is None:
        return []
    probability = f"With a probability of {chance(missing.probability)}"
    certainty = f"{probability} something is missing that is not {catalogue(diagnosis)}"
    none = "no known effect" if diagnosis.asked is None else "none of the effects asked for"
    none = "none of these" if diagnosis.searched.not_simulated else none
    share = f"{percent(100 * missing.share)} of the misfit of the plain law (squared, above the noise)"
    return [certainty, f"{share} is explained by {none}", *missing.text]


def form_error_line(diagnosis: Diagnosis) -> str:
    """Return a sentence on the form error and how much of the remaining misfit it covers; empty without models."""
    form = diagnosis.form_error
    if not diagnosis.models:
        return ""
    by_channel = _sizes(form.percent)
    size = f"of {join_names(by_channel)} (rms, {relative_to(diagnosis)})"
    only = "" if form.covers >= 0.5 else "only "
    share = "all" if form.covers >= 0.995 else percent(100 * form.covers)
    covered = f"{only}{share} of the remaining misfit above the noise"
    if UNKNOWN in diagnosis.models[0].effects:
        return f"The unknown force, {size}, accounts for {covered}" if by_channel else ""
    fast = f"{join_names(_sizes(form.fast))} changes too fast along the branches to count, as hum or rounding does"
    if not by_channel:
        all_noise = "the misfit of the most probable model is all noise"
        left = f"of the misfit of the most probable model {fast}" if form.fast else all_noise
        return f"Errors of the formulas do not show beside the noise: {left}"
    fitted = [channel for channel in diagnosis.measured_channels if not channel.held_out]
    remainder = f"this accounts for {covered}"
    if form.covers >= 1.0 and all(channel.after_percent <= channel.noise_percent for channel in fitted):
        remainder = "the remaining misfit is no larger than the noise"
    if form.fast:
        remainder = f"this accounts for {covered} that is smooth along the branches; {fast}"
    return f"The formulas of the most probable model are assumed to err by {size[3:]}; {remainder}"


def _sizes(by_channel: Mapping[str, float]) -> list[str]:
    """Return the sizes, in percent, of those channels in which they are not 0.00."""
    return [f"{percent(value)} in {name}" for name, value in by_channel.items() if value >= _SHOWN]


def rival_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the groups and the sets of effects that these recordings cannot distinguish, with their probabilities."""
    lines = [f"{text[:1].upper()}{text[1:]}" for text in map(group_text, diagnosis.groups)]
    sets = [candidate.text() for candidate in likely(diagnosis)]
    return [*lines, f"These recordings cannot tell apart: {'; '.join(sets)}"] if len(sets) > 1 else lines


def next_test_lines(diagnosis: Diagnosis) -> list[str]:
    """Return sentences on the proposed test and the information expected from it, or on why none is proposed."""
    test = diagnosis.next_test
    if test is None:
        # Of a search that did not end by itself nothing is said.
        if not diagnosis.rivals or diagnosis.searched.ended != "nothing left":
            return []
        sets = (diagnosis.models[0].effects, *diagnosis.rivals)
        why = "none of those considered is expected to tell the rivals apart"
        if sum(UNKNOWN not in effects for effects in sets) < 2:
            why = "of unknown physics nothing can be predicted"
        return [f"No test is proposed: {why}"]
    bits = f"{test.information:.2f} of the {test.possible:.2f} bits of information that are still open"
    return [test.text, f"It is expected to give {bits}"] if test.possible > 0 else [test.text]


def searched_lines(diagnosis: Diagnosis) -> list[str]:
    """Return sentences on the number of fitted models, whether others matter, and models that could not be solved."""
    searched = diagnosis.searched
    count = len(searched.trials)
    if diagnosis.verdict == "faulty_data" or not count:
        return []
    fitted = f"{count} {'model was' if count == 1 else 'models were'} fitted, the others predicted"
    ends = {"budget": ": the time limit was reached", "interrupted": ": the search was interrupted"}
    shift = f"fitting these too could shift {chance(searched.left)} of the probability"
    lines = [f"{fitted}; {shift}{ends.get(searched.ended, '')}"]
    if searched.lost:
        lines.append(f"Could not be solved from any start: {'; '.join(searched.lost)}")
    return lines


def relative_to(diagnosis: Diagnosis) -> str:
    """Return what percentages of misfits are relative to: the force range, K* of tables, or both."""
    return " or ".join(dict.fromkeys(channel.of for channel in diagnosis.measured_channels))


def as_sentences(lines: Iterable[str]) -> list[str]:
    """Return sentences, each with an initial capital and a full stop; empty lines are left out."""
    return [f"{line[:1].upper()}{line[1:].rstrip('.')}." for line in lines if line]


def law_title(name: str) -> str:
    """Return the name of a law as in the literature: "Mooney-Rivlin", "neo-Hookean"."""
    return "-".join(part if part == "neo" else part.capitalize() for part in name.split("_"))


def together(names: Sequence[str], none: str = "no effect") -> str:
    """Return a set of effects as part of a sentence: "Mullins softening with internal friction and offset"."""
    main, *others = [phrase(name) for name in names] or [none]
    return f"{main} with {join_names(others)}" if others else main


def model_title(law: str, names: Sequence[str], variants: Mapping[str, str] | None = None) -> str:
    """Return a model as a table shows it: "Yeoh + Mullins softening + offset (radial)", "Yeoh alone"."""
    if not names:
        return f"{law_title(law)} alone"
    forms = variants or {}
    parts = [f"{phrase(name)} ({forms[name]})" if forms.get(name) else phrase(name) for name in names]
    return " + ".join((law_title(law), *parts))


def chance(probability: float) -> str:
    """Return a probability in words: "97 %", "more than 99 %", "less than 1 %"; never 0 or 100 %."""
    return short_chance(probability).replace(">", "more than").replace("<", "less than")


def short_chance(probability: float) -> str:
    """Return a probability for a table: "97 %", "> 99 %", "< 1 %"; a dash for nan."""
    if probability != probability:
        return "-"
    if probability < _ALMOST_NEVER:
        return "< 1 %"
    return "> 99 %" if probability > _ALMOST_CERTAIN else f"{100 * probability:.0f} %"


def ranked_effects(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    """Return all effects with their probabilities, the most probable first."""
    return sorted(diagnosis.probability.items(), key=lambda item: -item[1])


def unlikely(diagnosis: Diagnosis) -> list[str]:
    """Return the effects that are hardly probable although these recordings could show them."""
    untestable = diagnosis.searched.untestable
    return [name for name, p in ranked_effects(diagnosis) if p < SMALL and name not in untestable]
