"""Predict the curves of a case: every load case along its program, every recording over its range."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.case.hardness import known_from_hardness
from bushcli.case.temperatures import unused_temperatures
from bushcli.case.typical import unusual_values
from bushcli.effects.active import effects_on_channel, in_state, require_time, state_in_words
from bushcli.effects.assembly import features_of
from bushcli.effects.rig import NoEquilibrium
from bushcli.faults import condition as fault_condition
from bushcli.runtime.interrupt import meet
from bushcli.runtime.names import file_names
from bushcli.simulate import fields as field_files
from bushcli.simulate.admissible import check_material
from bushcli.simulate.channels import SimulatedChannel, channels_to_simulate
from bushcli.simulate.contact import met_unnoticed, not_shared, processes_sharing_mesh, surfaces_that_met
from bushcli.simulate.curves import curve_of, force_change, history_change
from bushcli.simulate.extent import Extent, of_path, outside_measured, tested_temperatures
from bushcli.simulate.prediction_cache import PredictionCache
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.simulate.response import (
    ERROR_OVER_CHANGE,
    FINER,
    PredictionInterrupted,
    Progress,
    Response,
    Simulated,
    conditions,
)
from bushcli.simulate.simulation import Answer, FollowedPath, Simulation
from bushcli.simulate.stiffness import check_state, matrices
from bushcli.simulate.strains import strains_over_march
from cases.history import Interrupted
from cases.march import History, NotConverged, failure_at_start
from cases.mode import Mode, mode_of, modes
from cases.model import FiniteElementModel
from cases.simulate import Rubber
from forms.law import law

if TYPE_CHECKING:
    from bushcli.simulate.reaction import Paths

Array = NDArray[np.float64]


def predict(
    case: Case,
    material: Material | None = None,
    *,
    mesh_check: bool = False,
    fields: Path | None = None,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    stiffness: bool = False,
    stiffness_at: float | None = None,
    unrelaxed: bool = False,
    kept: PredictionCache | None = None,
    pictures: bool = True,
) -> Response:
    """Simulate every load case and every recording of a case.

    Parameters
    ----------
    case : Case
        Validated case.
    material : Material or None
        Used instead of the material of the case, such as one identified from coupons.
    mesh_check : bool
        Solve again on a finer mesh and estimate the discretisation error of each curve.
    fields : Path or None
        Folder for field files (XDMF), one per channel; without it none are written.
    progress : Progress or None
        Called after each step of the march.
    comm : MPI.Comm
        Ranks that share each model.
    stiffness, stiffness_at : bool, float or None
        Take the 6 x 6 stiffness matrix at rest and at the end of every channel, and at this displacement (mm, °; s).
    unrelaxed : bool
        Whether the stiffness matrices are those in a sudden step; else those after a long rest.
    kept : PredictionCache or None
        Models, recordings and steps of earlier predictions, which are reused.
    pictures : bool
        Whether to keep the deformed surface of each channel.

    Returns
    -------
    Response
        Also if a march stops early: the channel then has the reason and the curve up to there.

    Raises
    ------
    InputError
        A recording cannot be read, there is nothing to simulate, or the law is unstable from the start.
    PredictionInterrupted
        The user interrupted it; it carries the channels so far.
    """
    material = material or case.material
    check_material(case, material)
    kept = kept or PredictionCache()
    channels, faults = channels_to_simulate(case, kept.measured)
    check_state(channels, stiffness_at)
    wanted = pictures, stiffness, stiffness_at, unrelaxed
    run = _Prediction(case, rubber_of(material), mesh_check, fields, progress, comm, kept, *wanted)
    run = run.shared_by(processes_sharing_mesh(case, comm))
    simulated, interrupted = run.simulate_all(channels)
    doubts = [*known_from_hardness(material), *map(fault_condition, faults)]
    doubts += not_shared({channel.name: channel.touched for channel in simulated}, comm)
    doubts += [condition for channel in simulated for condition in conditions(case, channel)]
    tested = tested_temperatures(case)
    tested += [_extent(channel) for channel in channels if channel.recording is not None]
    by_travel = [channel for channel in channels if channel.by_travel]
    for channel in by_travel:
        if channel.recording is None:
            active = effects_on_channel(case.effects, channel.name, channel.mode)
            doubts += outside_measured(channel.name, _extent(channel), tested, active)
    doubts += unusual_values(case, material, by_travel)
    doubts += unused_temperatures(case, [channel.recording or channel for channel in channels])
    response = Response(case, material, simulated, tuple(doubts), faults)
    if interrupted:
        raise PredictionInterrupted(response)
    return response


def _extent(channel: SimulatedChannel) -> Extent:
    return of_path(channel.mode, channel.displacement, channel.time, channel.temperature)


def fineness_of(case: Case, material: Material, measured: RecordingCache) -> dict[str, float]:
    """Return how fine the steps along each recorded path have to be, by channel: for other designs of the same case.

    Channels whose force does not depend on the path, or whose path cannot be followed to its end, are left out.

    Parameters
    ----------
    case : Case
        Validated case.
    material : Material
        Used instead of the material of the case.
    measured : RecordingCache
        Reads the recordings.

    Raises
    ------
    InputError
        As in `predict`.
    """
    check_material(case, material)
    channels, _ = channels_to_simulate(case, measured)
    run = _Prediction(case, rubber_of(material), False, None, None, MPI.COMM_SELF, PredictionCache(), False)
    by_channel = {}
    for channel in channels:
        simulation = run.simulation(channel)
        if channel.recording is None or simulation is None or not simulation.path_dependent:
            continue
        try:
            simulation.refine({})
            by_channel[channel.name] = simulation.fineness
        except (NotConverged, NoEquilibrium):
            continue
    return by_channel


def rubber_of(material: Material) -> Rubber:
    """Return law, parameters and bulk modulus of a case as the march needs them."""
    return Rubber(law(material.law), dict(material.parameters), material.bulk_modulus)


@dataclass(frozen=True)
class _Prediction:
    """Common data of all channels of a prediction."""

    case: Case
    rubber: Rubber
    mesh_check: bool
    fields: Path | None
    progress: Progress | None
    comm: MPI.Comm
    kept: PredictionCache
    pictures: bool
    stiffness: bool = False
    stiffness_at: float | None = None
    unrelaxed: bool = False
    paths: Paths = field(default_factory=dict)

    def shared_by(self, comm: MPI.Comm) -> _Prediction:
        """Return the run with meshes that these processes share; of several runs alone only the first writes files."""
        if comm.size == self.comm.size:
            return self
        return replace(self, comm=comm, fields=self.fields if self.comm.rank == 0 else None, paths={})

    def model(
        self, channel: SimulatedChannel, factor: float = 1.0, mode: Mode | None = None
    ) -> FiniteElementModel:
        refinement = replace(self.case.mesh.refinement, factor=factor)
        features = features_of(effects_on_channel(self.case.effects, channel.name, channel.mode))
        mode = mode or mode_of(channel.mode, channel.path)
        return self.kept.prepared(self.case.geometry, mode, self.rubber, refinement, self.comm, features)

    def matrices(self, channel: SimulatedChannel) -> dict[str, tuple[float, Array]] | None:
        """Return the stiffness matrices that were requested; None if the march did not reach its end."""
        if not self.stiffness or modes()[channel.mode].specimen != "bushing":
            return {}
        # One state in every matrix: else nothing has relaxed in that at rest, and a part in the last one.
        settled = replace(self, case=replace(self.case, effects=in_state(self.case.effects, self.unrelaxed)))
        try:
            return matrices(channel, self.stiffness_at, lambda mode: settled.model(channel, mode=mode))
        except NotConverged:
            return None

    def simulate_all(self, channels: Sequence[SimulatedChannel]) -> tuple[tuple[Simulated, ...], bool]:
        """March the channels; also return whether the user interrupted one of them, which is then the last."""
        responses: list[Simulated] = []
        try:
            for channel in channels:
                responses.append(self.simulate(channel))
                if responses[-1].stopped == Interrupted.reason:
                    raise KeyboardInterrupt
        except KeyboardInterrupt:
            if not responses:
                raise
            return tuple(responses), True
        return tuple(responses), False

    def simulate(self, channel: SimulatedChannel) -> Simulated:
        """March one channel, and examine the stretches and the stability of its states."""

        def report(step: int, steps: int, newton: int, q: float) -> None:
            meet(self.comm)
            if self.progress is not None:
                self.progress(channel.name, step, steps, newton, q)

        start = time.perf_counter()
        simulation = self.simulation(channel)
        model = self.model(channel) if simulation is None else simulation.model
        ready = time.perf_counter()
        stopped, answer, step_error, largest = "", None, None, None
        try:
            if simulation is None:
                history = channel.march(model, True, report)
            else:
                step_error = self._steps(channel, simulation)
                answer = simulation.solve({}, keep_states=True, progress=report)
                history = answer.history
            target = reach = float(history.displacement[np.argmax(np.abs(history.displacement))])
        except (NotConverged, Interrupted) as failure:
            history, stopped = failure.history, failure.reason
            reach, target = failure.last, failure.target
            largest = getattr(failure, "largest", None)
        except NoEquilibrium as failure:
            history, stopped = failure_at_start("").history, str(failure)
            reach = target = 0.0
        simulator = self.shared_by(MPI.COMM_SELF)
        if met_unnoticed(self.case, model, history, lambda: simulator.model(channel)):
            return simulator.simulate(channel)
        end = time.perf_counter()
        channel = channel.with_travel(history)
        curve, six = curve_of(self.case, channel, history, answer)
        unwritten = ""
        if self.fields is not None and history.states is not None:
            name = file_names(name for name, _ in self.case.channels)[channel.name]
            unwritten = field_files.write_field_file(model, history, self.fields / f"{name}.xdmf")
        checked = self.mesh_check and not stopped
        error = self._mesh_error(channel, history, answer) if checked else None
        return Simulated(
            name=channel.name,
            mode=curve.mode,
            curve=curve,
            in_time=channel.path is not None,
            recording=channel.recording,
            attempts=history.attempts,
            stopped=stopped,
            reach=reach,
            target=target,
            unknowns=model.space.dofmap.index_map.size_global,
            strained=strains_over_march(model, history, self.rubber),
            seconds={"mesh_and_forms": ready - start, "march": end - ready},
            surface=field_files.picture(model, history) if self.pictures else None,
            mesh_error=error,
            step_error=step_error,
            along=answer is not None and channel.recording is not None,
            unwritten=unwritten,
            six=six,
            stiffness=self.matrices(channel),
            unrelaxed=self.unrelaxed,
            state=state_in_words(self.case.effects, self.unrelaxed),
            touched=surfaces_that_met(model, history),
            before=None if simulation is None else simulation.path_before,
            by_force=channel.by_force,
            largest=largest,
        )

    def _steps(self, channel: SimulatedChannel, simulation: FollowedPath) -> float | None:
        """Choose the steps along a recorded path, and return their error if it was requested."""
        if channel.name in self.kept.fineness:
            simulation.plan(self.kept.fineness[channel.name])
            return None
        return 100.0 * simulation.refine({}) if simulation.path_dependent else None

    def simulation(self, channel: SimulatedChannel, factor: float = 1.0) -> FollowedPath | None:
        """Return the channel with the effects that act on it; None if no effect does."""
        case, recording = self.case, channel.recording
        refinement, prepared = replace(case.mesh.refinement, factor=factor), self.kept.prepared
        if recording is not None:
            # A case of load cases does not need it.
            from bushcli.simulate.reaction import simulation_of_recording

            return simulation_of_recording(
                recording, case, case.geometry, self.rubber, refinement, self.comm, prepared, self.paths
            )
        active = effects_on_channel(case.effects, channel.name, channel.mode)
        if not active or not channel.by_travel:
            return None
        if channel.time is None:
            require_time(active, channel.name, channel.mode, case.path.name)
        return Simulation(
            case.geometry,
            modes()[channel.mode],
            self.rubber,
            refinement,
            active,
            channel.time,
            channel.displacement,
            None,
            self.comm,
            prepared,
        )

    def _mesh_error(self, channel: SimulatedChannel, history: History, answer: Answer | None) -> float:
        """Return the error of the mesh, estimated with a finer one, percent of the force range; inf if that fails."""
        try:
            simulation = self.simulation(channel, FINER)
            if simulation is not None and answer is not None:
                share = force_change(answer.force, simulation.solve({}).force)
            else:
                fine = channel.march(self.model(channel, FINER), False, lambda *_: None)
                share = history_change(history, fine)
        except (NotConverged, NoEquilibrium):
            return float("inf")
        return 100.0 * ERROR_OVER_CHANGE * share
