"""Several starts: spread about the scale of the curves, the best on a coarse mesh refined on the fine one.

A Latin hypercube or differential evolution spreads them around the scale that the recordings themselves give, not over
bounds of nine decades. Processes share the work. Every start is searched separately, with the same initial set of
watched states and its own record of evaluations, so that neither the number of processes nor their order makes a
difference. The misfit of the first start, which is known before, decides which of the others are hopeless.

References
----------
McKay, Beckman and Conover (1979), Technometrics 21:239-245, doi:10.2307/1268522.
Storn and Price (1997), J. Global Optim. 11:341-359, doi:10.1023/A:1008202821328.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import ChannelForces, FitChannel, StepLimit
from bushcli.inverse.journal import open_journal
from bushcli.inverse.local import Minimum
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem, Progress
from bushcli.inverse.result import Evaluation
from bushcli.inverse.task import Task
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.canonical import canonical
from bushcli.runtime.executor import Died, Pool, processes
from bushcli.runtime.interrupt import unwrapped_interrupts
from bushcli.runtime.process_cache import with_cache

Array = NDArray[np.float64]
Costs = Callable[[Sequence[Array]], list[float]]

# A start is given up if after this many evaluations its misfit (root of the cost) is still this many times that of the
# first start, and the last few evaluations have not halved it.
OUTPERFORMED_AFTER, OUTPERFORMED_RATIO, LAST_FEW = 8, 3.0, 4
# Starts are spread within this factor of the scaled start.
SPREAD = 10.0
# Candidates screened for each start that is refined.
SCREENED = 8
POPULATION, GENERATIONS = 6, 12

INTERRUPTED = "interrupted"


def box(start: Array, bounds: Bounds, shear: float) -> tuple[Array, Array]:
    """Return the box of starts: a factor `SPREAD` about the start, and both signs where the bounds allow them.

    `shear` (MPa) is the scale of a parameter whose start says little because it is near zero.
    """
    size = np.maximum(np.abs(start), 0.01 * shear)
    low = np.where(bounds.lower >= 0, start / SPREAD, -SPREAD * size)
    high = np.where(bounds.lower >= 0, start * SPREAD, SPREAD * size)
    return np.maximum(low, bounds.lower), np.minimum(high, bounds.upper)


def hypercube(count: int, low: Array, high: Array, seed: int) -> Array:
    """Return a Latin hypercube in the box, shape (count, parameters); logarithmic where the box is positive."""
    from scipy.stats import qmc  # 0.3 s: not for commands that only simulate

    unit = qmc.LatinHypercube(len(low), rng=np.random.default_rng(seed)).random(count)
    return from_unit(unit, low, high)


def from_unit(unit: Array, low: Array, high: Array) -> Array:
    """Map points of the unit cube to the box, logarithmically along parameters whose box is positive."""
    safe = np.where(low > 0, low, 1.0)
    ratio = np.where(low > 0, np.maximum(high, safe) / safe, 1.0)
    return np.asarray(np.where(low > 0, safe * ratio**unit, low + unit * (high - low)))


def screen_starts(costs: Costs, count: int, low: Array, high: Array, seed: int) -> list[Array]:
    """Return the `count` points of a larger hypercube that have the lowest cost on the coarse mesh."""
    candidates = list(hypercube(SCREENED * count, low, high, seed))
    screened = costs(candidates)
    order = sorted((cost, i) for i, cost in enumerate(screened) if np.isfinite(cost))
    return [candidates[i] for _, i in order[:count]]


def evolve_start(costs: Costs, low: Array, high: Array, seed: int) -> Array:
    """Return the best point of differential evolution on the coarse mesh; points that cannot be solved always lose.

    Each generation is evaluated as a whole, so that any number of processes can share it without changing the result.
    """
    from scipy.optimize import differential_evolution

    def generation_costs(_: object, units: Iterable[Array]) -> list[float]:
        screened = costs([from_unit(np.asarray(unit), low, high) for unit in units])
        return [cost if np.isfinite(cost) else float("inf") for cost in screened]

    evolved = differential_evolution(
        # `generation_costs` evaluates generations as a whole.
        lambda unit: float("nan"),
        [(0.0, 1.0)] * len(low),
        rng=np.random.default_rng(seed),
        popsize=POPULATION,
        maxiter=GENERATIONS,
        init="latinhypercube",
        polish=False,
        tol=1e-3,
        updating="deferred",
        workers=generation_costs,
    )
    return from_unit(np.asarray(evolved.x), low, high)


# -- refined -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Assignment:
    """A start to be refined, numbered from 1, and what the first search knows: states, limits and its cost."""

    number: int
    point: Array
    states: Array
    limits: tuple[StepLimit, ...]
    reference: float
    # As in `identify`.
    journal: Path | None
    resume: bool | None


@dataclass(frozen=True)
class Refined:
    """Result of a start, with all evaluations, which the caller takes over."""

    minimum: Minimum
    states: Array
    answers: list[ChannelForces] | None
    evaluations: tuple[Evaluation, ...]
    forward_solves: int
    failed_solves: int


class _GivenUp(Exception):
    """Raised to end a search that makes too little progress."""


def refine(
    task: Task,
    channels: list[FitChannel],
    assignment: Assignment,
    progress: Progress | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> Refined:
    """Search from one start."""
    costs: list[float] = []

    def follow(evaluation: Evaluation) -> None:
        if progress is not None:
            progress(evaluation)
        costs.append(evaluation.cost)
        if stopped():
            raise _GivenUp(INTERRUPTED)
        if is_outperformed(costs, assignment.reference):
            raise _GivenUp("given up: the misfit stays far above the first start's")

    journal = None
    if assignment.journal is not None:
        folder = assignment.journal.with_name(f"{assignment.journal.name}-start-{assignment.number}")
        identity = {**task.identity(), "number": assignment.number, "point": assignment.point.tolist()}
        journal = open_journal(folder, identity, None if assignment.resume else assignment.resume)
    problem = task.pose(channels, journal, follow, assignment.states, assignment.number, assignment.limits)
    initial = problem.bounds.inside(assignment.point)
    nowhere = Minimum(initial, initial, float("nan"), 0, False, "the start cannot be solved")
    try:
        with unwrapped_interrupts():
            ended = search(problem, initial, task.loss) if np.isfinite(problem.cost(initial)) else nowhere
    except (_GivenUp, KeyboardInterrupt) as reason:
        cost, x = problem.best or (float("nan"), initial)
        ended = Minimum(initial, x, cost, 0, False, str(reason) or INTERRUPTED)
    answers = problem.answers(ended.x) if np.isfinite(ended.cost) else None
    counts = tuple(problem.evaluations), problem.forward_solves, problem.failed_solves
    return Refined(ended, problem.states, answers, *counts)


def is_outperformed(costs: Sequence[float], reference: float) -> bool:
    """Whether a search with these costs so far should be given up."""
    if len(costs) < OUTPERFORMED_AFTER:
        return False
    best, before = (min(filter(np.isfinite, part), default=np.inf) for part in (costs, costs[:-LAST_FEW]))
    return best == np.inf or (best > OUTPERFORMED_RATIO**2 * reference and best > 0.25 * before)


# -- shared among processes ----------------------------------------------------------------------------------------


class ProblemCache:
    """The problem of one task, coarse or fine, in a process that shares its starts."""

    def __init__(self, tables: TableCache | None = None) -> None:
        self._problems: dict[bytes, LeastSquaresProblem] = {}
        self._tables = TableCache() if tables is None else tables

    def problem(self, task: Task, coarse: bool) -> LeastSquaresProblem:
        """Return the problem of a task; that of another one is discarded."""
        from mpi4py import MPI

        key = canonical((task, coarse))
        if key not in self._problems:
            self._problems.clear()
            self._problems[key] = task.problem(coarse, comm=MPI.COMM_SELF, tables=self._tables)[0]
        return self._problems[key]


@contextmanager
def coarse_costs(task: Task, tables: TableCache, pool: Pool | None = None) -> Iterator[Costs]:
    """Give a function for the costs of many parameter sets on the coarse mesh, by the task's workers or by a pool."""
    with nullcontext(pool) if pool is not None else processes(task.workers) as workers:
        work = partial(_answers_in_order, workers, ProblemCache(tables), _cost_in_worker, task)
        yield lambda points: list(map(float, work(points)))


