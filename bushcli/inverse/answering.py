"""Models of channels that follow a path: a simulation with effects, or a reaction of six motions."""

from __future__ import annotations

from mpi4py import MPI

from bushcli.case import Case
from bushcli.effects.active import acting, require_time
from bushcli.recording import RecordedPath, Recording, displacement_noise
from bushcli.simulate.simulation import Simulation
from bushcli.simulate.six_simulation import Reaction, SixSimulation, on_path
from cases.mode import modes
from cases.simulate import Prepare, Rubber
from geometry.shape import Shape


def with_effects(
    recording: Recording,
    path: Recording,
    shape: Shape,
    rubber: Rubber,
    case: Case,
    comm: MPI.Comm,
    prepared: Prepare,
) -> Simulation | None:
    """Return the channel with its effects, which follow the whole path; None where no effect acts on it.

    Parameters
    ----------
    recording, path : Recording
        The samples in use, and all of them.
    shape, rubber, case, comm, prepared
        Of the finite-element model; the case's effects act.

    Raises
    ------
    InputError
        The recording has no time, which an effect needs.
    """
    active = acting(case.effects, recording.name, recording.mode)
    if not active:
        return None
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
    )


def with_others(
    recording: Recording,
    path: RecordedPath,
    paths: dict[str, SixSimulation],
    shape: Shape,
    rubber: Rubber,
    case: Case,
    comm: MPI.Comm,
    prepared: Prepare,
) -> Reaction:
    """Return the models for the channels of a path of six motions, which share one march.

    Parameters
    ----------
    recording : Recording
    path : RecordedPath
        All of its motions.
    paths : dict of str to SixSimulation
        Those that are there already, by name; this one is added.
    shape, rubber, case, comm, prepared
        Of the finite-element model; the case's effects act.

    Raises
    ------
    InputError
        The path has no time, which an effect needs.
    """
    if path.name not in paths:
        on_it = on_path(case.effects, recording.name)
        paths[path.name] = SixSimulation(shape, rubber, case.mesh.refinement, on_it, path, comm, prepared)
    active = acting(case.effects, recording.name, recording.mode)
    if path.time is None:
        require_time(case.effects, recording.name, recording.mode, str(recording.source))
    return Reaction(paths[path.name], path.number, active)
