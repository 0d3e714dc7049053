"""Recordings with the effects that act on them; of a path of six motions one march, and a channel for each reaction."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case import Case
from bushcli.curve.earlier import earlier
from bushcli.curve.recording import RecordedPath, Recording
from bushcli.effects.active import ActiveEffect, effects_on_channel, require_time
from bushcli.effects.assembly import features_of
from bushcli.effects.change import Signal
from bushcli.simulate.derivatives import columns
from bushcli.simulate.schedule import six_schedule
from bushcli.simulate.simulation import Answer, FollowedPath, Simulation, Steps, logged_force, with_values
from cases.equilibrium import Equilibrium
from cases.local import Cells, LocalStiffness
from cases.march import TOLERANCE, History, march
from cases.mode import mode_of, modes
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber, prepare
from cases.stretches import principal_stretches
from geometry.shape import Refinement, Shape

Array = NDArray[np.float64]
Paths = dict[tuple[str, Refinement], "PathSimulation"]
"""Recorded paths that have been made, by name and mesh."""


class PathSimulation:
    """A recorded path that can be solved for any values of its parameters."""

    def __init__(
        self,
        shape: Shape,
        rubber: Rubber,
        refinement: Refinement,
        active: Sequence[ActiveEffect],
        recorded: RecordedPath,
        comm: MPI.Comm = MPI.COMM_WORLD,
        prepared: Prepare = prepare,
    ) -> None:
        self.recorded = recorded
        self.active = tuple(effect.with_start_values() for effect in active)
        self.plan(1.0)
        mode, features = mode_of("path", self.six), features_of(self.active)
        self.model: FiniteElementModel = prepared(shape, mode, rubber, refinement, comm, features)
        self._last: tuple[object, History] | None = None

    def plan(self, fineness: float, tolerance: float = TOLERANCE) -> None:
        """Choose the steps along the path, and the tolerance of its march: `FollowedPath.plan`."""
        self.fineness, self._tolerance, path = fineness, tolerance, self.recorded
        # The path itself does not depend on the steps.
        self.six, self.program, self.steps = six_schedule(path.time, path.motion, path.free, fineness)

    def march(
        self,
        names: Sequence[str],
        keep_states: bool = False,
        progress: Steps | None = None,
        failure_limit: int | None = None,
        observer: Callable[[Equilibrium], None] | None = None,
    ) -> History:
        """Follow the path with the model's present parameters; the last march is reused for the other reactions.

        Raises
        ------
        NotConverged
        """
        values = tuple(float(constant.value) for constant in self.model.constants.values())
        key = (values, self.fineness, tuple(names))
        known = self._last[1] if self._last is not None and self._last[0] == key else None
        if known is not None and observer is None and (known.states is not None or not keep_states):
            return known
        history = march(
            self.model,
            self.program,
            tolerance=self._tolerance,
            keep_states=keep_states,
            sensitivity=tuple(names),
            progress=progress,
            failure_limit=failure_limit,
            observer=observer,
        )
        self._last = (key, history)
        return history


class Reaction(FollowedPath):
    """One reaction of a recorded path of six motions.

    The rig's effects act on its force; those that change the displacement, such as free play, do nothing here.

    Parameters
    ----------
    simulation
        Simulation of the whole path.
    number
        Index of the reaction and of its motion.
    active
        All effects on the channel, with values.
    """

    def __init__(self, simulation: PathSimulation, number: int, active: Sequence[ActiveEffect]) -> None:
        self._whole, self._number = simulation, number
        rig_effects = [effect.with_start_values() for effect in active if effect.effect.rig is not None]
        self.active = (*simulation.active, *rig_effects)
        self.model, self.time = simulation.model, simulation.recorded.time
        self.displacement = simulation.recorded.motion[:, number]
        self._clock = np.arange(len(self.displacement), dtype=float) if self.time is None else self.time

    @property
    @override
    def path(self) -> Array:
        time = self._whole.six.time - self._whole.six.time[-1] + self._clock[-1]
        return np.interp(self._clock, time, self._whole.six.motion[:, self._number])

    @property
    @override
    def fineness(self) -> float:
        return self._whole.fineness

    @override
    def plan(self, fineness: float, tolerance: float = TOLERANCE) -> None:
        self._whole.plan(fineness, tolerance)

    @override
    def solve(
        self,
        parameters: Mapping[str, float],
        names: Sequence[str] = (),
        *,
        keep_states: bool = False,
        progress: Steps | None = None,
        failure_limit: int | None = None,
    ) -> Answer:
        active = with_values(self.model, self.active, parameters)
        inner = tuple(name for name in names if name in self.model.constants)
        history = self._whole.march(inner, keep_states, progress, failure_limit)
        assert history.motion is not None
        assert history.reactions is not None
        names, k = tuple(names), self._number
        slopes = None if history.reaction_sensitivity is None else history.reaction_sensitivity[:, k]
        count = len(history.reactions)
        force = Signal(history.reactions[:, k], columns(slopes, inner, names, count))
        q = Signal(history.motion[:, k], np.zeros((count, len(names))))
        read = logged_force(active, self._whole.steps, self._clock, q, force, names)
        return Answer(read.value, read.slope, history)

    @override
    def stretches_at_ends(self, failure_limit: int | None = None) -> list[Array]:
        stretches: list[Array] = []
        corners = {float(self._whole.program.displacement[i]) for i in self._whole.program.corners}
        ends = corners | {float(self._whole.program.displacement[-1])}

        def observe(solver: Equilibrium) -> None:
            if solver.q in ends:
                stretches.append(principal_stretches(self.model).reshape(-1, 3))

        self._whole.march((), failure_limit=failure_limit, observer=observe)
        return stretches

    @override
    def local_slopes(self) -> tuple[Array, Cells]:
        stiffness, rows = LocalStiffness(self.model, self._number), list[Array]()
        self._whole.march((), observer=lambda solver: rows.append(stiffness(solver)))
        return self._whole.steps.interpolation(self._clock) @ np.array(rows), stiffness.cells


def simulation_of_recording(
    recording: Recording,
    case: Case,
    shape: Shape,
    rubber: Rubber,
    refinement: Refinement,
    comm: MPI.Comm,
    prepared: Prepare,
    paths: Paths,
) -> FollowedPath | None:
    """Return a recording with the effects that act on it; None where the force depends on the displacement alone.

    Parameters
    ----------
    recording : Recording
        The samples in use.
    case : Case
        Its effects act.
    shape, rubber, refinement, comm
        Arguments of the finite-element model.
    prepared : callable
        Makes the finite-element model.
    paths : Paths
        Paths of six motions that have been made: their channels share one march.

    Raises
    ------
    InputError
        The recording has no time, which an effect needs.
    """
    active, record = effects_on_channel(case.effects, recording.name, recording.mode), recording.record
    if record.time is None:
        require_time(active, recording.name, recording.mode, str(recording.source))
    if recording.six is not None:
        # The channels of a path share one march.
        key = (recording.six.name, refinement)
        if key not in paths:
            on_it = [item for item in case.effects if item.acts_on(recording.name, "path")]
            on_it = [item for item in on_it if item.effect.feature is not None]
            on_it = [item.at(item.temperatures.get(recording.name)) for item in on_it]
            paths[key] = PathSimulation(shape, rubber, refinement, on_it, recording.six, comm, prepared)
        return Reaction(paths[key], recording.six.number, active)
    if not active:
        return None
    return Simulation(
        shape,
        modes()[recording.mode],
        rubber,
        refinement,
        active,
        record.time,
        record.displacement,
        record.displacement_noise,
        comm,
        prepared,
        earlier(record),
        record.temperature,
    )
