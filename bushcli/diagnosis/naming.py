"""What the final model says: its parameters with their intervals, and the effects that were left out."""

from __future__ import annotations

import math

import numpy as np

from bushcli.diagnosis.model import Fitted
from bushcli.diagnosis.plausible import plausibility
from bushcli.diagnosis.result import Named, Quantity
from bushcli.diagnosis.selected import Selection, key
from bushcli.effect import full_name
from forms.law import law

# Of a normal distribution.
CONFIDENCE = 1.96


def quantities(fitted: Fitted) -> dict[str, Quantity]:
    """Every identified parameter of a model by its full name, with its 95 % interval."""
    spread = np.sqrt(np.maximum(np.diag(fitted.covariance()), 0.0))
    units: dict[str, tuple[str, str, tuple[str, str] | None]] = {
        p.name: (p.unit, p.meaning, None) for p in law(fitted.model.law).parameters
    }
    ranges, channels = {}, {}
    for one in fitted.model.effects:
        for p in one.parameters:
            channels[full_name(one.effect, p)] = one.channels
            units[full_name(one.effect, p)] = (p.unit, p.meaning, p.reciprocal)
            ranges[full_name(one.effect, p)] = (p.lower, p.upper)
    found = {}
    for name, value, std in zip(fitted.names, map(float, fitted.x), map(float, spread), strict=True):
        unit, meaning, reciprocal = units[name]
        low, high = ranges.get(name, (-np.inf, np.inf))
        derived = {reciprocal[0]: (1.0 / value, reciprocal[1])} if reciprocal and value else {}
        found[name] = Quantity(
            value,
            std,
            unit,
            meaning,
            max(low, value - CONFIDENCE * std),
            min(high, value + CONFIDENCE * std),
            derived,
            channels.get(name),
        )
    return found


def named(found: Selection) -> tuple[Named, ...]:
    """The effects of the final model, each with what BIC loses without it."""
    values, effects = quantities(found.best), []
    for one in found.best.model.effects:
        other = found.refits.get(key(found.best.model.without(one.name), found.plain.model))
        own = {
            p.name: values[full_name(one.effect, p)]
            for p in one.parameters
            if full_name(one.effect, p) in values
        }
        plausible, remark = plausibility(one, [channel.recording for channel in found.plain.channels])
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
