"""Predict the curves of a case: every load case along its program, every recording over its range."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, LoadCase, Material, load_case_names
from bushcli.effects.active import acting, require_time, require_values
from bushcli.effects.rig import NoEquilibrium
from bushcli.errors import InputError, Problem
from bushcli.faults import condition as fault_condition
from bushcli.faults import find_faults
from bushcli.recording import Recording, displacement_noise, matching, read_program, read_recording
from bushcli.recording.curve import Curve
from bushcli.runtime.interrupt import meet
from bushcli.runtime.names import file_names
from bushcli.simulate import fields as field_files
from bushcli.simulate.admissible import check_material, check_travel
from bushcli.simulate.play import check_play
from bushcli.simulate.response import ERROR_OVER_CHANGE, FINER, Progress, Response, Simulated, conditions
from bushcli.simulate.simulation import Answer, Simulation
from cases.march import History, NotConverged, march, unsolved
from cases.march import Progress as StepProgress
from cases.mode import modes
from cases.model import Model
from cases.program import Program, path
from cases.simulate import Rubber, even_targets, is_odd, prepare, sweep
from cases.stability import stable
from cases.stretches import Surface, principal_stretches, surface
from forms.law import law

Array = NDArray[np.float64]

# Steps on the longer side of a recording's range: a cubic spline through them is exact to 0.01 % of the
# force.
RECORDING_STEPS = 16
# States of the march in which the law's stability is checked, evenly chosen.
STABILITY_STATES = 6


def predict(
    case: Case,
    material: Material | None = None,
    *,
    mesh_check: bool = False,
    fields: Path | None = None,
    pictures: bool = True,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
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
        Folder for field files (XDMF), one per channel; None writes none.
    pictures : bool
        Keep the surface of each channel's widest state, of which pictures are made.
    progress : Progress or None
        Called after each step of the march.
    comm : MPI.Comm
        Ranks that share each model.

    Returns
    -------
    Response
        Also if a march stops early: the channel then has the reason and the curve up to there.

    Raises
    ------
    InputError
        A recording cannot be read, there is nothing to simulate, or the law is unstable from the start.
    """
    material = material or case.material
    check_material(case, material)
    # All input is read before anything is solved: a bad file must not cost a march.
    require_values(case.effects, case.path.name)
    recordings = [read_recording(source) for source in case.recordings]
    wholes = (
        [read_recording(source, whole=True) for source in case.recordings] if case.effects else recordings
    )
    if not recordings and not case.load_cases:
        wanted = "[[recordings]] or [[load_cases]]"
        raise InputError(Problem(case.path.name, "there is nothing to simulate", "", wanted))
    faults = find_faults(case, recordings)
    check_travel(case, recordings, faults)
    channels = [_prescribed(case, load, number) for number, load in enumerate(case.load_cases)]
    channels += [_recorded(case, *pair) for pair in zip(recordings, wholes, strict=True)]
    for channel in channels:
        check_play(case, channel.name, channel.mode, channel.displacement)
    run = _Run(case, rubber_of(material), mesh_check, fields, pictures, progress, comm)
    simulated = tuple(run.simulate(channel) for channel in channels)
    found = tuple(condition for channel in simulated for condition in conditions(channel))
    return Response(case, material, simulated, (*map(fault_condition, faults), *found), faults)


def rubber_of(material: Material) -> Rubber:
    """Return law, parameters and bulk modulus of a case as the march needs them."""
    return Rubber(law(material.law), dict(material.parameters), material.bulk_modulus)


@dataclass(frozen=True)
class _Channel:
    """What is to be simulated: a program to follow, or the range of a recording to cover."""

    name: str
    mode: str
    march: Callable[[Model, bool, StepProgress], History]
    time: Array | None
    displacement: Array
    recording: Recording | None = None
    whole: Recording | None = None


def _prescribed(case: Case, load: LoadCase, number: int) -> _Channel:
    if load.source is not None:
        times, displacement = read_program(load.source)
        program = Program(displacement, times)
    else:
        program = path(load.path, load.steps, load.rate)
    name = load_case_names(case.load_cases, case.recordings)[number]
    return _Channel(
        name,
        load.mode,
        lambda model, keep, report: march(model, program, keep_states=keep, progress=report),
        program.time,
        program.displacement,
    )


def _recorded(case: Case, recording: Recording, whole: Recording) -> _Channel:
    # Without memory in the rubber, one solve over the range serves every cycle; if the curve is odd, one side of it.
    low, high = min(0.0, float(recording.displacement.min())), max(0.0, float(recording.displacement.max()))
    if is_odd(case.geometry, modes()[recording.mode]):
        low, high = (0.0, max(high, -low)) if high >= -low else (low, 0.0)
    targets = even_targets(low, high, RECORDING_STEPS)
    return _Channel(
        recording.name,
        recording.mode,
        lambda model, keep, report: sweep(model, targets, keep_states=keep, progress=report),
        whole.time,
        whole.displacement,
        recording,
        whole,
    )


