"""Where independent work runs: in this process, in processes of this machine, on the ranks of `mpirun`, or by Dask.

All of them are a `concurrent.futures.Executor`, so that code with work to share needs no other interface:

- `processes(n)`: n processes of this machine; with 1, this process itself.
- `bushcli.runtime.workers.ranks()`: the other ranks of `mpirun`.
- `dask(address)`: the workers of a Dask scheduler, on any number of machines. A worker that dies is replaced by the
  others. A SLURM cluster is reached through dask-jobqueue, which starts such workers as jobs.

`answers` feeds an executor with any number of questions, of which only a few wait at a time, and yields the answers
as they become known. A local process that dies takes the pool with it: the pool is started again, and its unanswered
questions are asked again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from typing import Any

from bushcli.errors import InputError, Problem
from bushcli.runtime.extras import remedy
from bushcli.runtime.process_cache import with_cache
from bushcli.runtime.workers import Workers

# Questions that are queued for each worker: enough that no worker waits, few enough that memory stays flat.
AHEAD = 3
# A question is taken to be the cause when a process has died this many times while working on it.
DEATHS = 3
Question = tuple[Any, ...]

# Seconds to wait for a scheduler that does not answer.
PATIENCE = 10.0


class Died(RuntimeError):
    """The process that worked on a question ended, each time it was asked."""


class Here(Executor):
    """An executor that does the work at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return a future that has its result already.

        Parameters
        ----------
        fn : callable
            The work.
        *args, **kwargs : object
            Its arguments.
        """
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - raised where the result is requested
            future.set_exception(error)
        return future


class Pool:
    """An executor with the number of its workers, and with a way to start it again.

    Parameters
    ----------
    executor : Executor
    workers : int
        Number of questions that are worked on at the same time.
    again : callable or None
        Returns another executor when processes of this one have died; None if the executor itself replaces them.
    """

    def __init__(self, executor: Executor, workers: int, again: Callable[[], Executor] | None = None) -> None:
        self.executor, self.workers, self._again = executor, max(1, workers), again

    def answers(
        self, work: Callable[..., Any], questions: Iterable[Question], cache: object | None = None
    ) -> Iterator[tuple[Question, Any]]:
        """Yield each question with its answer, in the order in which answers become known.

        If the process that works on a question has ended `DEATHS` times, an object of type `Died` replaces its answer.

        Parameters
        ----------
        work : callable
            Function at module level, so that other processes can import it.
        questions : iterable of tuple
            Arguments of each call, without the cache; read when they are needed, so that there may be any number of
            them.
        cache : object, optional
            First argument of the work, if given; other processes use one of the same class (`process_cache`).

        Raises
        ------
        Exception
            What the work raises.
        """
        work = with_cache(work, cache, here=isinstance(self.executor, Here))
        following = iter(questions)
        asked: dict[Future[Any], Question] = {}
        suspects: list[tuple[Question, int]] = []
        try:
            while True:
                while not suspects and len(asked) < AHEAD * self.workers:
                    question = next(following, None)
                    if question is None:
                        break
                    asked[self._submitted(work, question)] = question
                if not asked and not suspects:
                    return
                if suspects:
                    # One question at a time: the next death shows which one is the cause.
                    yield self._alone(work, *suspects.pop(0))
                    continue
                done, _ = wait(asked, return_when=FIRST_COMPLETED)
                # In the order of the questions, which a dictionary keeps.
                for future in [one for one in asked if one in done]:
                    if _died(future) and self._again is not None:
                        continue
                    question = asked.pop(future)
                    yield question, Died(str(future.exception())) if _died(future) else future.result()
                if self._again is not None and any(_died(one) for one in done if one in asked):
                    suspects = [(question, 1) for question in asked.values()]
                    asked.clear()
                    self.executor = self._again()
        finally:
            for future in asked:
                future.cancel()

    def _submitted(self, work: Callable[..., Any], question: Question) -> Future[Any]:
        try:
            return self.executor.submit(work, *question)
        except BrokenExecutor as error:
            # A process died between two questions.
            future: Future[Any] = Future()
            future.set_exception(error)
            return future

    def _alone(self, work: Callable[..., Any], question: Question, deaths: int) -> tuple[Question, Any]:
        while deaths < DEATHS:
            future = self._submitted(work, question)
            wait([future])
            if not _died(future):
                return question, future.result()
            deaths += 1
            assert self._again is not None
            self.executor = self._again()
        return question, Died("the process that worked on it ended")


def _died(future: Future[Any]) -> bool:
    """Whether there is no answer because processes ended: `BrokenProcessPool`, or Dask's `KilledWorker`."""
    error = future.exception()
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


@contextmanager
def processes(count: int = 1) -> Iterator[Pool]:
    """Yield processes of this machine, which end with the context, and at once if an exception ends it.

    Parameters
    ----------
    count : int
        Number of processes; with 1, everything runs in this one.
    """
    if count <= 1:
        yield Pool(Here(), 1)
        return
    started: list[Workers] = []

    def start() -> Executor:
        for one in started:
            one.stop()
        started.append(Workers(count))
        return started[-1].start()

    try:
        yield Pool(start(), count, start)
    except BaseException:
        started[-1].stop()
        raise
    started[-1].close()


@contextmanager
def dask(address: str) -> Iterator[Pool]:
    """Yield the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        As the scheduler prints it: "tcp://127.0.0.1:8786"; or the path of a scheduler file.

    Raises
    ------
    InputError
        Dask is not installed, or the scheduler does not answer or has no workers.
    """
    try:
        import distributed
    except ImportError:
        what = "needs Dask, which is not installed"
        raise InputError(Problem("--scheduler", what, "", remedy("study"))) from None
    place = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client: Any = distributed.Client(**place, timeout=PATIENCE, set_as_default=False, name="bushcli")
    except (OSError, ValueError, TypeError) as error:
        what = f"{address} does not answer: {str(error) or type(error).__name__}"
        wanted = "the address that `dask scheduler` prints, such as tcp://127.0.0.1:8786"
        raise InputError(Problem("--scheduler", what, "", wanted)) from None
    try:
        workers = len(client.nthreads())
        if not workers:
            what = f"{address} has no workers"
            raise InputError(
                Problem("--scheduler", what, "", f"start some: dask worker {address} --nthreads 1")
            )
        # Equal arguments must not share an answer: it may be a file that has been deleted since.
        yield Pool(client.get_executor(pure=False), workers)
    finally:
        client.close(timeout=PATIENCE)
