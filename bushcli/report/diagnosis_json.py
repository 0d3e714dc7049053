"""Diagnosis -> JSON, as scripts rely on it; displacements of rotational modes in degrees."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.casefile import Material
from bushcli.diagnosis.where.record import Location, Mismatch
from bushcli.diagnosis.result import Diagnosis, Hypothesis, Named, NextTest, Quantity
from bushcli.diagnosis.words import sentence
from bushcli.effect import effect_name, spoken
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_words import amplitudes, derived, headline, shown
from bushcli.report.document import cleaned, head
from bushcli.report.quantity import quantities


def diagnosis_json(found: Diagnosis, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a diagnosis as JSON-ready data."""
    document = head("diagnose", found.case, found.conditions, timings)
    document |= {
        "verdict": found.verdict,
        "headline": headline(found),
        "text": paragraph(found),
        "asked": None if found.asked is None else list(found.asked),
        "law_from": found.law_from,
        "law_fixed": found.law_fixed,
        "law": found.material.law,
        "plain": _material(found.plain),
        "material": _material(found.material),
        "parameters": {name: _quantity(found, name, quantity) for name, quantity in found.parameters.items()},
        "effects": [_effect(found, effect) for effect in found.effects],
        "rivals": _rivals(found),
        "mismatch": _mismatches(found, found.location),
        "remaining": _mismatches(found, found.remaining),
        "excess": {"before": found.location.excess, "after": found.remaining.excess},
        "misfit": _misfit(found),
        "next_test": None if found.next_test is None else _next_test(found, found.next_test),
        "hypotheses": [_hypothesis(found, one) for one in found.hypotheses],
        "path": [
            {
                "action": stage.action,
                "effects": list(map(spoken, stage.effects)),
                "law": stage.law,
                "bic": stage.bic,
                "misfit": stage.misfit,
                "held_out": stage.held_out,
                "text": stage.text,
            }
            for stage in found.path
        ],
        "maps": [
            {
                "channel": one.name,
                "channels": list(one.channels),
                "local_gain": one.local_gain,
                "uniform_gain": one.uniform_gain,
                "helps_locally": one.helps_locally,
                "text": one.text,
            }
            for one in found.maps
        ],
        "forward_solves": found.forward_solves,
        "failed_solves": found.failed_solves,
        "seconds": found.seconds,
    }
    return cleaned(document)


def _rivals(found: Diagnosis) -> list[list[str]]:
    """Sets of effects by their own names; with the rig where that alone tells a set from the chosen one."""
    sets: list[list[str]] = []
    for names in found.rivals:
        own = list(dict.fromkeys(map(effect_name, names)))
        sets.append(own if own not in sets[:1] else list(map(spoken, names)))
    return sets


def _material(material: Material) -> dict[str, Any]:
    return {
        "law": material.law,
        "bulk_modulus": material.bulk_modulus,
        "parameters": dict(material.parameters),
    }


def _quantity(found: Diagnosis, name: str, quantity: Quantity) -> dict[str, Any]:
    door = shown(name, quantity, found.channels)
    return {
        "value": door.value,
        "std": door.std,
        "unit": door.unit,
        "lower": door.lower,
        "upper": door.upper,
        "meaning": quantity.meaning,
        "derived": {also: {"value": value, "unit": of} for also, (value, of) in derived(quantity).items()},
    }


def _effect(found: Diagnosis, effect: Named) -> dict[str, Any]:
    return {
        "name": effect_name(effect.name),
        "channels": None if effect.channels is None else list(effect.channels),
        "summary": effect.summary,
        "parameters": {
            name: _quantity(found, f"{effect.name}.{name}", quantity)
            for name, quantity in effect.parameters.items()
        },
        "evidence": effect.evidence,
        "plausible": effect.plausible,
        "remark": effect.remark,
    }


def _mismatches(found: Diagnosis, location: Location) -> list[dict[str, Any]]:
    return [_mismatch(one, len(found.channels)) for one in location.mismatch]


def _mismatch(one: Mismatch, channels: int) -> dict[str, Any]:
    units = quantities(one.mode)
    return {
        "channel": one.channel,
        "mode": one.mode,
        "cycle": list(one.cycle),
        "branch": one.branch,
        "side": one.side,
        "displacement_from": units.per_internal * one.displacement_from,
        "displacement_to": units.per_internal * one.displacement_to,
        "rate": None if one.rate is None else [units.per_internal * rate for rate in one.rate],
        "share": one.share,
        "sign": one.sign,
        "relative": one.relative,
        "difference": one.difference,
        "rms": one.rms,
        "p": one.p,
        "text": sentence(one, channels),
    }


def _misfit(found: Diagnosis) -> dict[str, Any]:
    """By channel, in percent of the recorded force range; null where nothing was held out."""
    return {
        "before": {one.name: one.before_percent for one in found.channels},
        "after": {one.name: one.after_percent for one in found.channels},
        "noise": {one.name: one.noise_percent for one in found.channels},
        "held_out": {one.name: one.held_out_text for one in found.channels},
        "held_out_before": {one.name: one.held_out_before for one in found.channels},
        "held_out_after": {one.name: one.held_out_after for one in found.channels},
    }


def _next_test(found: Diagnosis, test: NextTest) -> dict[str, Any]:
    units = quantities(_mode(found, test))
    return {
        "name": test.name,
        "channel": test.channel,
        "points": [units.per_internal * point for point in test.points],
        "rates": [units.per_internal * rate for rate in test.rates],
        "holds": list(test.holds),
        "unit": units.displacement_unit or "1",
        "minutes": test.minutes,
        "separates": [list(pair) for pair in test.separates],
        "distance": test.distance,
        "text": test.text,
    }


def _mode(found: Diagnosis, test: NextTest) -> str:
    """Mode of the test to be made: that of a recorded channel of this name, or the name itself."""
    return {one.name: one.mode for one in found.channels}.get(test.channel, test.channel)


def _hypothesis(found: Diagnosis, one: Hypothesis) -> dict[str, Any]:
    return {
        "name": one.name,
        "testable": one.testable,
        "reason": one.reason,
        "drop": one.drop,
        "z": one.z,
        "p": one.p,
        "amplitude": {
            name: {"value": door.value, "unit": door.unit}
            for name, door in amplitudes(one, found.channels).items()
        },
        "refitted": one.refitted,
        "bic": one.bic,
        "misfit": one.misfit,
        "chosen": one.chosen,
        "channels": None if one.channels is None else list(one.channels),
    }
