"""Checks that the bushing still moves after free play and the like have taken their share of the travel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.case.unit import case_file_number, case_file_unit
from bushcli.effects.active import effects_on_channel
from bushcli.effects.rig import bushing_path
from bushcli.errors import InputError, Problem
from bushcli.recording.table_cache import TableCache
from cases.mode import modes

#: Share of the travel that has to arrive at the bushing: less cannot be seen beside rounding and noise (judgement).
_LEAST = 1e-3


def check_play(case: Case, name: str, mode: str, displacement: NDArray[np.float64]) -> None:
    """Refuse an effect that takes up the travel of a channel, such as free play: the bushing would not move.

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
    for active in effects_on_channel(case.effects, name, mode):
        if active.effect.rig is None or active.effect.rig.drive is None or active.parameters_without_value:
            continue
        arriving = np.ptp(bushing_path([active], displacement, ()).value)
        if np.ptp(displacement) > 0.0 and arriving <= _LEAST * np.ptp(displacement):
            rotational = modes()[mode].rotational
            parameter = active.effect.amplitudes[0]
            value = case_file_number(parameter, active.values[parameter.name], rotational)
            travel_in_unit = case_file_number(parameter, float(np.abs(displacement).max()), rotational)
            largest = f"{travel_in_unit:g} {case_file_unit(parameter, rotational)}"
            what = (
                f"{active.full_name(parameter)} = {value:g} takes up all of the travel of {name}, {largest}"
            )
            expected = f"less than {largest}, or the bushing does not move"
            raise InputError(Problem(case.path.name, what, "", expected))


def check_play_of_load_cases(case: Case, tables: TableCache) -> None:
    """Refuse free play as large as the travel of a load case, without the libraries that simulate it.

    Parameters
    ----------
    case : Case
    tables : TableCache

    Raises
    ------
    InputError
    """
    for load in case.load_cases:
        if load.by_travel and effects_on_channel(case.effects, load.label, load.mode):
            check_play(case, load.label, load.mode, load.program(tables).displacement)
