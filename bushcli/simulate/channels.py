"""Channels to simulate: a load case or a recording, as a program to follow or a range to cover."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, LoadCase, load_case_names
from bushcli.recording import Recording
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.six import program_of
from bushcli.simulate.six_schedule import six_schedule
from bushcli.simulate.steps import RECORDED
from cases.march import History, march
from cases.march import Progress as StepProgress
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program, path
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
    six : SixPath or None
        Path of six motions that is prescribed.
    path : SixPath or None
        Path of six motions, prescribed or recorded, that the program follows.
    """

    name: str
    mode: str
    march: Callable[[FiniteElementModel, bool, StepProgress], History]
    program: Program
    time: Array | None
    displacement: Array
    recording: Recording | None = None
    six: SixPath | None = None
    path: SixPath | None = None


def prescribed(case: Case, load: LoadCase, number: int, tables: TableCache) -> SimulatedChannel:
    """Return the channel of a load case.

    Parameters
    ----------
    case : Case
    load : LoadCase
        The load case.
    number : int
        Its number, from 0.
    tables : TableCache
    """
    if load.six is not None:
        program = program_of(load.six, load.steps)
    elif load.source is not None:
        from bushcli.recording import read_program  # with the readers, which few load cases need

        read = read_program(load.source, tables)
        program = Program(read.displacement, read.time)
    else:
        program = path(load.path, load.steps, load.rate)
    return SimulatedChannel(
        load_case_names(case.load_cases, case.recordings)[number],
        load.mode,
        lambda model, keep, report: march(model, program, keep_states=keep, progress=report),
        program,
        program.time,
        program.displacement,
        six=load.six,
        path=load.six,
    )


def recorded(case: Case, recording: Recording) -> SimulatedChannel:
    """Return the channel of a recording.

    Without memory in the rubber, one solve over the range serves every cycle; if the curve is odd, one side of it.

    Parameters
    ----------
    case : Case
    recording : Recording
        The samples in use.
    """
    low, high = min(0.0, float(recording.displacement.min())), max(0.0, float(recording.displacement.max()))
    odd = is_odd(case.geometry, modes()[recording.mode])
    if odd:
        low, high = (0.0, max(high, -low)) if high >= -low else (low, 0.0)
    targets = even_targets(low, high, RECORDED)
    furthest = high if high >= -low else low
    program = Program(np.linspace(0.0, furthest, RECORDED // 2 + 1, dtype=np.float64))
    followed, whole = None, recording.record
    if whole.six is not None:
        followed, program, _ = six_schedule(whole.six.time, whole.six.motion, whole.six.free)
    return SimulatedChannel(
        recording.name,
        recording.mode,
        lambda model, keep, report: sweep(model, targets, keep_states=keep, progress=report),
        program,
        whole.time,
        whole.displacement,
        recording,
        path=followed,
    )
