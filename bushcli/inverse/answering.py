"""Models of channels that follow a path."""

from __future__ import annotations

from mpi4py import MPI

from bushcli.case import Case
from bushcli.curve.earlier import earlier
from bushcli.effects.active import acting, require_time
from bushcli.recording import Recording, displacement_noise
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Prepare, Rubber
from geometry.shape import Shape


def with_effects(
    recording: Recording,
    shape: Shape,
    rubber: Rubber,
    case: Case,
    comm: MPI.Comm,
    prepared: Prepare,
) -> Simulation | None:
    """Return the simulation of a channel with its effects along the whole record; None where no effect acts on it.

    Raises
    ------
    InputError
        The recording has no time, which an effect needs.
    """
    active = acting(case.effects, recording.name, recording.mode)
    if not active:
        return None
    path = recording.record
    if path.time is None:
        require_time(active, recording.name, recording.mode, str(recording.source))
    return Simulation(
        shape,
        modes()[recording.mode],
        rubber,
        case.mesh.refinement,
        active,
        path.time,
        path.displacement,
        displacement_noise(path),
        comm,
        prepared,
        earlier(path),
        path.temperature,
    )
