"""A diagnosis -> JSON-ready data; displacements of rotational modes are in degrees."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.diagnosis.result import DiagnosedEffect, Diagnosis, NextTest, Quantity
from bushcli.diagnosis.words import sentence
from bushcli.effects.names import effect_name
from bushcli.mismatch.maps import MissingProfile
from bushcli.mismatch.record import Location, Mismatch
from bushcli.report.json.common import cleaned, faults_json, head, material_json
from bushcli.report.quantity import quantities
from bushcli.report.views.diagnosis.paragraph import paragraph
from bushcli.report.views.diagnosis.values import derived, shown
from bushcli.report.views.diagnosis.words import headline
from bushcli.selection.searched import Searched


def diagnosis_json(found: Diagnosis, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a diagnosis as JSON-ready data.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    timings : mapping of str to float
        Seconds by stage.
    """
    document = head("diagnose", found.case, found.conditions, timings)
    document |= {
        "verdict": found.verdict,
        "headline": headline(found),
        "text": paragraph(found),
        "asked": None if found.asked is None else list(found.asked),
        "law_from": found.law_from,
        "law_fixed": found.law_fixed,
        "law": found.material.law,
        "plain": material_json(found.plain),
        "material": material_json(found.material),
        "parameters": {name: _quantity(found, name, quantity) for name, quantity in found.parameters.items()},
        "effects": [_effect(found, effect) for effect in found.effects],
        "probability": dict(found.probability),
        "models": _models(found),
        "rivals": _rivals(found),
        "groups": _groups(found),
        "form_error": {
            "share": found.form_error.share,
            "percent": dict(found.form_error.percent),
            "covers": found.form_error.covers,
        },
        "missing": _missing(found),
        "searched": _searched(found.searched),
        "data_faults": faults_json(found.faults),
        "mismatch": _mismatches(found, found.location),
        "remaining": _mismatches(found, found.remaining),
        "excess": {"before": found.location.excess, "after": found.remaining.excess},
        "misfit": _misfit(found),
        "next_test": None if found.next_test is None else _next_test(found, found.next_test),
        "maps": _maps(found),
        "forward_solves": found.forward_solves,
        "failed_solves": found.failed_solves,
        "seconds": found.seconds,
    }
    return cleaned(document)


def _models(found: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "law": one.law,
            "effects": list(one.effects),
            "probability": one.probability,
            "log_evidence": one.log_evidence,
            "misfit": one.misfit,
            "form_error": one.form_error,
            "variants": dict(one.variants),
        }
        for one in found.models
    ]


def _groups(found: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "name": one.name,
            "effects": list(one.effects),
            "probability": one.probability,
            "text": one.text,
        }
        for one in found.groups
    ]


def _maps(found: Diagnosis) -> list[dict[str, Any]]:
    return [
        {
            "channel": one.name,
            "channels": list(one.channels),
            "local_gain": one.local_gain,
            "uniform_gain": one.uniform_gain,
            "helps_locally": one.helps_locally,
            "text": one.text,
        }
        for one in found.maps
    ]


def _rivals(found: Diagnosis) -> list[list[str]]:
    """Return the sets of effects without rigs, unless the rigs alone make a set differ from the first one."""
    first = list(dict.fromkeys(map(effect_name, found.models[0].effects))) if found.models else None
    sets: list[list[str]] = []
    for names in found.rivals:
        own = list(dict.fromkeys(map(effect_name, names)))
        sets.append(list(names) if own == first else own)
    return sets


def _missing(found: Diagnosis) -> dict[str, Any] | None:
    if found.missing is None:
        return None
    modes = {one.name: one.mode for one in found.channels}
    return {
        "probability": found.missing.probability,
        "share": found.missing.share,
        "text": list(found.missing.text),
        "profiles": [_profile(one, modes.get(one.channel, one.channel)) for one in found.missing.profiles],
    }


def _profile(one: MissingProfile, mode: str) -> dict[str, Any]:
    units = quantities(mode)
    scale = units.per_internal if one.along in ("displacement", "rate") else 1.0
    length = units.displacement_unit or "1"
    unit = {"displacement": length, "time": "s", "cycle": "1", "rate": f"{length}/s"}[one.along]
    return {
        "channel": one.channel,
        "along": one.along,
        "branch": one.branch,
        "unit": unit,
        "x": scale * one.x,
        "mean": one.mean,
        "std": one.std,
    }


def _searched(found: Searched) -> dict[str, Any]:
    return {
        "complete": found.complete,
        "left": found.left,
        "ended": found.ended,
        "trials": [
            {
                "law": one.law,
                "effects": list(one.effects),
                "predicted": one.predicted,
                "log_evidence": one.log_evidence,
                "misfit": one.misfit,
                "text": one.text,
            }
            for one in found.trials
        ],
        "lost": list(found.lost),
        "untestable": dict(found.untestable),
    }


def _quantity(found: Diagnosis, name: str, quantity: Quantity) -> dict[str, Any]:
    value = shown(name, quantity, found.channels)
    return {
        "value": quantity.word or value.value,
        "std": value.std,
        "unit": value.unit,
        "lower": value.lower,
        "upper": value.upper,
        "meaning": quantity.meaning,
        "prior": None
        if value.prior is None
        else {
            "lower": value.prior[0],
            "upper": value.prior[1],
            "tail": quantity.prior_tail,
            "source": quantity.prior_source,
        },
        "derived": {also: {"value": value, "unit": of} for also, (value, of) in derived(quantity).items()},
    }


def _effect(found: Diagnosis, effect: DiagnosedEffect) -> dict[str, Any]:
    return {
        "name": effect_name(effect.name),
        "title": effect.title,
        "channels": None if effect.channels is None else list(effect.channels),
        "summary": effect.summary,
        "parameters": {
            name: _quantity(found, f"{effect.name}.{name}", quantity)
            for name, quantity in effect.parameters.items()
        },
        "probability": effect.probability,
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
    """Return the misfits by channel, percent of the recorded force range; null for channels not held out."""
    held = [one.name for one in found.channels if one.held_out]
    before = {one.name: one.before_percent for one in found.channels}
    after = {one.name: one.after_percent for one in found.channels}
    return {
        "before": before,
        "after": after,
        "noise": {one.name: one.noise_percent for one in found.channels},
        "held_out_before": {name: value if name in held else None for name, value in before.items()},
        "held_out_after": {name: value if name in held else None for name, value in after.items()},
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
        "information": test.information,
        "possible": test.possible,
        "text": test.text,
    }


def _mode(found: Diagnosis, test: NextTest) -> str:
    """Return the mode of the proposed test: that of the recorded channel of this name, else the name itself."""
    return {one.name: one.mode for one in found.channels}.get(test.channel, test.channel)
