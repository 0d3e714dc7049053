"""Parts of a result: parameters with their uncertainty, rubber and effects, ends of searches, curves and tables."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Material
from bushcli.case.case import DENSITY
from bushcli.curve.curve import Curve
from bushcli.curve.misfit import rms_percent
from bushcli.inverse.certainty import Uncertainty
from bushcli.inverse.channel import Channel, ChannelForces
from bushcli.inverse.local import Minimum
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.profile import interval
from bushcli.inverse.result import EndPoint, Estimate, FittedCurve, Profile
from bushcli.inverse.task import Task
from bushcli.runtime.condition import Condition
from bushcli.simulate.dynamic_tables import ComparedTable
from cases.march import NotConverged

if TYPE_CHECKING:
    from bushcli.inverse.dynamic_channel import DynamicChannel

Array = NDArray[np.float64]

# A bound counts as reached within this share of the parameter's size.
AT_BOUND = 1e-6


def estimates(
    task: Task,
    problem: LeastSquaresProblem,
    x: Array,
    uncertainty: Uncertainty,
    profiles: Sequence[Profile],
) -> tuple[dict[str, Estimate], Array]:
    """Return each parameter with its uncertainty, and their correlation, shape (parameters, parameters)."""
    covariance = uncertainty.covariance
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    intervals = {profile.name: interval(profile) for profile in profiles}
    limits = {profile.name: profile.limits for profile in profiles}
    logarithmic = np.broadcast_to(problem.bounds.logarithmic, x.shape)
    amplitudes = {active.full_name(p) for active in task.effects for p in active.parameters}
    by_name = {}
    for i, name in enumerate(task.names):
        value, lower, upper = float(x[i]), float(problem.bounds.lower[i]), float(problem.bounds.upper[i])
        by_name[name] = Estimate(
            value,
            float(spread[i]),
            lower,
            upper,
            min(value - lower, upper - value) <= AT_BOUND * max(abs(value), 1e-3),
            intervals.get(name),
            limits.get(name, ("misfit", "misfit")),
            uncertainty.quantile,
            "logarithm" if logarithmic[i] else "effect" if name in amplitudes else "straight",
        )
    # A parameter that the curves leave open has no correlation.
    scale = np.where(np.isfinite(spread), np.maximum(spread, 1e-150), 1.0)
    return by_name, np.where(np.isfinite(covariance), covariance, 0.0) / np.outer(scale, scale)


def material(task: Task, problem: LeastSquaresProblem, x: Array) -> Material:
    """Return the identified rubber."""
    bulk, compliance = task.material.bulk_modulus, problem.parameters(x).get("compliance")
    if compliance is not None:
        bulk = 1.0 / compliance if compliance > 0 else float("inf")
    density = DENSITY * problem.parameters(x).get("density", task.material.density / DENSITY)
    return replace(task.material, bulk_modulus=bulk, parameters=problem.law_parameters(x), density=density)


def end_points(task: Task, minima: Sequence[Minimum]) -> tuple[EndPoint, ...]:
    """Return where each search began and ended, the one with the smallest misfit first."""

    def named(x: Array) -> dict[str, float]:
        return dict(zip(task.names, map(float, x), strict=True))

    ends = [EndPoint(named(m.start), named(m.x), m.cost, m.message) for m in minima]
    return tuple(sorted(ends, key=lambda end: end.cost))


def compared_curves(
    problem: LeastSquaresProblem, channels: Sequence[Channel], x: Array, start: Array
) -> tuple[FittedCurve, ...]:
    """Return each channel's recording with its curve at `x`, and at `start` where that has been solved.

    Channels held out are predicted; one that cannot be solved at `x` is left out.
    """
    # The search has solved both points already: nothing is solved again for the fitted channels.
    after, before = problem.answers(x), problem.known_answers(start)
    curves = []
    for channel in channels:
        if channel in problem.channels:
            i = problem.channels.index(channel)
            if after is not None:
                curves.append(_fitted_curve(channel, after[i], before[i] if before else None, held_out=False))
            continue
        with suppress(NotConverged):
            answer = channel.solve(problem.parameters(x), problem.names)
            curves.append(_fitted_curve(channel, answer, None, held_out=True))
    return tuple(curves)


def compared_tables(
    problem: LeastSquaresProblem,
    channels: Sequence[DynamicChannel],
    x: Array,
    start: Array,
    deviations: Array | None,
) -> tuple[tuple[ComparedTable, ...], tuple[Condition, ...]]:
    """Return each table of dynamic stiffness beside the simulation at `x`, and what has to be known about it.

    With the intervals of the simulation by the deviations of the parameters (`certainty`), and K* at `start` where that
    has been solved. What cannot be solved is left out.
    """
    tables: list[ComparedTable] = []
    conditions: list[Condition] = []
    before = problem.known_answers(start)
    for channel in channels:
        fitted = channel in problem.channels
        try:
            table = channel.compared_table(problem.parameters(x), problem.names, deviations)
            conditions += channel.conditions(problem.parameters(x))
        except NotConverged:
            continue
        started = None
        if before and fitted:
            started = channel.simulated_stiffness(before[problem.channels.index(channel)])
        tables.append(replace(table, started=started, held_out=not fitted))
    return tuple(tables), tuple(conditions)


def _fitted_curve(
    channel: Channel, answer: ChannelForces, started: ChannelForces | None, held_out: bool
) -> FittedCurve:
    recording = channel.recording
    # Bad samples, which the fit leaves out, say nothing about it.
    used = np.isfinite(channel.scale)
    measured = recording.force[used]

    def curve(answer: ChannelForces) -> tuple[Curve, float]:
        force, _ = channel.at_samples(answer)
        rms = rms_percent(force[used] - measured, measured)
        return Curve(recording.mode, recording.displacement, force, recording.time), rms

    fitted, rms = curve(answer)
    before, rms_before = curve(started) if started is not None else (None, float("nan"))
    return FittedCurve(
        channel.name,
        recording,
        fitted,
        rms,
        started=before,
        started_percent=rms_before,
        noise_percent=100 * channel.noise / float(np.ptp(measured)),
        held_out=held_out,
        smooth=channel.curve(answer),
        branch=channel.branch,
        samples=int(np.count_nonzero(used)),
    )
