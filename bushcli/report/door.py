"""An identified law in the units of the case file: angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bushcli.active import acting
from bushcli.casefile.unit import outside, unit
from bushcli.effect import EffectParameter
from bushcli.inverse import Estimate, Fit
from cases.mode import modes
from forms.law import law


def parameter_unit(fit: Fit, name: str) -> str:
    """Return the unit in which a parameter of the law or of an effect is shown; "1" where there is none."""
    if name == "compliance":
        return "1/MPa"
    found = _of_effects(fit).get(name)
    return law(fit.material.law).parameter(name).unit if found is None else unit(*found)


def at_door(fit: Fit) -> Fit:
    """Return the same with the values of its effects as the case file has them.

    What the law, the curves and the material say stays, as do `Fit.effects`, which the model is built of.
    """
    turned = {name: parameter for name, (parameter, rotational) in _of_effects(fit).items() if rotational}
    if not turned:
        return fit

    def value(name: str, inside: float) -> float:
        found = turned.get(name)
        return (
            inside if found is None or not math.isfinite(inside) else outside(found, inside, rotational=True)
        )

    def values(inside: Mapping[str, float]) -> dict[str, float]:
        return {name: value(name, one) for name, one in inside.items()}

    def estimate(name: str, of: Estimate) -> Estimate:
        ends = of.interval and (value(name, of.interval[0]), value(name, of.interval[1]))
        return replace(
            of,
            value=value(name, of.value),
            std=value(name, of.std),
            lower=value(name, of.lower),
            upper=value(name, of.upper),
            interval=ends,
        )

    return replace(
        fit,
        parameters={name: estimate(name, of) for name, of in fit.parameters.items()},
        profiles=tuple(
            replace(p, values=np.array([value(p.name, float(v)) for v in p.values])) for p in fit.profiles
        ),
        evaluations=tuple(replace(e, parameters=values(e.parameters)) for e in fit.evaluations),
        end_points=tuple(
            replace(e, start=values(e.start), parameters=values(e.parameters)) for e in fit.end_points
        ),
    )


def _of_effects(fit: Fit) -> dict[str, tuple[EffectParameter, bool]]:
    """Full name -> parameter, and whether the channels that it acts on turn."""
    turning = [curve for curve in fit.curves if modes()[curve.recording.mode].rotational]
    return {
        one.full_name(p): (p, any(acting((one,), curve.name, curve.recording.mode) for curve in turning))
        for one in fit.effects
        for p in one.parameters
    }
