"""Predict the curves of a case: every load case along its program, every recording over its range."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, LoadCase, Material, load_case_names
from bushcli.effects.active import acting, require_time, require_values
from bushcli.effects.rig import NoEquilibrium
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault, find_faults
from bushcli.faults import condition as fault_condition
from bushcli.recording import Recording, displacement_noise, matching, read_program, read_recording
from bushcli.recording.curve import Curve
from bushcli.runtime.condition import Condition
from bushcli.runtime.names import file_names
from bushcli.simulate import fields as field_files
from bushcli.simulate.play import check_play
from bushcli.simulate.simulation import Answer, Simulation
from cases.march import Attempt, History, NotConverged, march, unsolved
from cases.march import Progress as StepProgress
from cases.mode import modes
from cases.model import Model
from cases.program import Program, path
from cases.simulate import Rubber, even_targets, is_odd, prepare, sweep
from cases.stability import coupon_limits, stable
from cases.stretches import Surface, principal_stretches, surface
from forms.law import law
from geometry.ring import Ring

Array = NDArray[np.float64]

# Steps on the longer side of a recording's range: a cubic spline through them is exact to 0.01 % of the
# force.
RECORDING_STEPS = 16
# States of the march in which the law's stability is checked, evenly chosen.
STABILITY_STATES = 6
# A law that is unstable between these stretches is no rubber's.
SMALL_STRAIN = (0.9, 1.1)
# Elements of the finer mesh of a mesh check over those of the mesh in use, in each direction. The bond edges leave
# convergence of about first order, for which the error is twice the change that halving the elements makes
# (measured against converged curves: 1.4 to 2.6 times).
FINER, ERROR_OVER_CHANGE = 2.0, 2.0

Progress = Callable[[str, int, int, int, float], None]
"""Called with channel, step, number of steps, Newton iterations, displacement (mm or rad)."""


@dataclass(frozen=True)
class Simulated:
    """One simulated channel.

    Attributes
    ----------
    name, mode : str
    curve : Curve
        At the steps of the march, as far as it went.
    recording : Recording or None
        The measured curve that it stands beside.
    attempts
        Every step tried.
    stopped : str
        Why the march could not go on; empty when it reached its end.
    reach : float
        Last displacement in equilibrium, mm or rad, when it stopped early.
    target : float
        Displacement that it was to reach.
    unknowns : int
        Size of the linear systems.
    stretches : tuple of float
        Smallest and largest principal stretch that the rubber reaches.
    unstable : float
        Share of the rubber's states (at the checked steps) in which the law violates Drucker's postulate.
    seconds : mapping
        Time of "mesh_and_forms" and "march".
    surface : Surface or None
        For pictures, at the largest displacement; on rank 0 only.
    mesh_error : float or None
        Estimated discretisation error, percent of the force range, when a mesh check was asked for.
    step_error : float or None
        Estimated error of following the recorded path in steps (rms), percent of the force range; None where the force
        does not depend on the path.
    along : bool
        The curve is the force at the recording's samples, one by one.
    unwritten : str
        Why its fields could not be written; empty where they were, or were not asked for.
    """

    name: str
    mode: str
    curve: Curve
    recording: Recording | None
    attempts: tuple[Attempt, ...]
    stopped: str
    reach: float
    target: float
    unknowns: int
    stretches: tuple[float, float]
    unstable: float
    seconds: Mapping[str, float]
    surface: Surface | None = field(default=None, repr=False)
    mesh_error: float | None = None
    step_error: float | None = None
    along: bool = False
    unwritten: str = ""

    @property
    def newton(self) -> int:
        """Newton iterations of the whole march."""
        return sum(attempt.newton for attempt in self.attempts)


@dataclass(frozen=True)
class Response:
    """What the case answers: its channels, the conditions under which to read them, and faults of the recordings."""

    case: Case
    material: Material
    channels: tuple[Simulated, ...]
    conditions: tuple[Condition, ...]
    faults: tuple[DataFault, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether every march reached its end."""
        return not any(channel.stopped for channel in self.channels)


