"""Values of the most probable model with their intervals and priors, and the effects that they belong to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from bushcli.case import Material
from bushcli.diagnosis.intervals import components, interval, scanned_interval
from bushcli.diagnosis.posterior import WeighedModel
from bushcli.diagnosis.result import DiagnosedEffect, Quantity
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter
from bushcli.evidence.laplace import standard_errors
from bushcli.evidence.prior import ParameterPrior
from bushcli.likelihood.calibration import UNREMARKABLE
from bushcli.mismatch.missing_force import constant_factor
from bushcli.selection.queue import Search
from forms.law import law

# Prior probability of a value at least as far out, below which the value is called hardly plausible. Words only:
# fewer than one bushing in a thousand.
IMPLAUSIBLE = 1e-3


def quantities(models: Sequence[WeighedModel], material: Material) -> dict[str, Quantity]:
    """Every identified parameter of the first model by its full name, with its 95 % interval over all and its prior."""
    state, searched = models[0].state, models[0].searched
    fitted = state.fitted
    before = {} if searched is None or searched.fitted.values == fitted.values else searched.fitted.values
    errors = standard_errors(fitted.names, state.evidence)
    of_law = {p.name: p for p in law(fitted.model.law).parameters}
    of_effects: dict[str, tuple[ActiveEffect, EffectParameter]] = {
        active.full_name(p): (active, p) for active in fitted.model.effects for p in active.parameters
    }
    parameters = {}
    for name, value in zip(fitted.names, map(float, fitted.x), strict=True):
        std = errors[name]
        if name in of_law:
            low, high = interval(components(name, models, law=fitted.model.law))
            unit, meaning = of_law[name].unit, of_law[name].meaning
            parameters[name] = Quantity(
                value, std, unit, meaning, low, high, with_form_error=before.get(name)
            )
            continue
        active, parameter = of_effects[name]
        low, high = interval(components(parameter.name, models, effect=active.identity))
        known = state.priors.get(name)
        parameters[name] = Quantity(
            value,
            std,
            parameter.unit,
            parameter.meaning,
            max(parameter.lower, low),
            min(parameter.upper, high),
            derived_values(parameter, value, material),
            active.channels,
            None if known is None else known.prior.range(known.scales),
            1.0 if known is None else known.prior.tail(value, known.scales),
            "" if known is None else known.prior.source,
            with_form_error=before.get(name),
        )
    return parameters


def derived_values(
    parameter: EffectParameter, value: float, material: Material
) -> dict[str, tuple[float, str]]:
    """Return the value under its other names: exponential or reciprocal, and the total with the case's own value.

    Parameters
    ----------
    parameter : EffectParameter
    value : float
        In the unit of the parameter.
    material : Material
        The case's.
    """
    if parameter.exponential:
        return {parameter.exponential: (math.exp(value), "1")}
    if parameter.reciprocal is None or not value:
        return {}
    name, unit = parameter.reciprocal
    values = {name: (1.0 / value, unit)}
    present = getattr(material, parameter.adds_to) if parameter.adds_to else math.inf
    if math.isfinite(present):
        values[f"total_{name}"] = (1.0 / (value + 1.0 / present), unit)
    return values


def held_quantity(
    active: ActiveEffect,
    parameter: EffectParameter,
    known: ParameterPrior | None,
    models: Sequence[WeighedModel],
) -> Quantity:
    """Return a parameter that a fit keeps fixed: a dimension of the mesh, or a choice."""
    value, choices = float(active.values[parameter.name]), parameter.choices
    low, high = (value, value) if choices else scanned_interval(active, parameter, models)
    return Quantity(
        value,
        0.0,
        parameter.unit,
        parameter.meaning,
        low,
        high,
        channels=active.channels,
        prior=None if known is None else known.prior.range(known.scales),
        prior_tail=1.0 if known is None else known.prior.tail(value, known.scales),
        prior_source="" if known is None else known.prior.source,
        word=choices[round(value)] if choices else "",
    )


def diagnosed_effects(
    models: Sequence[WeighedModel], search: Search, material: Material
) -> tuple[DiagnosedEffect, ...]:
    """The effects of the most probable model, the most probable first."""
    state, effects = models[0].state, []
    values = quantities(models, material)
    for active in state.model.effects:
        own = {}
        for p in active.parameters:
            name = active.full_name(p)
            own[p.name] = (
                values[name] if name in values else held_quantity(active, p, state.priors.get(name), models)
            )
        # Both as the search has fitted them.
        model = (models[0].searched or state).model
        others = tuple(other for other in model.effects if other.identity != active.identity)
        without = search.states.get(replace(model, effects=others).structure)
        searched = search.states.get(model.structure, state)
        bayes = float("nan") if without is None else 2.0 * (searched.evidence.log - without.evidence.log)
        far = [name for name, quantity in own.items() if quantity.prior_tail < IMPLAUSIBLE]
        remark = f"few bushings have such a value of {' and '.join(far)}" if far else ""
        effects.append(
            DiagnosedEffect(
                active.name,
                *_title_and_summary(active, own, search),
                own,
                min(1.0, sum(model.probability for model in models if active.identity in model.effects)),
                bayes,
                not far,
                remark,
                active.channels,
            )
        )
    return tuple(sorted(effects, key=lambda item: -item.probability))


def _title_and_summary(active: ActiveEffect, own: Mapping[str, Quantity], search: Search) -> tuple[str, str]:
    """Return title and summary of an effect; a gain that the mesh may have made is said as a constant factor."""
    title, summary = active.effect.title or active.effect.name, active.effect.summary
    if not (active.effect.is_factor and active.effect.of_channel):
        return title, summary
    error = own[active.effect.amplitudes[0].name].value
    if abs(error) > UNREMARKABLE:
        return title, summary
    recordings = search.problem.recordings
    (mode, *_) = (
        recording.mode
        for recording in recordings
        if active.channels is None or recording.name in active.channels
    )
    factor = constant_factor(error, mode)
    return "Constant factor of one channel's force", f"{factor[0].upper()}{factor[1:]}."