@dataclass(frozen=True)
class _Run:
    """What all channels of a prediction share."""

    case: Case
    rubber: Rubber
    mesh_check: bool
    fields: Path | None
    pictures: bool
    progress: Progress | None
    comm: MPI.Comm

    def model(self, mode: str, factor: float = 1.0) -> Model:
        refinement = replace(self.case.mesh.refinement, factor=factor)
        return prepare(self.case.geometry, modes()[mode], self.rubber, refinement, self.comm)

    def simulate(self, channel: _Channel) -> Simulated:
        """March one channel, and examine the stretches and the stability of its states."""

        def report(step: int, steps: int, newton: int, q: float) -> None:
            meet(self.comm)
            if self.progress is not None:
                self.progress(channel.name, step, steps, newton, q)

        begin = time.perf_counter()
        simulation = self.simulation(channel)
        model = self.model(channel.mode) if simulation is None else simulation.model
        ready = time.perf_counter()
        stopped, answer, step_error = "", None, None
        try:
            if simulation is None:
                history = channel.march(model, True, report)
            else:
                step_error = 100.0 * simulation.refine({}) if simulation.path_dependent else None
                answer = simulation.solve({}, keep_states=True, progress=report)
                history = answer.history
            target = reach = float(history.displacement[np.argmax(np.abs(history.displacement))])
        except NotConverged as failure:
            history, stopped = failure.history, failure.reason
            reach, target = failure.last, failure.target
        except NoEquilibrium as failure:
            history, stopped = unsolved("").history, str(failure)
            reach = target = 0.0
        done = time.perf_counter()
        stretches, unstable = _stability(model, history, self.rubber)
        unwritten = ""
        if self.fields is not None and history.states is not None:
            name = file_names(one for one, _ in self.case.channels)[channel.name]
            unwritten = field_files.written(model, history, self.fields / f"{name}.xdmf")
        error = None
        if self.mesh_check and not stopped:
            error = self._mesh_error(channel, history.force if answer is None else answer.force)
        return Simulated(
            name=channel.name,
            mode=channel.mode,
            curve=_curve(self.case, channel, history) if answer is None else _along(channel, answer),
            recording=channel.recording,
            attempts=history.attempts,
            stopped=stopped,
            reach=reach,
            target=target,
            unknowns=model.space.dofmap.index_map.size_global,
            stretches=stretches,
            unstable=unstable,
            seconds={"mesh_and_forms": ready - begin, "march": done - ready},
            surface=_picture(model, history) if self.pictures else None,
            mesh_error=error,
            step_error=step_error,
            along=answer is not None and channel.recording is not None,
            unwritten=unwritten,
        )

    def simulation(self, channel: _Channel, factor: float = 1.0) -> Simulation | None:
        """Return the channel with the effects that act on it; None if no effect does."""
        active = acting(self.case.effects, channel.name, channel.mode)
        if not active:
            return None
        where = self.case.path.name if channel.recording is None else str(channel.recording.source)
        if channel.time is None:
            require_time(active, channel.name, channel.mode, where)
        return Simulation(
            self.case.geometry,
            modes()[channel.mode],
            self.rubber,
            replace(self.case.mesh.refinement, factor=factor),
            active,
            channel.time,
            channel.displacement,
            None if channel.whole is None else displacement_noise(channel.whole),
            self.comm,
        )

    def _mesh_error(self, channel: _Channel, force: Array) -> float:
        """Return the error of the mesh, estimated with a finer one, percent of the force range; inf if that fails."""
        try:
            simulation = self.simulation(channel, FINER)
            if simulation is None:
                fine = channel.march(self.model(channel.mode, FINER), False, lambda *_: None).force
            else:
                fine = simulation.solve({}).force
        except (NotConverged, NoEquilibrium):
            return float("inf")
        change = float(np.max(np.abs(force - fine)) / np.ptp(fine))
        return 100.0 * ERROR_OVER_CHANGE * change


def _along(channel: _Channel, answer: Answer) -> Curve:
    """Return the force at the samples of the channel."""
    if channel.recording is None or channel.whole is None:
        return Curve(channel.mode, channel.displacement, answer.force, channel.time)
    recording = channel.recording
    used = matching(channel.whole, recording)
    return Curve(channel.mode, recording.displacement, answer.force[used], recording.time)


def _curve(case: Case, channel: _Channel, history: History) -> Curve:
    """Return the part of the curve that was reached, with at least two points even if the first step failed."""
    q, force = history.displacement, history.force
    if len(q) < 2:
        return Curve(channel.mode, np.array([0.0, 1e-9]), np.zeros(2))
    recording = channel.recording
    if recording is None:
        return Curve(channel.mode, q, force, history.time)
    both = float(recording.displacement.min()) < 0.0 < float(recording.displacement.max())
    if both and is_odd(case.geometry, modes()[channel.mode]):
        _, first = np.unique(np.concatenate([q, -q]), return_index=True)
        q, force = np.concatenate([q, -q])[first], np.concatenate([force, -force])[first]
        # Up to the recorded range and one step more: the plot and the stiffness are of the recorded range.
        low, high = recording.displacement.min(), recording.displacement.max()
        step = float(np.diff(q).max())
        in_range = (q >= low - step) & (q <= high + step)
        q, force = q[in_range], force[in_range]
    return Curve(channel.mode, q, force)


def _stability(model: Model, history: History, rubber: Rubber) -> tuple[tuple[float, float], float]:
    """Return the range of principal stretches over the march, and the share of states in which the law is unstable."""
    assert history.states is not None
    low, high, bad, total = 1.0, 1.0, 0, 0
    count = len(history.states)
    for i in np.unique(np.linspace(0, count - 1, min(STABILITY_STATES, count)).round().astype(int)):
        model.state.x.array[:] = history.states[i]
        values = principal_stretches(model).reshape(-1, 3)
        if len(values):
            low, high = min(low, float(values.min())), max(high, float(values.max()))
            bad += int(np.count_nonzero(~stable(rubber.law, rubber.parameters, values)))
            total += len(values)
    low, high = model.comm.allreduce(low, MPI.MIN), model.comm.allreduce(high, MPI.MAX)
    bad, total = model.comm.allreduce(bad), model.comm.allreduce(total)
    return (low, high), bad / max(total, 1)


def _picture(model: Model, history: History) -> Surface | None:
    assert history.states is not None
    if not len(history.states):
        return None
    widest = int(np.argmax(np.abs(history.displacement)))
    model.state.x.array[:] = history.states[widest]
    return surface(model, float(history.displacement[widest]))
