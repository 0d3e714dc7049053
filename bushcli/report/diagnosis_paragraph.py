"""A diagnosis in one paragraph of plain words."""

from __future__ import annotations

import numpy as np

from bushcli.diagnosis.result import Diagnosis, Quantity
from bushcli.diagnosis.words import sentences
from bushcli.effect import spoken
from bushcli.report.diagnosis_words import ShownQuantity, derived, effect_names, nothing, shown, tail
from bushcli.report.quantity import listed


def paragraph(diagnosis: Diagnosis) -> str:
    """One paragraph: what was found, where, how much it helps, and what cannot be told."""
    parts = [_opening(diagnosis)]
    if diagnosis.verdict != "explained":
        parts += [f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in sentences(diagnosis.location)[:2]]
    if diagnosis.effects:
        parts.append(_effects(diagnosis))
        parts.append(_law(diagnosis))
        parts.append(_gain(diagnosis))
        parts += [f"{one.label}: {one.remark}." for one in diagnosis.effects if not one.plausible]
    elif diagnosis.verdict == "law_too_poor":
        parts.append(_gain(diagnosis))
    if diagnosis.verdict == "unexplained":
        tried = nothing(diagnosis)[:1].upper() + nothing(diagnosis)[1:]
        nearest = " and ".join(effect_names(diagnosis))
        parts.append(
            f"{tried} explains it; {nearest} comes nearest, and leaves more than noise."
            if nearest
            else f"{tried}, alone or with others, explains it."
        )
    parts.append(_rivals(diagnosis))
    if diagnosis.next_test is not None:
        parts.append(f"Next test: {diagnosis.next_test.text}")
    return " ".join(part for part in parts if part)


def _opening(diagnosis: Diagnosis) -> str:
    law = diagnosis.plain.law
    channels = listed([channel.name for channel in diagnosis.channels])
    many = "s" if len(diagnosis.channels) > 1 else ""
    origin = {
        "recordings": f"The {law} law alone, fitted to the {channels} recording{many}",
        "coupons": f"The {law} law, fitted to the coupon tests and held against the {channels} recording{many}",
    }[diagnosis.law_from]
    if diagnosis.verdict == "explained":
        return f"{origin}, reaches the noise: nothing is missing that these recordings could show."
    if diagnosis.verdict == "law_too_poor":
        other = diagnosis.material.law
        short = any(condition.name == "misfit_above_noise" for condition in diagnosis.conditions)
        return f"{origin}, misses more than noise because the law is too poor: " + (
            f"{other} comes nearer without any further physics, though not to the noise."
            if short
            else f"{other} describes the same rubber without any further physics."
        )
    if diagnosis.verdict == "unexplained":
        return f"{origin}, misses more than noise."
    names = " and ".join(effect_names(diagnosis))
    return f"{origin}, leaves out {names}."


def _law(diagnosis: Diagnosis) -> str:
    """What became of the law beside the effects."""
    if diagnosis.material.law != diagnosis.plain.law:
        replaced = f"the law {diagnosis.material.law} in place of {diagnosis.plain.law}"
        return f"Beside it stands {replaced}: the fall of the misfit is that of both."
    if diagnosis.law_from == "coupons" and not diagnosis.law_fixed:
        return (
            "Beside it the law is no longer that of the coupons, but identified from the recordings: the fall of the "
            "misfit is that of both."
        )
    return ""


def _effects(diagnosis: Diagnosis) -> str:
    told = []
    for one in diagnosis.effects:
        values = ", ".join(
            _value(name, quantity, shown(f"{one.name}.{name}", quantity, diagnosis.channels))
            for name, quantity in one.parameters.items()
        )
        told.append(f"{one.summary.rstrip('.')} ({one.label}: {values}).")
    return " ".join(told)


def _value(name: str, quantity: Quantity, door: ShownQuantity) -> str:
    """A parameter by the name that the field has for it, where it has one; with the total where it adds to something.

    The errors are to first order, of r = 1/x as of 1/(x + y) with a given y: their squares times that of x.
    """
    told, first = [], 0.0
    for other, (value, unit) in derived(quantity).items():
        first = first or value
        std = value**2 / abs(first) * quantity.std / abs(quantity.value)
        told.append(f"{other} = {value:.4g} ± {std:.2g}{tail(unit)}")
    return ", ".join(told) or f"{name} = {door.value:.3g} ± {door.std:.2g}{tail(door.unit)}"


def _gain(diagnosis: Diagnosis) -> str:
    told = []
    for channel in diagnosis.channels:
        text = (
            f"{channel.name} from {channel.before_percent:.2g} to {channel.after_percent:.2g} % of the force range "
            f"(noise {channel.noise_percent:.2g} %"
        )
        if np.isfinite(channel.held_out_before) and np.isfinite(channel.held_out_after):
            text += f"; {channel.held_out_text}, held out: from {channel.held_out_before:.2g} "
            text += f"to {channel.held_out_after:.2g} %"
        told.append(text + ")")
    what = "With it" if len(diagnosis.effects) == 1 else "With them" if diagnosis.effects else "With that law"
    return f"{what} the misfit falls: " + ", ".join(told) + "."


def _rivals(diagnosis: Diagnosis) -> str:
    others = [" with ".join(map(spoken, one)) for one in diagnosis.rivals[1:]]
    if not others:
        return ""
    if diagnosis.verdict == "explained":
        return f"What these recordings could not show if it were there: {', '.join(others)}."
    if not diagnosis.effects:
        return ""
    return f"These recordings cannot tell it from: {', '.join(others)}."
