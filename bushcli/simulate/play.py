"""Check of free play against the travel of a channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.case.unit import outside, unit
from bushcli.effects.active import acting
from bushcli.errors import InputError, Problem
from cases.mode import modes


def check_play(case: Case, name: str, mode: str, displacement: NDArray[np.float64]) -> None:
    """Refuse free play as large as the travel of a channel: the bushing would not move.

    Parameters
    ----------
    case : Case
    name, mode : str
        Names of the channel and of its mode.
    displacement : shape (n,)
        mm or rad, of the whole path.

    Raises
    ------
    InputError
    """
    travel = float(np.abs(displacement).max())
    for one in acting(case.effects, name, mode):
        width = one.values.get("half_width", 0.0) if one.effect.name == "free_play" else 0.0
        if width >= travel:
            rotational = modes()[mode].rotational
            (parameter,) = one.effect.parameters
            known = outside(parameter, width, rotational)
            largest = f"{outside(parameter, travel, rotational):g} {unit(parameter, rotational)}"
            what = f"free_play.half_width = {known:g} takes up all of the travel of {name}, {largest}"
            expected = f"less than {largest}, or the bushing does not move"
            raise InputError(Problem(case.path.name, what, "", expected))
