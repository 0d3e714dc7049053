"""A diagnosis in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bushcli.casefile.unit import outside, unit
from bushcli.diagnosis.result import Diagnosis, Quantity
from bushcli.diagnosis.usual import usual_value
from bushcli.diagnosis.words import sentences
from bushcli.effect import ActiveEffect, EffectParameter, effects
from bushcli.recording import Recording
from cases.mode import modes

# An amplitude beyond this many times an ordinary one is remarkable, and so is a parameter at its bound.
REMARKABLE = 20.0
AT_BOUND = 1e-3


def plausibility(active: ActiveEffect, recordings: Sequence[Recording]) -> tuple[bool, str]:
    """Whether an effect's identified values are those of a real bushing, and why not."""
    for parameter in active.effect.amplitudes:
        if parameter.name not in active.values:
            continue
        value, off = active.values[parameter.name], float(parameter.off or 0.0)
        usual = usual_value(active.effect, parameter, recordings)
        if abs(value - off) > REMARKABLE * abs(usual - off):
            return False, (
                f"{parameter.name} = {value:.3g} {parameter.unit} is more than {REMARKABLE:g} times what is usual "
                f"({usual:.3g})"
            )
    for parameter in active.parameters:
        value = active.values[parameter.name]
        near = AT_BOUND * max(abs(value), 1e-9)
        if parameter.off is None and parameter.scan:
            if value <= parameter.lower + near or value >= parameter.upper - near:
                return False, f"{parameter.name} = {value:.3g} {parameter.unit} lies at its bound"
        elif value >= parameter.upper - near:
            return False, f"{parameter.name} = {value:.3g} {parameter.unit} lies at its bound"
    return True, "its parameters are of a size that real bushings have"


def paragraph(diagnosis: Diagnosis) -> str:
    """One paragraph: what was found, where, how much it helps, and what cannot be told."""
    parts = [_opening(diagnosis)]
    if diagnosis.verdict != "explained":
        parts += [f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in sentences(diagnosis.location)[:2]]
    if diagnosis.effects:
        parts.append(_effects(diagnosis))
        parts.append(_gain(diagnosis))
        parts += [f"{one.name}: {one.remark}." for one in diagnosis.effects if not one.plausible]
    elif diagnosis.verdict == "law_too_poor":
        parts.append(_gain(diagnosis))
    if diagnosis.verdict == "unexplained":
        nearest = " and ".join(one.name for one in diagnosis.effects)
        parts.append(
            f"Nothing in the catalogue of effects explains it; {nearest} comes nearest, and leaves more than noise."
            if nearest
            else "Nothing in the catalogue of effects, alone or with others, explains it."
        )
    parts.append(_rivals(diagnosis))
    if diagnosis.next_test is not None:
        parts.append(f"Next test: {diagnosis.next_test.text}")
    return " ".join(part for part in parts if part)


def _opening(diagnosis: Diagnosis) -> str:
    law = diagnosis.plain.law
    channels = " and ".join(channel.name for channel in diagnosis.channels)
    many = "s" if len(diagnosis.channels) > 1 else ""
    origin = {
        "recordings": f"The {law} law alone, fitted to the {channels} recording{many}",
        "coupons": f"The {law} law, fitted to the coupon tests and held against the {channels} recording{many}",
    }[diagnosis.law_from]
    if diagnosis.verdict == "explained":
        return f"{origin}, reaches the noise: nothing is missing that these recordings could show."
    if diagnosis.verdict == "law_too_poor":
        return (
            f"{origin}, misses more than noise because the law is too poor: "
            f"{diagnosis.material.law} describes the same rubber without any further physics."
        )
    if diagnosis.verdict == "unexplained":
        return f"{origin}, misses more than noise."
    names = " and ".join(one.name for one in diagnosis.effects)
    return f"{origin}, leaves out {names}."


def _effects(diagnosis: Diagnosis) -> str:
    told = []
    for one in diagnosis.effects:
        having = [c for c in diagnosis.channels if effects()[one.name].acts_on(c.mode)]
        turned = any(
            modes()[c.mode].rotational for c in having if one.channels is None or c.name in one.channels
        )
        values = ", ".join(
            _value(name, _at_the_door(effects()[one.name].parameter(name), quantity, turned))
            for name, quantity in one.parameters.items()
        )
        told.append(f"{one.summary.rstrip('.')} ({one.label}: {values}).")
    return " ".join(told)


def _at_the_door(parameter: EffectParameter, quantity: Quantity, rotational: bool) -> Quantity:
    """A parameter of a rotational channel in degrees; all others as they are."""
    if not (parameter.of_channel and rotational):
        return quantity
    value, std = (outside(parameter, v, rotational) for v in (quantity.value, quantity.std))
    return replace(quantity, value=value, std=std, unit=unit(parameter, rotational))


def _value(name: str, quantity: Quantity) -> str:
    unit_ = "" if quantity.unit == "1" else f" {quantity.unit}"
    for other, (value, other_unit) in quantity.derived.items():
        std = abs(value) * quantity.std / abs(quantity.value)
        return f"{other} = {value:.4g} ± {std:.2g}{'' if other_unit == '1' else ' ' + other_unit}"
    return f"{name} = {quantity.value:.3g} ± {quantity.std:.2g}{unit_}"


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
    others = [" with ".join(one) for one in diagnosis.rivals[1:]]
    if not others:
        return ""
    if diagnosis.verdict == "explained":
        return f"What these recordings could not show if it were there: {', '.join(others)}."
    if not diagnosis.effects:
        return ""
    return f"These recordings cannot tell it from: {', '.join(others)}."


def label(names: Sequence[str]) -> str:
    """A set of effects in words."""
    return " + ".join(names) if names else "no effect"


def needs(name: str) -> str:
    """What a recording must contain for an effect to be identified."""
    return effects()[name].needs
