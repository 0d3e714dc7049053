"""A diagnosis -> JSON-ready data; displacements of rotational modes are in degrees."""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any

from bushcli.diagnosis.result import Diagnosis, Quantity
from bushcli.diagnosis.words import sentence
from bushcli.effects.names import effect_name
from bushcli.mismatch.record import Mismatch
from bushcli.report.json.common import cleaned, faults_json, head, material_json, part
from bushcli.report.json.dynamic import compared_json
from bushcli.report.quantity import Quantities, quantities
from bushcli.report.views.diagnosis.paragraph import paragraph
from bushcli.report.views.diagnosis.values import derived, shown
from bushcli.report.views.diagnosis.words import headline


def diagnosis_json(found: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as JSON-ready data."""
    keys = {key: of(found) for key, of in _KEYS.items()}
    return cleaned(head("diagnose", found.case, found.conditions) | keys)


def _rivals(found: Diagnosis) -> list[list[str]]:
    """Return the sets of effects without rigs, unless the rigs alone make a set differ from the first one."""
    first = list(dict.fromkeys(map(effect_name, found.models[0].effects))) if found.models else None
    sets: list[list[str]] = []
    for names in found.rivals:
        own = list(dict.fromkeys(map(effect_name, names)))
        sets.append(list(names) if own == first else own)
    return sets


def _misfit(found: Diagnosis) -> dict[str, dict[str, float | None]]:
    """Return the misfits by channel, percent of the force range or of K*; None where it was not held out."""
    misfit: dict[str, dict[str, float | None]] = {
        when: {one.name: getattr(one, f"{when}_percent") for one in found.measured}
        for when in ("before", "after", "noise")
    }
    for when in ("before", "after"):
        held = {one.name for one in found.measured if one.held_out}
        misfit[f"held_out_{when}"] = {n: p if n in held else None for n, p in misfit[when].items()}
    return misfit


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


def _mismatch(found: Diagnosis, one: Mismatch) -> dict[str, Any]:
    units = quantities(one.mode)
    return {
        **part(one, "channel mode cycle branch side"),
        "displacement_from": units.per_internal * one.displacement_from,
        "displacement_to": units.per_internal * one.displacement_to,
        "rate": None if one.rate is None else [units.per_internal * rate for rate in one.rate],
        **part(one, "share sign relative difference rms p"),
        "text": sentence(one, len(found.channels)),
    }


def _next_test(found: Diagnosis) -> dict[str, Any] | None:
    test = found.next_test
    if test is None:
        return None
    units = _units(found, test.channel)
    return {
        **part(test, "name channel"),
        "points": [units.per_internal * point for point in test.points],
        "rates": [units.per_internal * rate for rate in test.rates],
        "holds": test.holds,
        "unit": units.displacement_unit or "1",
        **part(test, "minutes separates information possible text frequency temperature"),
        "amplitude": [units.per_internal * one for one in test.amplitude],
    }


def _missing(found: Diagnosis) -> dict[str, Any] | None:
    if found.missing is None:
        return None
    profiles = []
    for one in found.missing.profiles:
        units = _units(found, one.channel)
        scale = units.per_internal if one.along in ("displacement", "rate") else 1.0
        length = units.displacement_unit or "1"
        unit = {"displacement": length, "time": "s", "cycle": "1", "rate": f"{length}/s"}[one.along]
        known = part(one, "channel along branch") | {"unit": unit, "x": scale * one.x}
        profiles.append(known | part(one, "mean std"))
    return part(found.missing, "probability share text") | {"profiles": profiles}


def _units(found: Diagnosis, channel: str) -> Quantities:
    """Return the units of the recorded channel of this name, else of the mode of this name."""
    return quantities({one.name: one.mode for one in found.measured}.get(channel, channel))


def _fields(names: str) -> dict[str, Callable[[Diagnosis], Any]]:
    """Return keys that have the names of fields of the diagnosis."""
    return {name: attrgetter(name) for name in names.split()}


# The keys in their order, each with what it holds of a diagnosis. A dataclass becomes an object with all its fields.
_KEYS: dict[str, Callable[[Diagnosis], Any]] = {
    **_fields("verdict"),
    "headline": headline,
    "text": paragraph,
    **_fields("asked law_from law_fixed uniform_odds"),
    "law": lambda found: found.material.law,
    "plain": lambda found: material_json(found.plain),
    "material": lambda found: material_json(found.material),
    "parameters": lambda found: {name: _quantity(found, name, q) for name, q in found.parameters.items()},
    "effects": lambda found: [
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
    **_fields("probability models"),
    "rivals": _rivals,
    **_fields("groups form_error"),
    "missing": _missing,
    **_fields("searched"),
    "data_faults": lambda found: faults_json(found.faults),
    "mismatch": lambda found: [_mismatch(found, one) for one in found.location.mismatch],
    "remaining": lambda found: [_mismatch(found, one) for one in found.remaining.mismatch],
    "excess": lambda found: {"before": found.location.excess, "after": found.remaining.excess},
    "misfit": _misfit,
    "dynamic": lambda found: [
        {
            **shown,
            "plain": {} if K is None else {"storage": K.real, "loss": K.imag},
            **part(one, "places remaining held_out"),
        }
        for one in found.tables
        for (shown,), K in [(compared_json([one.compared]), one.compared.started)]
    ],
    "next_test": _next_test,
    "maps": lambda found: [
        {"channel": one.name, **part(one, "channels local_gain uniform_gain helps_locally text")}
        for one in found.maps
    ],
    **_fields("forward_solves failed_solves seconds"),
}
