"""6 x 6 stiffness matrices of a channel at rest, at its end and at a chosen travel."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.simulate.channels import SimulatedChannel
from bushcli.simulate.six import as_path, followed, mode_of, whole
from cases.mode import Mode, modes
from cases.model import FiniteElementModel
from cases.program import Program

Array = NDArray[np.float64]


def with_state(channel: SimulatedChannel, at: float | None) -> tuple[Program, float | None]:
    """Return the program of a channel with a step inserted at a displacement, and the displacement in its unit."""
    program = channel.program
    if at is None:
        return program, None
    if channel.path is None and modes()[channel.mode].rotational:
        at = float(np.radians(at))
    q = program.from_rest.displacement
    passed = np.flatnonzero((q[:-1] - at) * (q[1:] - at) <= 0.0)
    if not len(passed):
        return program, None
    i = int(passed[0])
    if at in (q[i], q[i + 1]):
        return program, at
    time = None
    if program.time is not None:
        began = program.time[max(i - 1, 0)]
        share = (at - q[i]) / (q[i + 1] - q[i])
        time = np.insert(program.time, i, began + share * (program.time[i] - began))
    corners = frozenset(k + (k >= i) for k in program.corners)
    return Program(np.insert(program.displacement, i, at), time, corners), at


def check_state(channels: Sequence[SimulatedChannel], at: float | None) -> None:
    """Refuse a travel that no channel passes.

    Raises
    ------
    InputError
    """
    channels = [channel for channel in channels if not channel.by_force] or channels
    if at is not None and all(with_state(channel, at)[1] is None for channel in channels):
        expected = (
            "a travel of a load case or recording, in mm or degrees; a time of a path of six motions, in s"
        )
        raise InputError(Problem("--stiffness-at", f"no channel reaches {at:g}", "", expected))


def matrices(
    channel: SimulatedChannel, at: float | None, made: Callable[[Mode], FiniteElementModel]
) -> dict[str, tuple[float, Array]]:
    """Return the matrices of a channel by state: "start", "end", and "at" where it passes the travel asked for.

    Each matrix, in N, mm and rad, follows its displacement (mm or rad, s of a path). The model has no planes of
    symmetry, so that all six motions are possible.

    Parameters
    ----------
    channel : SimulatedChannel
    at : float or None
        mm or degrees, s of a path.
    made : callable
        Makes the model of a mode, with its effects on the rubber and on the assembly.

    Raises
    ------
    NotConverged
        The march could not go on.
    """
    program, chosen = with_state(channel, at)
    if channel.path is not None:
        path, steps, q = whole(channel.path), program, program.displacement
    else:
        path, steps = as_path(modes()[channel.mode], program)
        q = program.from_rest.displacement
    reached = dict(zip(map(float, steps.displacement), map(float, q), strict=True))
    wanted = {"start": float(steps.displacement[0]), "end": float(steps.displacement[-1])}
    if chosen is not None:
        wanted["at"] = next(time for time, one in reached.items() if one == chosen)
    _, found = followed(made(mode_of("path", path)), steps, False, lambda *_: None, tuple(wanted.values()))
    return {state: (reached[time], found.matrices[time]) for state, time in wanted.items()}
