"""The channels of a case: its material tests, or its recordings and tables of dynamic stiffness."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.errors import InputError, Problem, count_of
from bushcli.faults import bad_samples
from bushcli.inverse.channel import Channel, Corrected, FollowedChannel, SweptChannel
from bushcli.inverse.result import Weighting
from bushcli.recording import Recording, on_branch, read_recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.reaction import Paths, simulation_of_recording
from bushcli.simulate.recording_cache import RecordingCache
from cases.mode import modes
from cases.simulate import Prepare, Rubber, prepare
from geometry.shape import Shape, shapes

if TYPE_CHECKING:
    from bushcli.inverse.dynamic_channel import DynamicChannel
    from bushcli.recording.dynamic.table import DynamicTable

# Samples of a coupon to which a law can be fitted; fewer are no curve.
FEWEST = 3


def curve_channel(
    recording: Recording,
    case: Case,
    rubber: Rubber,
    weighting: Weighting | None,
    comm: MPI.Comm,
    *,
    shape: Shape | None = None,
    prepared: Prepare = prepare,
    paths: Paths | None = None,
    corrected: Corrected | None = None,
    faulty: NDArray[np.bool_] | None = None,
    branch: str = "",
) -> Channel:
    """Return the channel of a recording: of the case's bushing, or of another shape. An effect may require its time."""
    shape, mode, mesh = shape or case.geometry, modes()[recording.mode], case.mesh.refinement
    faulty, paths = bad_samples(recording) if faulty is None else faulty, {} if paths is None else paths
    simulation = simulation_of_recording(recording, case, shape, rubber, mesh, comm, prepared, paths)
    if simulation is None:
        return SweptChannel(recording, prepared(shape, mode, rubber, mesh, comm), weighting, faulty, branch)
    return FollowedChannel(recording, simulation, weighting, faulty, branch, corrected)


def coupon_channels(
    case: Case, rubber: Rubber, weighting: Weighting, measured: RecordingCache | None = None
) -> list[Channel]:
    """Return the channels of the case's coupon tests; every rank of a parallel run solves these small models itself."""
    coupon, tables = shapes()["coupon"](), None if measured is None else measured.tables
    made = partial(
        curve_channel, case=case, rubber=rubber, weighting=weighting, comm=MPI.COMM_SELF, shape=coupon
    )
    channels = []
    for source in case.coupons:
        recording = read_recording(source, tables)
        branch, used = fitted_branch(source, recording)
        channels.append(made(recording, faulty=bad_samples(recording) | ~used, branch=branch))
    return channels


def fitted_branch(source: Source, recording: Recording) -> tuple[str, NDArray[np.bool_]]:
    """Return the branch of a coupon to which a law is fitted, and which samples (n,) belong to it.

    A law has no memory: fitted to loading and unloading it would follow neither, but their mean. The branch is empty
    where the recording has no other. Raises `InputError` where the branch that the case chooses has too few samples.
    """
    all_samples = np.ones(len(recording.displacement), dtype=bool)
    if source.branch == "both":
        return "both", all_samples
    used = on_branch(recording, source.branch or "loading")
    if used.all() or (source.branch is None and np.count_nonzero(used) < FEWEST):
        return "", all_samples
    if np.count_nonzero(used) < FEWEST:
        what = f"has {count_of(np.count_nonzero(used), 'sample')} of {source.branch}"
        expected = f'at least {FEWEST}; branch = "both" takes all samples'
        raise InputError(Problem(str(source.file), what, "", expected))
    return source.branch or "loading", used


def bushing_channels(
    case: Case,
    rubber: Rubber,
    comm: MPI.Comm = MPI.COMM_WORLD,
    prepared: Prepare = prepare,
    measured: RecordingCache | None = None,
    corrected: Corrected | None = None,
) -> list[Channel]:
    """Return the channels of the case's recordings; `prepared` makes their finite-element models."""
    measured = RecordingCache() if measured is None else measured
    made = partial(curve_channel, case=case, rubber=rubber, weighting=None, comm=comm, prepared=prepared)
    recordings, paths = [measured.recording(source) for source in case.recordings], Paths()
    return [
        made(path, paths=paths, corrected=corrected, faulty=bad_samples(path, measured.faults(path)))
        for path in recordings
    ]


def dynamic_channels(
    case: Case, rubber: Rubber, comm: MPI.Comm, tables: TableCache | None = None
) -> list[DynamicChannel]:
    """Return the channels of the bushing's tables of dynamic stiffness."""
    channels = []
    for table in dynamic_tables(case, tables):
        # What few cases need is loaded where one needs it.
        from bushcli.inverse.dynamic_channel import DynamicChannel
        from bushcli.simulate.dynamic_tables import by_temperature

        for rows, temperature in by_temperature(case, table):
            channels.append(DynamicChannel(table.rows(rows), rubber, case, comm, temperature=temperature))
    return channels


def dynamic_tables(case: Case, tables: TableCache | None = None) -> list[DynamicTable]:
    """Return the tables of dynamic stiffness of the bushing."""
    read = []
    for source in case.dynamic:
        if modes()[source.mode].specimen == "bushing":
            from bushcli.recording.dynamic.read import read_dynamic

            read.append(read_dynamic(source, tables))
    return read
