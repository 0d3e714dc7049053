"""A diagnosis -> JSON-ready data; displacements of rotational modes are in degrees."""

from __future__ import annotations

from typing import Any

from bushcli.diagnosis.result import Diagnosis, Quantity
from bushcli.diagnosis.words import sentence
from bushcli.effects.names import effect_name
from bushcli.mismatch.record import Mismatch
from bushcli.report.json.common import faults_json, material_json, result_json, select
from bushcli.report.json.dynamic import compared_json
from bushcli.report.quantity import Quantities, quantities
from bushcli.report.views.diagnosis.paragraph import paragraph
from bushcli.report.views.diagnosis.values import reciprocals, shown_quantity
from bushcli.report.views.diagnosis.words import headline


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as JSON-ready data."""
    entries = {
        "verdict": diagnosis.verdict,
        "headline": headline(diagnosis),
        "text": paragraph(diagnosis),
        **select(diagnosis, "asked law_from law_fixed uniform_odds"),
        "law": diagnosis.material.law,
        "plain": material_json(diagnosis.plain),
        "material": material_json(diagnosis.material),
        "parameters": {name: _quantity(diagnosis, name, q) for name, q in diagnosis.parameters.items()},
        "effects": [
            {
                "name": effect_name(effect.name),
                **select(effect, "title channels summary"),
                "parameters": {
                    name: _quantity(diagnosis, f"{effect.name}.{name}", quantity)
                    for name, quantity in effect.parameters.items()
                },
                **select(effect, "probability evidence plausible remark"),
            }
            for effect in diagnosis.effects
        ],
        **select(diagnosis, "probability models"),
        "rivals": _rivals(diagnosis),
        **select(diagnosis, "groups form_error"),
        "missing": _missing_physics(diagnosis),
        "searched": diagnosis.searched,
        "data_faults": faults_json(diagnosis.faults),
        "mismatch": [_mismatch(diagnosis, place) for place in diagnosis.location.mismatch],
        "remaining": [_mismatch(diagnosis, place) for place in diagnosis.remaining.mismatch],
        "excess": {"before": diagnosis.location.excess, "after": diagnosis.remaining.excess},
        "misfit": _misfit(diagnosis),
        "dynamic": [
            {
                **table_json,
                "plain": {} if K is None else {"storage": K.real, "loss": K.imag},
                **select(table, "places remaining held_out"),
            }
            for table in diagnosis.tables
            for (table_json,), K in [(compared_json([table.compared]), table.compared.started)]
        ],
        "next_test": _next_test(diagnosis),
        "maps": [
            {"channel": place.name, **select(place, "channels local_gain uniform_gain helps_locally text")}
            for place in diagnosis.maps
        ],
        **select(diagnosis, "forward_solves failed_solves seconds"),
    }
    return result_json("diagnose", diagnosis.case, diagnosis.conditions, entries)


def _rivals(diagnosis: Diagnosis) -> list[list[str]]:
    """Return the sets of effects without rigs, unless the rigs alone make a set differ from the first one."""
    best = list(dict.fromkeys(map(effect_name, diagnosis.models[0].effects))) if diagnosis.models else None
    sets: list[list[str]] = []
    for names in diagnosis.rivals:
        effects = list(dict.fromkeys(map(effect_name, names)))
        sets.append(list(names) if effects == best else effects)
    return sets


def _misfit(diagnosis: Diagnosis) -> dict[str, dict[str, float | None]]:
    """Return the misfits by channel, percent of the force range or of K*; None where it was not held out."""
    misfit: dict[str, dict[str, float | None]] = {
        stage: {channel.name: getattr(channel, f"{stage}_percent") for channel in diagnosis.measured_channels}
        for stage in ("before", "after", "noise")
    }
    for stage in ("before", "after"):
        held_out = {channel.name for channel in diagnosis.measured_channels if channel.held_out}
        misfit[f"held_out_{stage}"] = {n: p if n in held_out else None for n, p in misfit[stage].items()}
    return misfit


def _quantity(diagnosis: Diagnosis, name: str, quantity: Quantity) -> dict[str, Any]:
    value = shown_quantity(name, quantity, diagnosis.measured_channels)
    return {
        "value": quantity.word or value.value,
        **select(value, "with_form_error std unit lower upper"),
        "meaning": quantity.meaning,
        "prior": value.prior
        and {
            **dict(zip(("lower", "upper"), value.prior, strict=True)),
            "tail": quantity.prior_tail,
            "source": quantity.prior_source,
        },
        "derived": {
            key: {"value": value, "unit": unit} for key, (value, unit) in reciprocals(quantity).items()
        },
    }


def _mismatch(diagnosis: Diagnosis, mismatch: Mismatch) -> dict[str, Any]:
    units = quantities(mismatch.mode)
    return {
        **select(mismatch, "channel mode cycle branch side"),
        "displacement_from": units.per_internal * mismatch.displacement_from,
        "displacement_to": units.per_internal * mismatch.displacement_to,
        "rate": None if mismatch.rate is None else [units.per_internal * rate for rate in mismatch.rate],
        **select(mismatch, "share sign relative difference rms p"),
        "text": sentence(mismatch, len(diagnosis.channels)),
    }


def _next_test(diagnosis: Diagnosis) -> dict[str, Any] | None:
    test = diagnosis.next_test
    if test is None:
        return None
    units = _units(diagnosis, test.channel)
    return {
        **select(test, "name channel"),
        "points": [units.per_internal * point for point in test.points],
        "rates": [units.per_internal * rate for rate in test.rates],
        "holds": test.holds,
        "unit": units.displacement_unit or "1",
        **select(test, "minutes separates information possible text frequency temperature"),
        "amplitude": [units.per_internal * amplitude for amplitude in test.amplitude],
    }


def _missing_physics(diagnosis: Diagnosis) -> dict[str, Any] | None:
    if diagnosis.missing is None:
        return None
    profiles = []
    for profile in diagnosis.missing.profiles:
        units = _units(diagnosis, profile.channel)
        scale = units.per_internal if profile.along in ("displacement", "rate") else 1.0
        length = units.displacement_unit or "1"
        unit = {"displacement": length, "time": "s", "cycle": "1", "rate": f"{length}/s"}[profile.along]
        axis = select(profile, "channel along branch") | {"unit": unit, "x": scale * profile.x}
        profiles.append(axis | select(profile, "mean std"))
    return select(diagnosis.missing, "probability share text") | {"profiles": profiles}


def _units(diagnosis: Diagnosis, name: str) -> Quantities:
    """Return the units of the recorded channel of this name, else of the mode of this name."""
    return quantities({channel.name: channel.mode for channel in diagnosis.measured_channels}.get(name, name))
