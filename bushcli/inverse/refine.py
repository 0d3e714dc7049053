"""Further starts: found on a coarse mesh, refined on the fine one, shared among processes.

Every start is searched separately, with the same initial set of watched states and its own record of evaluations, so
that neither the number of processes nor their order makes a difference. The misfit of the first start, which is known
before, decides which of the others are hopeless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

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

# A start is given up if after this many evaluations its misfit (root of the cost) is still this many times that of the
# first start, and the last few evaluations have not halved it.
OUTPERFORMED_AFTER, OUTPERFORMED_RATIO, LAST_FEW = 8, 3.0, 4

INTERRUPTED = "interrupted"


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
    given: Assignment,
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
        if is_outperformed(costs, given.reference):
            raise _GivenUp("given up: the misfit stays far above the first start's")

    journal = None
    if given.journal is not None:
        folder = given.journal.with_name(f"{given.journal.name}-start-{given.number}")
        identity = {**task.identity(), "number": given.number, "point": given.point.tolist()}
        journal = open_journal(folder, identity, None if given.resume else given.resume)
    problem = task.pose(channels, journal, follow, given.states, given.number, given.limits)
    initial = problem.bounds.inside(given.point)
    nowhere = Minimum(initial, initial, float("nan"), 0, False, "the start cannot be solved")
    try:
        with unwrapped_interrupts():
            ended = search(problem, initial, task.loss) if np.isfinite(problem.cost(initial)) else nowhere
    except (_GivenUp, KeyboardInterrupt) as reason:
        cost, x = problem.best or (float("nan"), initial)
        ended = Minimum(initial, x, cost, 0, False, str(reason) or INTERRUPTED)
    answers = problem.answers(ended.x) if np.isfinite(ended.cost) else None
    return Refined(
        ended,
        problem.states,
        answers,
        tuple(problem.evaluations),
        problem.forward_solves,
        problem.failed_solves,
    )


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
def coarse_costs(
    task: Task, tables: TableCache, pool: Pool | None = None
) -> Iterator[Callable[[Sequence[Array]], list[float]]]:
    """Give a function for the costs of many parameter sets on the coarse mesh, by the task's workers or by a pool."""
    with nullcontext(pool) if pool is not None else processes(task.workers) as chosen:
        cache = ProblemCache(tables)
        yield lambda points: [float(cost) for cost in _asked(chosen, cache, _cost_there, task, points)]


def refine_start(
    task: Task,
    channels: list[FitChannel],
    given: Sequence[Assignment],
    done: Callable[[Refined], None],
    progress: Progress | None,
    pool: Pool | None = None,
) -> None:
    """Refine starts, one by one or shared among workers or a pool; an interrupt comes after `done` has all results."""
    cache = ProblemCache()
    if pool is not None:
        alone = [replace(assignment, journal=None, resume=False) for assignment in given]
        for refined in _asked(pool, cache, _refined_there, task, alone):
            if isinstance(refined, Refined):
                _hand_over(refined, done, progress)
        return
    if task.workers == 1 or len(given) < 2:
        for assignment in given:
            refined = refine(task, channels, assignment, progress)
            done(refined)
            if refined.minimum.message == INTERRUPTED:
                raise KeyboardInterrupt
        return
    with processes(min(task.workers, len(given))) as own, TemporaryDirectory() as folder:
        # Ctrl-C does not reach the processes: a file tells them to end with the best so far.
        stop, work = Path(folder) / "stop", with_cache(_refined_there, cache, here=False)
        futures = [own.executor.submit(work, task, i, assignment, stop) for i, assignment in enumerate(given)]
        left = list(futures)
        try:
            while left:
                _hand_over(left[0].result(), done, progress)
                left.pop(0)
        except KeyboardInterrupt:
            stop.touch()
            for future in left:
                future.cancel()
            for future in left:
                if not future.cancelled():
                    _hand_over(future.result(), done, progress)
            raise


def _asked(
    pool: Pool, cache: ProblemCache, work: Callable[..., Any], task: Task, given: Sequence[Any]
) -> list[Any]:
    """Return the answers in the order of the questions; nan for a question whose process died."""
    answers: dict[int, Any] = {}
    questions = [(task, i, argument) for i, argument in enumerate(given)]
    for (_, number, _), answer in pool.answers(work, questions, cache):
        answers[number] = float("nan") if isinstance(answer, Died) else answer
    return [answers[i] for i in range(len(given))]


def _cost_there(cache: ProblemCache, task: Task, _: int, x: Array) -> float:
    return cache.problem(task, coarse=True).cost(x)


def _refined_there(
    cache: ProblemCache, task: Task, _: int, given: Assignment, stop: Path | None = None
) -> Refined:
    stopped = stop.exists if stop is not None else lambda: False
    return refine(task, cache.problem(task, coarse=False).channels, given, None, stopped)


def _hand_over(refined: Refined, done: Callable[[Refined], None], progress: Progress | None) -> None:
    if progress is not None:
        for evaluation in refined.evaluations:
            progress(evaluation)
    done(refined)
