"""Channels to simulate: a load case or a recording, as a program to follow or a range to cover."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, LoadCase
from bushcli.effects.active import ActiveEffect, effects_on_channel
from bushcli.effects.change import Signal
from bushcli.effects.rig import parallel
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault
from bushcli.recording import Recording
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.admissible import check_travel
from bushcli.simulate.play import check_play
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.simulate.schedule import six_schedule
from bushcli.simulate.steps import RECORDED
from cases.load import PrescribedForce
from cases.march import History, march
from cases.march import Progress as StepProgress
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.simulate import even_targets, is_odd, sweep
from cases.six import SixPath

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SimulatedChannel:
    """A channel to simulate: a program to follow, or the range of a recording to cover.

    Attributes
    ----------
    name, mode : str
    march : callable
        Function of the model, whether states are kept, and progress; it returns the history.
    program : Program
        The program to follow; for a recording without path, from rest to the farther end of its range.
    time : shape (n,) or None
        s, of the whole path.
    displacement : shape (n,)
        mm or rad, of the whole path; s of a path of six motions.
    recording : Recording or None
        The samples in use.
    path : SixPath or None
        Path of six motions, prescribed or recorded, that the program follows.
    temperature : float or None
        Degrees C.
    by_force : bool
        The program and the displacements are forces, N or N mm, until the march has found the travel.
    """

    name: str
    mode: str
    march: Callable[[FiniteElementModel, bool, StepProgress], History]
    program: Program
    time: Array | None
    displacement: Array
    recording: Recording | None = None
    path: SixPath | None = None
    temperature: float | None = None
    by_force: bool = False

    @property
    def by_travel(self) -> bool:
        """Whether the travel of one motion is prescribed or recorded: effects of a rig act along it."""
        return self.path is None and not self.by_force

    def with_travel(self, history: History) -> SimulatedChannel:
        """Return the channel with the travel that a march found at the prescribed forces."""
        if not self.by_force or len(history.displacement) < 2:
            return self
        program = Program(history.displacement, history.time)
        return replace(self, program=program, time=program.time, displacement=program.displacement)


def load_case_channel(case: Case, load: LoadCase, tables: TableCache) -> SimulatedChannel:
    """Return the channel of a load case."""
    program, acting = load.program(tables), effects_on_channel(case.effects, load.label, load.mode)
    beside = [effect.with_start_values() for effect in acting]
    drive = with_all_beside(beside, program.time) if load.by_force else None

    def follow(model: FiniteElementModel, keep: bool, report: StepProgress) -> History:
        history = march(model, program, keep_states=keep, progress=report, drive=drive)
        return history if drive is None else drive.with_prescribed_force(history)

    curve, six, temperature = (program, program.time, program.displacement), load.six, load.temperature
    return SimulatedChannel(
        load.label, load.mode, follow, *curve, path=six, temperature=temperature, by_force=load.by_force
    )


def with_all_beside(active: Sequence[ActiveEffect], time: Array | None = None) -> PrescribedForce:
    """Return a prescribed force that the bushing carries together with all that stands beside it."""
    in_rig = [effect for effect in active if effect.effect.rig is not None]
    beside = [effect for effect in in_rig if effect.effect.rig and effect.effect.rig.parallel is not None]
    began = 0.0 if time is None else float(time[0])

    def force_on_all(q: float, force: float, time_of_state: float) -> float:
        displacement, reaction = (Signal(np.array([value]), np.zeros((1, 0))) for value in (q, force))
        elapsed = None if time is None else np.array([time_of_state - began])
        return float(parallel(beside, displacement, reaction, (), elapsed).value[0])

    return PrescribedForce(force_on_all) if beside else PrescribedForce()


def recording_channel(case: Case, recording: Recording) -> SimulatedChannel:
    """Return the channel of a recording.

    Without memory in the rubber, one solve over the range serves every cycle; if the curve is odd, one side of it.
    """
    low, high = min(0.0, float(recording.displacement.min())), max(0.0, float(recording.displacement.max()))
    symmetric = is_odd(case.geometry, modes()[recording.mode])
    if symmetric:
        low, high = (0.0, max(high, -low)) if high >= -low else (low, 0.0)
    targets = even_targets(low, high, RECORDED)
    furthest = high if high >= -low else low
    program = Program(np.linspace(0.0, furthest, RECORDED // 2 + 1, dtype=np.float64))
    six_path, record = None, recording.record
    if record.six is not None:
        six_path, program, _ = six_schedule(record.six.time, record.six.motion, record.six.free)

    def cover(model: FiniteElementModel, keep: bool, report: StepProgress) -> History:
        return sweep(model, targets, keep_states=keep, progress=report)

    curve = program, record.time, record.displacement
    return SimulatedChannel(recording.name, recording.mode, cover, *curve, recording, six_path)


def channels_to_simulate(
    case: Case, measured: RecordingCache
) -> tuple[list[SimulatedChannel], tuple[DataFault, ...]]:
    """Return the channels to simulate, and faults of the recordings; all files are read before the first march.

    Raises
    ------
    InputError
        There is nothing to simulate, or a travel or a free play is not admissible.
    """
    recordings, faults = measured(case)
    if not recordings and not case.load_cases and not case.dynamic:
        expected = "[[recordings]] or [[load_cases]]; vibrations are in `bushcli dynamic`"
        what, expected = "there is nothing to simulate", case.expected_tables(expected)
        raise InputError(Problem(case.path.name, what, "", expected))
    check_travel(case, recordings, faults)
    channels = [load_case_channel(case, load, measured.tables) for load in case.load_cases]
    channels += [recording_channel(case, recording) for recording in recordings]
    for channel in channels:
        if not channel.by_force:
            check_play(case, channel.name, channel.mode, channel.displacement)
    return channels, faults
