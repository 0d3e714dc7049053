"""Identify a law's parameters from measured curves: start, search, certainty, verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.casefile import Case, Material
from bushcli.curve import Curve
from bushcli.effect import full_name
from bushcli.errors import InputError
from bushcli.errors import Problem as Finding
from bushcli.inverse import certainty, starts
from bushcli.inverse.begin import first_point
from bushcli.inverse.channel import Answer, Channel
from bushcli.inverse.dogleg import minimise_by_dogleg
from bushcli.inverse.journal import Journal
from bushcli.inverse.local import Minimum, inside
from bushcli.inverse.problem import Problem, Progress
from bushcli.inverse.result import EndPoint, Estimate, Fit, FittedCurve, Weighting
from bushcli.inverse.search import search
from bushcli.inverse.task import Task
from bushcli.inverse.verdict import conditions
from cases.march import NotConverged
from cases.stability import coupon_limits

Array = NDArray[np.float64]

# A bound counts as reached within this share of the parameter's size.
AT_BOUND = 1e-6


def fit_coupons(
    case: Case,
    model: str | None = None,
    *,
    weighting: Weighting = "relative",
    progress: Progress | None = None,
) -> Fit:
    """Identify a law on all coupon tests of a case together.

    Parameters
    ----------
    case
        Its coupons are read; its material gives the law, the bulk modulus and, where present, the start values.
    model
        Law to use instead of the case's.
    weighting
        "relative": the misfit in stress over the stress itself, which serves the moderate strains of a bushing;
        "absolute": over the coupon's largest stress.
    progress
        Called after each evaluation.

    Raises
    ------
    InputError
        The case has no coupons, one cannot be read, or the start cannot be solved.
    """
    task = Task(case, model or case.material.law, "coupons", weighting=weighting)
    return identify(task, progress=progress)


def identify(
    task: Task, *, journal: Path | None = None, resume: bool = False, progress: Progress | None = None
) -> Fit:
    """Identify a law's parameters from the recordings or the coupons of a case.

    Parameters
    ----------
    task
        What is identified from what, and how.
    journal
        File in which every evaluation is kept.
    resume
        Go on with the evaluations that the journal holds.
    progress
        Called after each evaluation.

    Returns
    -------
    Fit
        Also when the search is interrupted (KeyboardInterrupt): the best so far, with a condition that says so.

    Raises
    ------
    InputError
        A file cannot be read, an option makes no sense, or the start cannot be solved at all.
    """
    begin = time.perf_counter()
    # Reading the law first: a wrong name must not cost a mesh.
    start, lower, upper = (task.law, task.vectors())[1]
    kept = Journal(journal, task.identity(), resume) if journal is not None else None
    problem, held_out = task.problem(journal=kept, progress=progress)
    interrupted = False
    minima: list[Minimum] = []
    try:
        begun = start if task.method == "dogleg" else first_point(problem, start, lower, upper)
        if not np.isfinite(problem.residual(begun)).all():
            tried = ", ".join(f"{name} = {value:g}" for name, value in zip(task.names, begun, strict=True))
            raise InputError(
                Finding(
                    task.case.path.name,
                    f"{task.model} cannot be solved on these curves from {tried}",
                    "",
                    "other start values in [material.parameters]",
                )
            )
        if task.method != "dogleg":
            problem.watch(begun)
        for point in (begun, *_further_starts(task, problem, begun, lower, upper)):
            minima.append(_search(task, problem, point, lower, upper))
    except KeyboardInterrupt:
        interrupted = True
        if problem.best is None:
            raise
        cost, x = problem.best
        minima.append(Minimum(start, x, cost, 0, False, "interrupted"))
    minima = [m for m in minima if np.isfinite(m.cost)] or minima
    best = min(minima, key=lambda m: m.cost)
    return _result(task, problem, held_out, best, minima, start, lower, upper, interrupted, begin)


def _search(task: Task, problem: Problem, point: Array, lower: Array, upper: Array) -> Minimum:
    if task.method == "dogleg":
        return minimise_by_dogleg(problem, point)
    return search(problem, point, lower, upper, task.method, task.loss)


def _further_starts(task: Task, problem: Problem, begun: Array, lower: Array, upper: Array) -> list[Array]:
    """More starts, found on a coarse mesh; none where one start is asked for."""
    if task.starts <= 1 and not task.globally:
        return []
    shear = task.law.shear_modulus(**problem.law_parameters(begun))
    low, high = starts.box(begun, lower, upper, abs(shear))
    found: list[Array] = []
    if task.globally:
        coarse, _ = task.problem(coarse=True)
        found.append(starts.evolved(coarse, low, high, task.seed))
    if task.starts > 1:
        with _coarse_costs(task) as costs:
            found += starts.screened(costs, task.starts - 1, low, high, task.seed)
    return [inside(x, lower, upper) for x in found if np.isfinite(problem.cost(inside(x, lower, upper)))]


@contextmanager
def _coarse_costs(task: Task) -> Iterator[Callable[[Sequence[Array]], list[float]]]:
    """Cost of many parameter sets on the coarse mesh, by as many processes as the task has workers."""
    if task.workers == 1:
        coarse, _ = task.problem(coarse=True)
        yield lambda points: [coarse.cost(x) for x in points]
        return
    with starts.pool(task.workers, _begin_worker, (task,)) as executor:
        yield lambda points: list(executor.map(_worker_cost, points))


_worker: list[Problem] = []


def _begin_worker(task: Task) -> None:
    from mpi4py import MPI

    _worker[:] = [task.problem(coarse=True, comm=MPI.COMM_SELF)[0]]


def _worker_cost(x: Array) -> float:
    return _worker[0].cost(x)


def _result(
    task: Task,
    problem: Problem,
    held_out: list[Channel],
    best: Minimum,
    minima: list[Minimum],
    start: Array,
    lower: Array,
    upper: Array,
    interrupted: bool,
    begin: float,
) -> Fit:
    x = best.x
    searched = problem.sweeps, problem.forward_solves, problem.failed_solves
    problem.stage = "profile"
    spread = np.sqrt(np.maximum(np.diag(covariance := certainty.covariance(problem, x)), 0.0))
    singular, undetermined = certainty.directions(problem, x)
    profiles = []
    if not interrupted and task.source == "recordings" and task.method != "dogleg":
        for i, name in enumerate(task.names):
            poor = spread[i] > certainty.POOR * abs(x[i])
            if poor and len(x) > 1 and name != "compliance":
                profiles.append(certainty.profile(problem, x, i, float(spread[i]), lower, upper))
    intervals = {found.name: certainty.interval(found) for found in profiles}
    estimates = {
        name: Estimate(
            float(x[i]),
            float(spread[i]),
            float(lower[i]),
            float(upper[i]),
            _at_bound(float(x[i]), float(lower[i]), float(upper[i])),
            intervals.get(name),
        )
        for i, name in enumerate(task.names)
    }
    everything = problem.parameters(x)
    values = problem.law_parameters(x)
    compliance = everything.get("compliance")
    bulk = task.material.bulk_modulus
    if compliance is not None:
        bulk = 1.0 / compliance if compliance > 0 else float("inf")
    material = Material(task.model, bulk, values, task.material.terms)
    fit = Fit(
        material=material,
        parameters=estimates,
        correlation=covariance / np.maximum(np.outer(spread, spread), 1e-300),
        curves=_curves(task, problem, held_out, x, start),
        stability=coupon_limits(task.law, values),
        weighting=task.weighting,
        forward_solves=searched[1],
        sweeps=searched[0],
        failed_solves=searched[2],
        profile_sweeps=problem.sweeps - searched[0],
        iterations=best.iterations,
        converged=best.converged and not interrupted,
        singular_values=singular,
        undetermined=undetermined,
        seconds=time.perf_counter() - begin,
        conditions=(),
        method=task.method,
        message=best.message,
        cost=best.cost,
        evaluations=tuple(problem.evaluations),
        end_points=_end_points(task, minima),
        profiles=tuple(profiles),
        leverage=certainty.leverage(problem, x),
        effects=tuple(
            replace(
                one,
                values={p.name: everything[full_name(one.effect, p)] for p in one.parameters},
            )
            for one in task.effects
        ),
    )
    return replace(fit, conditions=conditions(fit, task, best, interrupted))


def _end_points(task: Task, minima: list[Minimum]) -> tuple[EndPoint, ...]:
    named = [
        EndPoint(
            dict(zip(task.names, map(float, m.start), strict=True)),
            dict(zip(task.names, map(float, m.x), strict=True)),
            m.cost,
            m.message,
        )
        for m in minima
    ]
    return tuple(sorted(named, key=lambda end: end.cost))


def _curves(
    task: Task, problem: Problem, held_out: list[Channel], x: Array, start: Array
) -> tuple[FittedCurve, ...]:
    # The search has solved both points already: nothing is solved again for the fitted channels.
    after = problem.answers(x)
    before = problem.answers(start) if problem.knows(start) else None
    found = []
    for i, channel in enumerate(problem.channels):
        if after is not None:
            found.append(_compared(channel, after[i], before[i] if before else None, held_out=False))
    for channel in held_out:
        try:
            answer = channel.solve(problem.parameters(x), task.names)
        except NotConverged:
            continue
        found.append(_compared(channel, answer, None, held_out=True))
    return tuple(found)


def _compared(channel: Channel, answer: Answer, started: Answer | None, held_out: bool) -> FittedCurve:
    recording = channel.recording
    span = float(np.ptp(recording.force))

    def curve(solved: Answer) -> tuple[Curve, float]:
        force, _ = channel.at_samples(solved)
        rms = 100 * float(np.sqrt(np.mean((force - recording.force) ** 2))) / span
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
        noise_percent=100 * channel.noise / span,
        held_out=held_out,
        smooth=channel.curve(answer),
    )


def _at_bound(value: float, lower: float, upper: float) -> bool:
    return bool(min(value - lower, upper - value) <= AT_BOUND * max(abs(value), 1e-3))
