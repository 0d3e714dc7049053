"""Units of an effect's parameters at the door: those of the channel's displacement and force, in degrees for angles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter
from cases.mode import modes

# Unit in a translational mode -> unit of the case file in a rotational one, and its factor to N, mm, rad.
_ROTATIONAL = {
    "mm": ("degrees", math.radians(1.0)),
    "N": ("N mm", 1.0),
    "N/mm": ("N mm/degree", math.degrees(1.0)),
    "N/s": ("N mm/s", 1.0),
}


def unit(parameter: EffectParameter, rotational: bool) -> str:
    """Return the unit in which the case file has a parameter, on channels of rotational or other modes."""
    return _rotational(parameter)[0] if rotational else parameter.unit


def inside(parameter: EffectParameter, value: float, rotational: bool) -> float:
    """Return the case file's value in N, mm, MPa, s, rad."""
    return value * _factor(parameter, rotational)


def written(parameter: EffectParameter, value: float, rotational: bool) -> float | str:
    """Return an internal value as the case file has it: a number, or the word for a choice."""
    return parameter.choice(value) if parameter.choices else outside(parameter, value, rotational)


def outside(parameter: EffectParameter, value: float, rotational: bool) -> float:
    """Return an internal value as the case file has it; angles to twelve digits, which bring 30 degrees back."""
    factor = _factor(parameter, rotational)
    return value if factor == 1.0 else float(f"{value / factor:.12g}")


def turning(
    active: Sequence[ActiveEffect], channels: Iterable[tuple[str, str]]
) -> dict[str, EffectParameter]:
    """Return the parameters that are in degrees at the door, by full name, given the channels' names and modes."""
    rotational = [(name, mode) for name, mode in channels if modes()[mode].rotational]
    return {
        one.full_name(p): p
        for one in active
        for p in one.parameters
        if p.unit != _rotational(p)[0] and any(one.acts_on(name, mode) for name, mode in rotational)
    }


def _factor(parameter: EffectParameter, rotational: bool) -> float:
    return _rotational(parameter)[1] if rotational else 1.0


def _rotational(parameter: EffectParameter) -> tuple[str, float]:
    """Unit in a rotational mode and its factor; a parameter that is not the channel's, or a ratio, keeps its own."""
    own = (parameter.unit, 1.0)
    return _ROTATIONAL.get(parameter.unit, own) if parameter.of_channel else own
