"""An identified law in the units of the case file: angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bushcli.case.unit import case_file_number, case_file_unit, parameters_in_degrees
from forms.law import law

if TYPE_CHECKING:
    from bushcli.effects.effect import EffectParameter
    from bushcli.inverse.result import Estimate, Fit

# Parameters of the rubber that are not its law's.
_OF_RUBBER = {"compliance": "1/MPa", "density": "kg/m3"}


def parameter_unit(fit: Fit, name: str) -> str:
    """Return the unit in which a parameter of the law or of an effect is shown; "1" where there is none.

    Parameters
    ----------
    fit : Fit
    name : str
        Full name of the parameter.
    """
    of_effects = {active.full_name(p): p for active in fit.effects for p in active.parameters}
    if name in of_effects:
        return case_file_unit(of_effects[name], name in _rotational_parameters(fit))
    return _OF_RUBBER.get(name) or law(fit.material.law).parameter(name).unit


def values_in_file_units(
    inside: Mapping[str, float], rotational: Mapping[str, EffectParameter]
) -> dict[str, float]:
    """Return values by full name in the units of the case file; `rotational`: see `parameters_in_degrees`.

    Parameters
    ----------
    inside : Mapping[str, float]
        Values by full name, in N, mm, MPa, s, rad.
    rotational : Mapping[str, EffectParameter]
        Parameters that the case file gives in degrees, by full name.
    """
    return {name: _value(value, rotational.get(name)) for name, value in inside.items()}


def in_file_units(fit: Fit) -> Fit:
    """Return the same fit with the values of its effects in the units of the case file.

    The law, the curves and the material are unchanged, and so are `Fit.effects`, from which the model is built.
    """
    rotational = _rotational_parameters(fit)
    if not rotational:
        return fit

    def numbers(name: str, inside: Iterable[float]) -> list[float]:
        return [_value(float(value), rotational.get(name)) for value in inside]

    def estimate(name: str, inside: Estimate) -> Estimate:
        value, std, lower, upper = numbers(name, (inside.value, inside.std, inside.lower, inside.upper))
        changed = replace(inside, value=value, std=std, lower=lower, upper=upper)
        if inside.interval is None:
            return changed
        low, high = numbers(name, inside.interval)
        return replace(changed, interval=(low, high))

    values = partial(values_in_file_units, rotational=rotational)
    return replace(
        fit,
        parameters={name: estimate(name, inside) for name, inside in fit.parameters.items()},
        profiles=tuple(replace(p, values=np.array(numbers(p.name, p.values))) for p in fit.profiles),
        evaluations=tuple(replace(e, parameters=values(e.parameters)) for e in fit.evaluations),
        end_points=tuple(
            replace(e, start=values(e.start), parameters=values(e.parameters)) for e in fit.end_points
        ),
    )


def _rotational_parameters(fit: Fit) -> dict[str, EffectParameter]:
    channels = [(curve.name, curve.recording.mode) for curve in fit.curves]
    channels += [(compared.table.name, compared.table.mode) for compared in fit.tables]
    return parameters_in_degrees(fit.effects, channels)


def _value(inside: float, parameter: EffectParameter | None) -> float:
    if parameter is None or not math.isfinite(inside):
        return inside
    return case_file_number(parameter, inside, rotational=True)