def predict(
    case: Case,
    material: Material | None = None,
    *,
    mesh_check: bool = False,
    fields: Path | None = None,
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
    progress : Progress or None
        Called after each step of the march.
    comm : MPI.Comm
        Ranks that share each model.

    Returns
    -------
    Response
        Also where a march could not go on: the channel says why, and has what was reached.

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
    _check_travel(case, recordings, faults)
    channels = [_prescribed(case, load, number) for number, load in enumerate(case.load_cases)]
    channels += [_recorded(case, *pair) for pair in zip(recordings, wholes, strict=True)]
    for channel in channels:
        check_play(case, channel.name, channel.mode, channel.displacement)
    run = _Run(case, rubber_of(material), mesh_check, fields, progress, comm)
    simulated = tuple(run.simulate(channel) for channel in channels)
    found = tuple(condition for channel in simulated for condition in _conditions(channel))
    return Response(case, material, simulated, (*map(fault_condition, faults), *found), faults)


def rubber_of(material: Material) -> Rubber:
    """The material of a case, as the march wants it."""
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
    # Without history in the law, one solve over the range serves every cycle; where the curve is odd, one side.
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


def check_material(case: Case, material: Material) -> None:
    """Refuse a material without parameters, or one that is unstable (Drucker) at small strain.

    Parameters
    ----------
    case : Case
        Its file is named in the message.
    material : Material
        Law and parameters to check.

    Raises
    ------
    InputError
    """
    if not material.parameters:
        raise InputError(
            Problem(
                case.path.name, "material.parameters are not given", "", "them, or [[coupons]] to fit them to"
            )
        )
    chosen = law(material.law)
    for mode, (low, high) in coupon_limits(chosen, dict(material.parameters)).items():
        if low > SMALL_STRAIN[0] or high < SMALL_STRAIN[1]:
            raise InputError(
                Problem(
                    case.path.name,
                    f"material.parameters make {material.law} unstable: in {mode} deformation it is stable only "
                    f"between stretches {low:.3g} and {high:.3g}",
                    "",
                    f"stable at least between {SMALL_STRAIN[0]:g} and {SMALL_STRAIN[1]:g}",
                )
            )


def _check_travel(case: Case, recordings: Sequence[Recording], faults: Sequence[DataFault]) -> None:
    """Refuse a radial recording that goes further than there is rubber: wrong units, or another bushing."""
    remedies = {fault.channel: fault.remedy for fault in reversed(faults) if fault.fatal}
    if not isinstance(case.geometry, Ring):
        return
    for recording in recordings:
        furthest = float(np.abs(recording.displacement).max())
        if recording.mode == "radial" and furthest >= case.geometry.thickness:
            raise InputError(
                Problem(
                    str(recording.source),
                    f"goes to {furthest:.4g} mm, but the rubber is only {case.geometry.thickness:.4g} mm thick",
                    "",
                    remedies.get(
                        recording.name,
                        "displacement in mm of the bushing in [geometry]; units = { displacement = ... } for another "
                        "unit",
                    ),
                )
            )


@dataclass(frozen=True)
class _Run:
    """What all channels of a prediction share."""

    case: Case
    rubber: Rubber
    mesh_check: bool
    fields: Path | None
    progress: Progress | None
    comm: MPI.Comm

    def model(self, mode: str, factor: float = 1.0) -> Model:
        refinement = replace(self.case.mesh.refinement, factor=factor)
        return prepare(self.case.geometry, modes()[mode], self.rubber, refinement, self.comm)

    def simulate(self, channel: _Channel) -> Simulated:
        """March one channel and look at what it went through."""

        def report(step: int, steps: int, newton: int, q: float) -> None:
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
            surface=_picture(model, history),
            mesh_error=error,
            step_error=step_error,
            along=answer is not None and channel.recording is not None,
            unwritten=unwritten,
        )

    def simulation(self, channel: _Channel, factor: float = 1.0) -> Simulation | None:
        """The channel with the effects that act on it; None where none does."""
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
        """Discretisation error estimated from a finer mesh, percent of the force range; infinite where it fails."""
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
    """The force at the channel's own samples."""
    if channel.recording is None or channel.whole is None:
        return Curve(channel.mode, channel.displacement, answer.force, channel.time)
    recording = channel.recording
    used = matching(channel.whole, recording)
    return Curve(channel.mode, recording.displacement, answer.force[used], recording.time)


def _curve(case: Case, channel: _Channel, history: History) -> Curve:
    """The curve as far as it went: never less than two points, for a march may fail at its first step."""
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
        # No further than was recorded, but for a step: the plot and the stiffness are of the recorded range.
        low, high = recording.displacement.min(), recording.displacement.max()
        step = float(np.diff(q).max())
        kept = (q >= low - step) & (q <= high + step)
        q, force = q[kept], force[kept]
    return Curve(channel.mode, q, force)


def _stability(model: Model, history: History, rubber: Rubber) -> tuple[tuple[float, float], float]:
    """Range of the principal stretches over the march, and the share of states where the law is unstable."""
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


def _conditions(channel: Simulated) -> list[Condition]:
    found = []
    if channel.stopped:
        unit, factor = ("deg", 180.0 / np.pi) if modes()[channel.mode].rotational else ("mm", 1.0)
        found.append(
            Condition(
                "not_converged",
                f"{channel.name}: no equilibrium beyond {channel.reach * factor:.4g} {unit} on the way to "
                f"{channel.target * factor:.4g} {unit} ({channel.stopped}); the curve ends there",
                "ask for a smaller displacement, other steps (larger ones leap over a fold of the free ends) or a "
                "coarser mesh; beyond some 60 % of the rubber's thickness radial loads fold the free ends",
            )
        )
    if channel.unstable > 0:
        found.append(
            Condition(
                "unstable_law",
                f"{channel.name}: the law violates Drucker's stability in {100 * channel.unstable:.2g} % of the states "
                f"that the rubber reaches (principal stretches {channel.stretches[0]:.2f} to "
                f"{channel.stretches[1]:.2f})",
                "fit to coupons that reach these stretches, or choose a law that is stable there (yeoh with C30 > 0)",
            )
        )
    if channel.unwritten:
        found.append(
            Condition(
                "fields_not_written",
                f"{channel.name}: the field file could not be written ({channel.unwritten}); the curve is complete",
                "free some space and run again, or use another -o; --no-fields leaves fields out",
            )
        )
    if channel.mesh_error is not None and channel.mesh_error > 1.0:
        change = f"lets expect an error of {channel.mesh_error:.2g} % of the force range"
        found.append(
            Condition(
                "coarse_mesh",
                f"{channel.name}: a mesh {FINER:g} times as fine in each direction "
                + (change if np.isfinite(channel.mesh_error) else "does not get as far"),
                "raise mesh.elements_across, elements_along and elements_around",
            )
        )
    return found
