"""Recordings compared with their curves, before and after an identification."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.curve.misfit import rms_percent
from bushcli.inverse.certainty import uncertainty
from bushcli.inverse.channel import Channel, ChannelForces
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.result import FittedCurve
from bushcli.runtime.condition import Condition
from bushcli.simulate.dynamic_tables import ComparedTable
from cases.march import NotConverged

if TYPE_CHECKING:
    from bushcli.inverse.dynamic_channel import DynamicChannel

Array = NDArray[np.float64]


def compared_curves(
    problem: LeastSquaresProblem, channels: Sequence[Channel], x: Array, start: Array
) -> tuple[FittedCurve, ...]:
    """Return each channel's recording with its curve at `x`, and at `start` where that has been solved.

    Channels held out are predicted; one that cannot be solved at `x` is left out.
    """
    # The search has solved both points already: nothing is solved again for the fitted channels.
    after = problem.answers(x)
    before = problem.answers(start) if problem.knows(start) else None
    curves = []
    for channel in channels:
        if channel in problem.channels:
            i = problem.channels.index(channel)
            if after is not None:
                curves.append(_compared(channel, after[i], before[i] if before else None, held_out=False))
            continue
        with suppress(NotConverged):
            answer = channel.solve(problem.parameters(x), problem.names)
            curves.append(_compared(channel, answer, None, held_out=True))
    return tuple(curves)


def compared_tables(
    problem: LeastSquaresProblem, channels: Sequence[DynamicChannel], x: Array, start: Array
) -> tuple[tuple[ComparedTable, ...], tuple[Condition, ...]]:
    """Return each table of dynamic stiffness beside the simulation at `x`, and what has to be known about it.

    With the intervals of the simulation, and K* at `start` where that has been solved. What cannot be solved is left
    out.
    """
    tables: list[ComparedTable] = []
    conditions: list[Condition] = []
    before = problem.answers(start) if problem.knows(start) else None
    deviations = uncertainty(problem, x).deviations if channels else None
    for channel in channels:
        fitted = channel in problem.channels
        try:
            table = channel.compared(problem.parameters(x), problem.names, deviations)
            conditions += channel.conditions(problem.parameters(x))
        except NotConverged:
            continue
        if before and fitted:
            table = replace(table, started=channel.simulated(before[problem.channels.index(channel)]))
        tables.append(replace(table, held_out=not fitted))
    return tuple(tables), tuple(conditions)


def _compared(
    channel: Channel, answer: ChannelForces, started: ChannelForces | None, held_out: bool
) -> FittedCurve:
    recording = channel.recording
    # Bad samples, which the fit leaves out, say nothing about it.
    used = np.isfinite(channel.scale)
    measured = recording.force[used]

    def curve(solved: ChannelForces) -> tuple[Curve, float]:
        force, _ = channel.at_samples(solved)
        rms = rms_percent(force[used] - measured, measured)
        return Curve(recording.mode, recording.displacement, force, recording.time), rms

    fitted, rms = curve(answer)
    first, first_rms = curve(started) if started is not None else (None, float("nan"))
    return FittedCurve(
        name=channel.name,
        recording=recording,
        fitted=fitted,
        rms_percent=rms,
        started=first,
        started_percent=first_rms,
        noise_percent=100 * channel.noise / float(np.ptp(measured)),
        held_out=held_out,
        smooth=channel.curve(answer),
        branch=channel.branch,
        samples=int(np.count_nonzero(used)),
    )
