"""6 x 6 stiffness matrices of a channel at rest, at its end and at a chosen travel."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.simulate.channels import SimulatedChannel
from cases.equilibrium import Equilibrium
from cases.march import march
from cases.mode import Mode, mode_of, modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.rigid import tangent
from cases.six import SixPath

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
    channel: SimulatedChannel, at: float | None, model_of: Callable[[Mode], FiniteElementModel]
) -> dict[str, tuple[float, Array]]:
    """Return the matrices of a channel by state: "start", "end", and "at" where it passes the travel asked for.

    Each matrix, in N, mm and rad, follows its displacement (mm or rad, s of a path). The model has no planes of
    symmetry, so that all six motions are possible.

    Raises
    ------
    NotConverged
        The march could not go on.
    """
    program, displacement = with_state(channel, at)
    if channel.path is not None:
        path, steps, q = channel.path.whole_body, program, program.displacement
    else:
        path, steps = as_path(modes()[channel.mode], program)
        q = program.from_rest.displacement
    positions = dict(zip(map(float, steps.displacement), map(float, q), strict=True))
    time_of_state = {"start": float(steps.displacement[0]), "end": float(steps.displacement[-1])}
    if displacement is not None:
        time_of_state["at"] = next(time for time, position in positions.items() if position == displacement)
    by_time = matrices_along(model_of(mode_of("path", path)), steps, tuple(time_of_state.values()))
    return {state: (positions[time], by_time[time]) for state, time in time_of_state.items()}


def matrices_along(model: FiniteElementModel, program: Program, at: Sequence[float]) -> dict[float, Array]:
    """March along a path of six motions, and return the stiffness matrix at some of its targets."""
    by_position: dict[float, Array] = {}

    def observe(solver: Equilibrium) -> None:
        if solver.q in at and solver.q not in by_position:
            solver.factorise()
            by_position[solver.q] = tangent(model, solver.factor, solver.q).symmetric

    march(model, program, observer=observe)
    return by_position


def as_path(mode: Mode, program: Program) -> tuple[SixPath, Program]:
    """Return a mode's program as a path of six motions, without symmetry, and the steps along it from rest on.

    The path's parameter is the distance that the sleeve has travelled.
    """
    program = program.from_rest
    q, time = program.displacement, program.time
    moves = np.diff(q)
    # A hold gets a short distance, over which the pose does not change.
    way = np.where(moves == 0.0, 1e-3 * np.abs(moves).max(), np.abs(moves))
    along = np.concatenate([[0.0], np.cumsum(way)])
    turns = np.flatnonzero(np.sign(moves[1:]) != np.sign(moves[:-1])) + 1
    poses = np.array([pose_of(mode, float(position)) for position in q])
    return SixPath(along, poses, whole=True), Program(along, time, frozenset(map(int, turns)))


def pose_of(mode: Mode, q: float) -> Array:
    """Return where a mode takes the inner sleeve, (6,) in mm and rad."""
    from scipy.spatial.transform import Rotation

    corners = np.column_stack([np.zeros(3), np.eye(3)])
    moved_corners = corners + mode.solid.motion(corners, q)
    rotation = moved_corners[:, 1:] - moved_corners[:, :1]
    return np.concatenate([moved_corners[:, 0], Rotation.from_matrix(rotation).as_rotvec()])
