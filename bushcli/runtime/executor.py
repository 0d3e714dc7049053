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

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    InvalidStateError,
    wait,
)
from contextlib import contextmanager, suppress
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

# Seconds to wait for a scheduler that does not answer, and between two questions whether it still does.
TIMEOUT = 10.0
# Seconds without a worker after which the work is given up: arbitrary, long enough to start others.
WORKERLESS = 300.0


class Died(RuntimeError):
    """The process that worked on a question ended, each time it was asked."""


class SchedulerLost(InputError):
    """The scheduler that hands out the work has ended, does not answer, or has no workers left."""


class Here(Executor):
    """An executor that does the work at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return a future that has its result already."""
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
        work = with_cache(work, cache, in_process=isinstance(self.executor, Here))
        following = iter(questions)
        running: dict[Future[Any], Question] = {}
        suspects: list[tuple[Question, int]] = []
        try:
            while True:
                while not suspects and len(running) < AHEAD * self.workers:
                    question = next(following, None)
                    if question is None:
                        break
                    running[self._submit(work, question)] = question
                if not running and not suspects:
                    return
                if suspects:
                    # One question at a time: the next death shows which one is the cause.
                    yield self._alone(work, *suspects.pop(0))
                    continue
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                # In the order of the questions, which a dictionary keeps.
                for future in [candidate for candidate in running if candidate in done]:
                    if _has_died(future) and self._again is not None:
                        continue
                    question = running.pop(future)
                    yield question, Died(str(future.exception())) if _has_died(future) else future.result()
                if self._again is not None and any(_has_died(ended) for ended in done if ended in running):
                    suspects = [(question, 1) for question in running.values()]
                    running.clear()
                    self.executor = self._again()
        finally:
            for future in running:
                future.cancel()

    def _submit(self, work: Callable[..., Any], question: Question) -> Future[Any]:
        try:
            return self.executor.submit(work, *question)
        except BrokenExecutor as error:
            # A process died between two questions.
            future: Future[Any] = Future()
            future.set_exception(error)
            return future

    def _alone(self, work: Callable[..., Any], question: Question, deaths: int) -> tuple[Question, Any]:
        while deaths < DEATHS:
            future = self._submit(work, question)
            wait([future])
            if not _has_died(future):
                return question, future.result()
            deaths += 1
            assert self._again is not None
            self.executor = self._again()
        return question, Died("the process that worked on it ended")


def _has_died(future: Future[Any]) -> bool:
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
        for executor in started:
            executor.stop()
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
    # It would print tracebacks where a connection ends.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    place = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    client: Any = None
    try:
        settings = {**place, "timeout": TIMEOUT, "set_as_default": False, "name": "bushcli"}
        client = _connect(lambda: distributed.Client(**settings))
        workers = len(client.sync(client.scheduler.ncores, callback_timeout=TIMEOUT))
    except (OSError, ValueError, TypeError, TimeoutError) as error:
        _close(client, 1.0)
        what = f"{address} does not answer: {str(error) or type(error).__name__}"
        wanted = "the address that `dask scheduler` prints, such as tcp://127.0.0.1:8786"
        raise InputError(Problem("--scheduler", what, "", wanted)) from None
    watched = None
    try:
        if not workers:
            wanted = f"start some: dask worker {address} --nthreads 1"
            raise InputError(Problem("--scheduler", f"{address} has no workers", "", wanted))
        # Equal arguments must not share an answer: it may be a file that has been deleted since.
        watched = _Watched(client, client.get_executor(pure=False), address)
        yield Pool(watched, workers)
    finally:
        _close(client, 1.0 if watched is not None and watched.lost else TIMEOUT)


def _connect(connect: Callable[[], Any]) -> Any:
    """Return a client of Dask, whose own limit of time does not hold where a port accepts and never answers."""
    connection: Future[Any] = Future()

    def work() -> None:
        try:
            connection.set_result(connect())
        except Exception as error:  # noqa: BLE001 - raised where the client is wanted
            connection.set_exception(error)

    threading.Thread(target=work, daemon=True).start()
    try:
        return connection.result(timeout=1.5 * TIMEOUT)
    except TimeoutError as error:
        raise TimeoutError(str(error) or f"no answer within {1.5 * TIMEOUT:g} s") from None


def _close(client: Any, seconds: float) -> None:
    """Close a client of Dask, if there is one; a scheduler that does not answer any more is given some seconds."""
    if client is not None:
        with suppress(OSError, TimeoutError):
            client.close(timeout=seconds)


class _Watched(Executor):
    """The executor of a Dask client, whose futures end in `SchedulerLost` when the scheduler is lost."""

    def __init__(self, client: Any, executor: Executor, address: str) -> None:
        self.lost = ""
        self._client, self._executor, self._address = client, executor, address
        self._waiting: set[Future[Any]] = set()
        self._lock, self._begin_without = threading.Lock(), math.inf
        threading.Thread(target=self._watch, daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hand work to the scheduler."""
        future: Future[Any] = Future()
        with self._lock:
            self._waiting.add(future)
        if self.lost:
            self._end()
            return future
        try:
            remote = self._executor.submit(fn, *args, **kwargs)
        except Exception as error:
            if not _is_of_connection(error):
                raise
            self._lose(str(error) or "the connection is closed")
            return future
        remote.add_done_callback(lambda done: self._hand_over(done, future))
        future.add_done_callback(lambda done: remote.cancel() if done.cancelled() else None)
        return future

    def _hand_over(self, done: Future[Any], future: Future[Any]) -> None:
        error = None if done.cancelled() else done.exception()
        if (done.cancelled() and not future.cancelled()) or (error is not None and _is_of_connection(error)):
            self._lose("it has ended, or its connection was cut")
            return
        with self._lock:
            self._waiting.discard(future)
        with suppress(InvalidStateError):
            if error is not None:
                future.set_exception(error)
            elif not done.cancelled():
                future.set_result(done.result())

    def _watch(self) -> None:
        """Check from time to time that the scheduler answers and has workers."""
        while not self.lost and self._client.status not in ("closing", "closed"):
            time.sleep(TIMEOUT / 2.0)
            try:
                cores = self._client.sync(self._client.scheduler.ncores, callback_timeout=TIMEOUT)
            except Exception as error:  # noqa: BLE001 - of whatever kind: it does not answer
                if self._client.status not in ("closing", "closed"):
                    self._lose(f"it does not answer ({str(error) or type(error).__name__})")
                continue
            self._begin_without = math.inf if cores else min(self._begin_without, time.monotonic())
            if time.monotonic() - self._begin_without > WORKERLESS:
                self._lose(f"it has had no workers for {WORKERLESS:.0f} s")

    def _lose(self, why: str) -> None:
        self.lost = self.lost or why
        self._end()

    def _end(self) -> None:
        with self._lock:
            ended, self._waiting = self._waiting, set()
        for future in ended:
            what = f"the scheduler {self._address} is lost: {self.lost}"
            with suppress(InvalidStateError):
                future.set_exception(SchedulerLost(Problem("--scheduler", what)))


def _is_of_connection(error: BaseException) -> bool:
    """Whether an error says that the connection to the scheduler is lost: distributed has several types for it."""
    return isinstance(error, CancelledError | OSError) or type(error).__name__ in (
        "CommClosedError",
        "FutureCancelledError",
        "FuturesCancelledError",
        "ClosedClientError",
    )
