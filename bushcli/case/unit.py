"""Units of an effect's parameters in the case file: those of the channel, with angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.effects.active import ActiveEffect
    from bushcli.effects.effect import EffectParameter

# Unit in a translational mode -> unit of the case file in a rotational one, and its factor to N, mm, rad.
_ROTATIONAL = {
    "mm": ("degrees", math.radians(1.0)),
    "N": ("N mm", 1.0),
    "N/mm": ("N mm/degree", math.degrees(1.0)),
    "N/s": ("N mm/s", 1.0),
    "kg": ("kg mm2", 1.0),
    "rad/(N mm)": ("degrees/(N mm)", math.radians(1.0)),
}


def case_file_unit(parameter: EffectParameter, rotational: bool) -> str:
    """Return the unit that the case file uses for a parameter.

    Parameters
    ----------
    parameter : EffectParameter
    rotational : bool
        Whether the effect's channels are rotations, so that mm becomes degrees and N becomes N mm.
    """
    return _rotational(parameter)[0] if rotational else parameter.unit


def internal_value(parameter: EffectParameter, value: float, rotational: bool) -> float:
    """Convert a value of the case file to internal units."""
    return value * _factor(parameter, rotational)


def case_file_value(parameter: EffectParameter, value: float, rotational: bool) -> float | str:
    """Return an internal value as the case file writes it: a number, or the word for a choice."""
    return parameter.choice(value) if parameter.choices else case_file_number(parameter, value, rotational)


def case_file_number(parameter: EffectParameter, value: float, rotational: bool) -> float:
    """Convert an internal value to the unit of the case file; angles to twelve digits, so that 30 degrees come back.

    Parameters
    ----------
    parameter : EffectParameter
    value : float
        In N, mm, MPa, s, rad.
    rotational : bool
        Whether the effect's channels are rotations.
    """
    factor = _factor(parameter, rotational)
    return value if factor == 1.0 else float(f"{value / factor:.12g}")


def parameters_in_degrees(
    active: Sequence[ActiveEffect], channels: Iterable[tuple[str, str]]
) -> dict[str, EffectParameter]:
    """Return the parameters whose units in the case file contain degrees, by full name.

    Parameters
    ----------
    active : sequence of ActiveEffect
    channels : iterable of (str, str)
        Name and mode of each channel.
    """
    rotational = [(name, mode) for name, mode in channels if modes()[mode].rotational]
    return {
        effect.full_name(p): p
        for effect in active
        for p in effect.parameters
        if p.unit != _rotational(p)[0] and any(effect.acts_on(name, mode, None) for name, mode in rotational)
    }


def _factor(parameter: EffectParameter, rotational: bool) -> float:
    return _rotational(parameter)[1] if rotational else 1.0


def _rotational(parameter: EffectParameter) -> tuple[str, float]:
    """Return the unit and its factor in a rotational mode; only parameters of a channel change their unit."""
    unit_of_parameter = (parameter.unit, 1.0)
    return _ROTATIONAL.get(parameter.unit, unit_of_parameter) if parameter.of_channel else unit_of_parameter
