"""Channels that a case asks for, refused where a travel or a free play is not admissible."""

from __future__ import annotations

from bushcli.case import Case
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault
from bushcli.simulate.admissible import check_travel
from bushcli.simulate.channels import SimulatedChannel, prescribed, recorded
from bushcli.simulate.measured import Measured
from bushcli.simulate.play import check_play


def admitted(case: Case, measured: Measured) -> tuple[list[SimulatedChannel], tuple[DataFault, ...]]:
    """Return the channels to simulate, and faults of the recordings; all files are read before the first march.

    Parameters
    ----------
    case : Case
    measured : Measured
        Reads the recordings.

    Raises
    ------
    InputError
        There is nothing to simulate, or a travel or a free play is not admissible.
    """
    recordings, faults = measured(case)
    if not recordings and not case.load_cases:
        wanted = "[[recordings]] or [[load_cases]]; vibrations are in `bushcli dynamic`"
        raise InputError(Problem(case.path.name, "there is nothing to simulate", "", wanted))
    check_travel(case, recordings, faults)
    channels = [
        prescribed(case, load, number, measured.tables) for number, load in enumerate(case.load_cases)
    ]
    channels += [recorded(case, one) for one in recordings]
    for channel in [one for one in channels if not one.by_force]:
        check_play(case, channel.name, channel.mode, channel.displacement)
    return channels, faults