def refine_start(
    task: Task,
    channels: list[FitChannel],
    assignments: Sequence[Assignment],
    done: Callable[[Refined], None],
    progress: Progress | None,
    pool: Pool | None = None,
) -> None:
    """Refine starts, one by one or shared among workers or a pool; an interrupt comes after `done` has all results."""
    cache = ProblemCache()
    if pool is not None:
        independent = [replace(assignment, journal=None, resume=False) for assignment in assignments]
        for refined in _answers_in_order(pool, cache, _refine_in_worker, task, independent):
            if isinstance(refined, Refined):
                _hand_over(refined, done, progress)
        return
    if task.workers == 1 or len(assignments) < 2:
        for assignment in assignments:
            refined = refine(task, channels, assignment, progress)
            done(refined)
            if refined.minimum.message == INTERRUPTED:
                raise KeyboardInterrupt
        return
    with processes(min(task.workers, len(assignments))) as started, TemporaryDirectory() as folder:
        # Ctrl-C does not reach the processes: a file tells them to end with the best so far.
        stop, work = Path(folder) / "stop", with_cache(_refine_in_worker, cache, in_process=False)
        submit = started.executor.submit
        unfinished = [submit(work, task, i, assignment, stop) for i, assignment in enumerate(assignments)]
        try:
            while unfinished:
                _hand_over(unfinished[0].result(), done, progress)
                unfinished.pop(0)
        except KeyboardInterrupt:
            stop.touch()
            for future in [future for future in unfinished if not future.cancel()]:
                _hand_over(future.result(), done, progress)
            raise


def _answers_in_order(
    pool: Pool, cache: ProblemCache, work: Callable[..., Any], task: Task, arguments: Sequence[Any]
) -> list[Any]:
    """Return the answers in the order of the questions; nan for a question whose process died."""
    answers: dict[int, Any] = {}
    questions = [(task, i, argument) for i, argument in enumerate(arguments)]
    for (_, number, _), answer in pool.answers(work, questions, cache):
        answers[number] = float("nan") if isinstance(answer, Died) else answer
    return [answers[i] for i in range(len(arguments))]


def _cost_in_worker(cache: ProblemCache, task: Task, _: int, x: Array) -> float:
    return cache.problem(task, coarse=True).cost(x)


def _refine_in_worker(
    cache: ProblemCache, task: Task, _: int, assignment: Assignment, stop: Path | None = None
) -> Refined:
    stopped = stop.exists if stop is not None else lambda: False
    return refine(task, cache.problem(task, coarse=False).channels, assignment, None, stopped)


def _hand_over(refined: Refined, done: Callable[[Refined], None], progress: Progress | None) -> None:
    if progress is not None:
        for evaluation in refined.evaluations:
            progress(evaluation)
    done(refined)
