"""What the final model says: its parameters with their intervals, and the effects that were left out."""

from __future__ import annotations

import math

import numpy as np

from bushcli.casefile import Material
from bushcli.diagnosis.model import Fitted
from bushcli.diagnosis.plausible import CONFIDENCE, plausibility
from bushcli.diagnosis.result import Named, Quantity
from bushcli.diagnosis.selected import Selection, key
from bushcli.diagnosis.usual import admitted
from bushcli.effect import EffectParameter
from forms.law import law


def quantities(fitted: Fitted, material: Material) -> dict[str, Quantity]:
    """Every identified parameter of a model by its full name, with its 95 % interval.

    Parameters
    ----------
    fitted
    material
        The case's: an effect may add to what it has.
    """
    recordings = [channel.recording for channel in fitted.channels]
    units = {p.name: (p.unit, p.meaning) for p in law(fitted.model.law).parameters}
    ranges, channels = {}, {}
    of_effects: dict[str, EffectParameter] = {}
    for one in fitted.model.effects:
        for p in one.parameters:
            channels[one.full_name(p)] = one.channels
            units[one.full_name(p)] = (p.unit, p.meaning)
            of_effects[one.full_name(p)] = p
            ranges[one.full_name(p)] = admitted(one.effect, p, recordings)
    found = {}
    errors = fitted.standard_errors()
    for name, value in zip(fitted.names, map(float, fitted.x), strict=True):
        std = errors[name]
        unit, meaning = units[name]
        low, high = ranges.get(name, (-np.inf, np.inf))
        found[name] = Quantity(
            value,
            std,
            unit,
            meaning,
            max(low, value - CONFIDENCE * std),
            min(high, value + CONFIDENCE * std),
            derived(of_effects[name], value, material) if name in of_effects else {},
            channels.get(name),
        )
    return found


def derived(parameter: EffectParameter, value: float, material: Material) -> dict[str, tuple[float, str]]:
    """The same under other names, with units: a reciprocal, and what the specimen has with the case's own."""
    if parameter.reciprocal is None or not value:
        return {}
    name, unit = parameter.reciprocal
    found = {name: (1.0 / value, unit)}
    present = getattr(material, parameter.adds_to) if parameter.adds_to else math.inf
    if math.isfinite(present):
        found[f"total_{name}"] = (1.0 / (value + 1.0 / present), unit)
    return found


def named(found: Selection, material: Material) -> tuple[Named, ...]:
    """The effects of the final model, each with what BIC loses without it."""
    values, effects = quantities(found.best, material), []
    for one in found.best.model.effects:
        other = found.refits.get(key(found.best.model.without(one.name), found.plain.model))
        own = {p.name: values[one.full_name(p)] for p in one.parameters if one.full_name(p) in values}
        std = {name: quantity.std for name, quantity in own.items()}
        plausible, remark = plausibility(one, [channel.recording for channel in found.plain.channels], std)
        effects.append(
            Named(
                one.name,
                one.effect.summary,
                own,
                float("nan") if other is None else other.bic() - found.compared.bic(),
                plausible,
                remark,
                one.channels,
            )
        )
    return tuple(sorted(effects, key=lambda item: (math.isnan(item.evidence), -item.evidence)))
