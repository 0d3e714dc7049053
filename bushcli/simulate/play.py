"""Check of free play against the travel of a channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, load_case_names
from bushcli.case.unit import outside, unit
from bushcli.effects.active import acting
from bushcli.errors import InputError, Problem
from bushcli.recording.table_cache import TableCache
from cases.mode import modes

#: Share of the travel that a free play may take; of the rest nothing can be seen beside rounding and noise (judgement).
_NO_TRAVEL = 0.999


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
        if width >= _NO_TRAVEL * travel:
            rotational = modes()[mode].rotational
            (parameter,) = one.effect.parameters
            known = outside(parameter, width, rotational)
            largest = f"{outside(parameter, travel, rotational):g} {unit(parameter, rotational)}"
            what = f"free_play.half_width = {known:g} takes up all of the travel of {name}, {largest}"
            expected = f"less than {largest}, or the bushing does not move"
            raise InputError(Problem(case.path.name, what, "", expected))


def check_play_of_load_cases(case: Case, tables: TableCache) -> None:
    """Refuse free play as large as the travel of a load case, without the library that simulates it.

    Parameters
    ----------
    case : Case
    tables : TableCache

    Raises
    ------
    InputError
    """
    names = load_case_names(case.load_cases, case.recordings)
    for name, load in zip(names, case.load_cases, strict=True):
        if load.six is not None or load.by_force or not acting(case.effects, name, load.mode):
            continue
        if load.source is not None:
            from bushcli.recording import read_program  # with the readers, which few load cases need

            displacement = read_program(load.source, tables).displacement
        else:
            displacement = np.asarray(load.path, dtype=float)
        check_play(case, name, load.mode, displacement)
