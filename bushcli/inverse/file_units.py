"""An identified law in the units of the case file: angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
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
        The identified law.
    name : str
        Full name of the parameter.
    """
    if name in _OF_RUBBER:
        return _OF_RUBBER[name]
    of_effects = {active.full_name(p): p for active in fit.effects for p in active.parameters}
    if name in of_effects:
        return case_file_unit(of_effects[name], name in _rotational_parameters(fit))
    return law(fit.material.law).parameter(name).unit


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
    return replace(
        fit,
        parameters={
            name: _estimate(estimate, rotational.get(name)) for name, estimate in fit.parameters.items()
        },
        profiles=tuple(
            replace(p, values=np.array([_value(float(v), rotational.get(p.name)) for v in p.values]))
            for p in fit.profiles
        ),
        evaluations=tuple(
            replace(e, parameters=values_in_file_units(e.parameters, rotational)) for e in fit.evaluations
        ),
        end_points=tuple(
            replace(
                e,
                start=values_in_file_units(e.start, rotational),
                parameters=values_in_file_units(e.parameters, rotational),
            )
            for e in fit.end_points
        ),
    )


def _rotational_parameters(fit: Fit) -> dict[str, EffectParameter]:
    channels = [(curve.name, curve.recording.mode) for curve in fit.curves]
    return parameters_in_degrees(
        fit.effects, [*channels, *((compared.table.name, compared.table.mode) for compared in fit.tables)]
    )


def _value(inside: float, parameter: EffectParameter | None) -> float:
    return (
        inside
        if parameter is None or not math.isfinite(inside)
        else case_file_number(parameter, inside, rotational=True)
    )


def _estimate(estimate: Estimate, parameter: EffectParameter | None) -> Estimate:
    ends = estimate.interval and (
        _value(estimate.interval[0], parameter),
        _value(estimate.interval[1], parameter),
    )
    return replace(
        estimate,
        value=_value(estimate.value, parameter),
        std=_value(estimate.std, parameter),
        lower=_value(estimate.lower, parameter),
        upper=_value(estimate.upper, parameter),
        interval=ends,
    )
