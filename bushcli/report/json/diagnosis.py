"""A diagnosis -> JSON-ready data; displacements of rotational modes are in degrees."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bushcli.diagnosis.result import DiagnosedTable, Diagnosis, NextTest, Quantity
from bushcli.diagnosis.words import sentence
from bushcli.effects.names import effect_name
from bushcli.mismatch.maps import MissingProfile
from bushcli.mismatch.record import Mismatch
from bushcli.report.json.common import cleaned, faults_json, head, material_json, part
from bushcli.report.json.dynamic_tables import compared_json
from bushcli.report.quantity import quantities
from bushcli.report.views.diagnosis.paragraph import paragraph
from bushcli.report.views.diagnosis.values import derived, shown
from bushcli.report.views.diagnosis.words import headline


def diagnosis_json(found: Diagnosis, timings: Mapping[str, float]) -> dict[str, Any]:
    """Return a diagnosis as JSON-ready data.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    timings : mapping of str to float
        Seconds by stage.
    """
    document, searched = head("diagnose", found.case, found.conditions, timings), found.searched
    modes, test = {one.name: one.mode for one in found.measured}, found.next_test
    document |= {
        "verdict": found.verdict,
        "headline": headline(found),
        "text": paragraph(found),
        **part(found, "asked law_from law_fixed uniform_odds"),
        "law": found.material.law,
        "plain": material_json(found.plain),
        "material": material_json(found.material),
        "parameters": {name: _quantity(found, name, quantity) for name, quantity in found.parameters.items()},
        "effects": [
            {
                "name": effect_name(effect.name),
                **part(effect, "title channels summary"),
                "parameters": {
                    name: _quantity(found, f"{effect.name}.{name}", quantity)
                    for name, quantity in effect.parameters.items()
                },
                **part(effect, "probability evidence plausible remark"),
            }
            for effect in found.effects
        ],
        "probability": found.probability,
        "models": [
            part(one, "law effects probability log_evidence misfit form_error variants")
            for one in found.models
        ],
        "rivals": _rivals(found),
        "groups": [part(one, "name effects probability text") for one in found.groups],
        "form_error": part(found.form_error, "share percent covers"),
        "missing": None
        if found.missing is None
        else {
            **part(found.missing, "probability share text"),
            "profiles": [
                _profile(one, modes.get(one.channel, one.channel)) for one in found.missing.profiles
            ],
        },
        "searched": {
            **part(searched, "complete left ended"),
            "trials": [
                part(one, "law effects predicted log_evidence misfit text") for one in searched.trials
            ],
            **part(searched, "lost untestable"),
        },
        "data_faults": faults_json(found.faults),
        "mismatch": [_mismatch(one, len(found.channels)) for one in found.location.mismatch],
        "remaining": [_mismatch(one, len(found.channels)) for one in found.remaining.mismatch],
        "excess": {"before": found.location.excess, "after": found.remaining.excess},
        # By channel, percent of the recorded force range, of K* of a table; null for channels that are not held out.
        "misfit": {
            **{
                when: {one.name: getattr(one, f"{when}_percent") for one in found.measured}
                for when in ("before", "after", "noise")
            },
            **{
                f"held_out_{when}": {
                    one.name: getattr(one, f"{when}_percent") if one.held_out else None
                    for one in found.measured
                }
                for when in ("before", "after")
            },
        },
        "dynamic": [_table(one) for one in found.tables],
        # The mode is that of the recorded channel of this name, else the name itself.
        "next_test": test and _next_test(test, modes.get(test.channel, test.channel)),
        "maps": [
            {"channel": one.name, **part(one, "channels local_gain uniform_gain helps_locally text")}
            for one in found.maps
        ],
        **part(found, "forward_solves failed_solves seconds"),
    }
    return cleaned(document)


def _table(one: DiagnosedTable) -> dict[str, Any]:
    """Return a table beside the most probable model and the plain law, and where these miss it."""
    (shown,), before = compared_json([one.compared]), one.compared.started
    plain = {} if before is None else {"storage": before.real, "loss": before.imag}
    return {**shown, "plain": plain, **part(one, "places remaining held_out")}


def _rivals(found: Diagnosis) -> list[list[str]]:
    """Return the sets of effects without rigs, unless the rigs alone make a set differ from the first one."""
    first = list(dict.fromkeys(map(effect_name, found.models[0].effects))) if found.models else None
    sets: list[list[str]] = []
    for names in found.rivals:
        own = list(dict.fromkeys(map(effect_name, names)))
        sets.append(list(names) if own == first else own)
    return sets


def _profile(one: MissingProfile, mode: str) -> dict[str, Any]:
    units = quantities(mode)
    scale = units.per_internal if one.along in ("displacement", "rate") else 1.0
    length = units.displacement_unit or "1"
    unit = {"displacement": length, "time": "s", "cycle": "1", "rate": f"{length}/s"}[one.along]
    return {**part(one, "channel along branch"), "unit": unit, "x": scale * one.x, **part(one, "mean std")}


def _quantity(found: Diagnosis, name: str, quantity: Quantity) -> dict[str, Any]:
    value = shown(name, quantity, found.measured)
    return {
        "value": quantity.word or value.value,
        **part(value, "with_form_error std unit lower upper"),
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


def _mismatch(one: Mismatch, channels: int) -> dict[str, Any]:
    units = quantities(one.mode)
    return {
        **part(one, "channel mode cycle branch side"),
        "displacement_from": units.per_internal * one.displacement_from,
        "displacement_to": units.per_internal * one.displacement_to,
        "rate": None if one.rate is None else [units.per_internal * rate for rate in one.rate],
        **part(one, "share sign relative difference rms p"),
        "text": sentence(one, channels),
    }


def _next_test(test: NextTest, mode: str) -> dict[str, Any]:
    units = quantities(mode)
    return {
        **part(test, "name channel"),
        "points": [units.per_internal * point for point in test.points],
        "rates": [units.per_internal * rate for rate in test.rates],
        "holds": test.holds,
        "unit": units.displacement_unit or "1",
        **part(test, "minutes separates information possible text"),
    }
