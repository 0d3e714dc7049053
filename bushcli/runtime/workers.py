"""Independent runs in parallel: as many processes as requested, on this machine or over MPI, with results in order.

Fits are saved on disk as soon as they are finished (`store`), so that an interrupted diagnosis can be resumed, with any
number of workers and with the same result.
"""

from __future__ import annotations

import math
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, MutableSequence, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import active_children, get_context
from multiprocessing.sharedctypes import RawArray
from pathlib import Path
from types import FrameType
from typing import Any, cast

from bushcli.runtime.interrupt import abandon_compilation, end_with_parent
from bushcli.runtime.process_cache import with_cache
from bushcli.runtime.store import Store

Work = Callable[..., Any]

# Work whose answers are saved (`store`): fits and derivatives; the rest takes almost no time.
SAVED = frozenset({"first_plain_fit", "fit_plain", "fit", "come_closest", "columns"})
# Questions at most that can be abandoned at once; further ones are answered whatever happens. Judgement: many more than
# processes.
MARKS = 64
# Seconds that a process has to clean up. Afterwards it is killed; every answer is saved before it counts.
GRACE = 2.0


@dataclass(frozen=True)
class Pending:
    """A question whose answer another process prepares, or this one when it is waited for.

    Attributes
    ----------
    answer : callable
        Waits for the answer, and returns it.
    abandon : callable
        Says that nobody waits for the answer. Work that has not begun is cancelled; in processes of our own, work that
        asks (`end_if_abandoned`) ends.
    """

    answer: Callable[[], Any]
    abandon: Callable[[], None]


class Abandoned(Exception):
    """Raised in a worker process to end work whose answer nobody waits for."""


class Workers:
    """Runs functions of module level on lists of arguments.

    Parameters
    ----------
    count
        Number of processes; with 1 everything runs in this one.
    store
        Where results are saved, if at all.
    executor
        Processes that the caller starts and ends (`ranks`), instead of `count` processes of our own. They may be on
        machines that do not see the store.
    cache
        First argument of all work, if given; other processes use one of the same class (`process_cache`).
    """

    def __init__(
        self,
        count: int = 1,
        store: Store | None = None,
        executor: Executor | None = None,
        cache: object | None = None,
    ) -> None:
        self.count, self.store, self._cache = max(1, count), store, cache
        self._executor: Executor | None = executor
        # Marks of questions, not zero of those that are abandoned, and which are free.
        self._marks: MutableSequence[int] = [0] * MARKS
        self._free, self._marking = list(range(MARKS)), threading.Lock()
        self._others = frozenset(active_children())

    @property
    def has_others(self) -> bool:
        """Whether other processes do the work."""
        return self._executor is not None

    @contextmanager
    def open(self) -> Iterator[Workers]:
        """Start the processes, and end them with the context, at once if an exception ends the run."""
        if self.count == 1 or self._executor is not None:
            yield self
            return
        self.start()
        try:
            yield self
        except BaseException:
            self.stop()
            raise
        self.close()

    def start(self) -> Executor:
        """Start the processes, and return their executor; `close` or `stop` ends them."""
        self._marks = RawArray("b", MARKS)
        self._executor = _Processes(
            self.count,
            get_context("spawn"),
            initializer=_begin,
            initargs=(type(self._cache), self._marks),
        )
        for _ in range(self.count):
            # A process starts when work arrives: none is to import its modules when the first work for two is there.
            self._executor.submit(os.getpid)
        return self._executor

    def close(self) -> None:
        """End the processes when they have answered everything."""
        if self._executor is not None:
            self._executor.shutdown()

    def stop(self) -> None:
        """End all processes, whatever they are doing; afterwards nothing can be run."""
        if self._executor is None:
            return
        self._executor.shutdown(wait=False, cancel_futures=True)
        ours = [process for process in active_children() if process not in self._others]
        for process in ours:
            process.terminate()
        for process in ours:
            process.join(GRACE)
            # A compiler that the process has started belongs to its group.
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid or 0, signal.SIGKILL)
            process.kill()
        for process in ours:
            # A killed process remains in the process table until it is joined.
            process.join(GRACE)

    def run(
        self,
        work: Work,
        questions: Sequence[tuple[Any, ...]],
        notify: Callable[[int, Any], None] | None = None,
        deadline: float = math.inf,
    ) -> list[Any]:
        """Return the answers to all questions, in the order of the questions.

        Parameters
        ----------
        work : Work
            Function at module level, so that other processes can import it.
        questions : sequence of tuple
            Arguments of each call, without the cache.
        notify : callable or None
            Called with index and answer as each answer becomes known, unless None.
        deadline : float
            Reading of `time.perf_counter`, s, from which on this process begins no further question after the first:
            the answers are None, without `notify`.
        """
        bound = with_cache(work, self._cache, in_process=self._executor is None)
        answers: list[Any] = [None] * len(questions)
        waiting = []
        for i, question in enumerate(questions):
            file, stored, answer = self._saved(work, question)
            if not stored and self._executor is None and i > 0 and time.perf_counter() > deadline:
                continue
            if stored or self._executor is None:
                answers[i] = answer if stored else _answer(self.store, file, bound, question)
                if notify is not None:
                    notify(i, answers[i])
            else:
                waiting.append((i, self._submit(self._executor, file, bound, question)))
        for i, future in waiting:
            answers[i] = future.result()
            if notify is not None:
                notify(i, answers[i])
        return answers

    def ask(self, work: Work, question: tuple[Any, ...]) -> Pending:
        """Begin one question beside others; this process alone begins when the answer is waited for.

        Parameters
        ----------
        work, question
            As in `run`.
        """
        if self._executor is None:
            return Pending(lambda: self.run(work, [question])[0], lambda: None)
        file, stored, answer = self._saved(work, question)
        if stored:
            return Pending(lambda: answer, lambda: None)
        mark = self._free.pop() if self._free else None
        bound = with_cache(work, self._cache, in_process=False)
        future = self._submit(self._executor, file, bound, question, mark)

        def abandon() -> None:
            future.cancel()
            with self._marking:
                if mark is not None and not future.done():
                    self._marks[mark] = 1

        def release(_: Future[Any]) -> None:
            with self._marking:
                if mark is not None:
                    self._marks[mark] = 0
                    self._free.append(mark)

        future.add_done_callback(release)
        return Pending(future.result, abandon)

    def _submit(
        self,
        executor: Executor,
        file: Path | None,
        work: Work,
        question: tuple[Any, ...],
        mark: int | None = None,
    ) -> Future[Any]:
        if isinstance(executor, ProcessPoolExecutor):
            return executor.submit(_answer, self.store, file, work, question, mark)
        future = executor.submit(_answer, None, None, work, question)
        store = self.store
        if file is not None and store is not None:

            def save(done: Future[Any]) -> None:
                if not done.cancelled() and done.exception() is None:
                    store.write(file, done.result())

            future.add_done_callback(save)
        return future

    def _saved(self, work: Work, question: tuple[Any, ...]) -> tuple[Path | None, bool, Any]:
        """Return the file of an answer that is saved, whether it is there, and the answer."""
        if self.store is None or work.__qualname__ not in SAVED:
            return None, False, None
        file = self.store.file(f"{work.__module__}.{work.__qualname__}", question)
        return file, *self.store.read(file, question)


# Of this process: the marks of all questions, and which is that of the one that it answers.
_marks: Sequence[int] = ()
_mark: int | None = None


def _answer(
    store: Store | None, file: Path | None, work: Work, question: tuple[Any, ...], mark: int | None = None
) -> Any:
    """Do the work and save its answer."""
    global _mark
    _mark = mark
    end_if_abandoned()
    answer = work(*question)
    if file is not None and store is not None:
        store.write(file, answer)
    return answer


def end_if_abandoned(*_: object) -> None:
    """Raise `Abandoned` in a process that answers a question for which nobody waits any more."""
    if _mark is not None and _marks and _marks[_mark]:
        raise Abandoned


@contextmanager
def ranks() -> Iterator[Executor | None]:
    """Yield an executor on the other ranks of `mpirun`; on those ranks themselves yield None.

    The other ranks answer until the first rank leaves the context, and only then leave it too.
    """
    from mpi4py import MPI
    from mpi4py.futures import MPICommExecutor

    with MPICommExecutor(MPI.COMM_WORLD, root=0) as executor:
        yield cast("Executor | None", executor)


# -- a process that works --------------------------------------------------------------------------------------------

_STOPPING = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def _deaf() -> Iterator[None]:
    """Delay Ctrl-C and SIGTERM while processes start, until they can handle them."""
    received: list[int] = []
    # A signal that is blocked in this thread goes to another one, and the interpreter would still raise it here.
    main = threading.current_thread() is threading.main_thread()
    handlers = {
        signum: signal.signal(signum, lambda number, _: received.append(number))
        for signum in _STOPPING
        if main
    }
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _STOPPING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for signum, handler in handlers.items():
            signal.signal(signum, handler or signal.SIG_DFL)
    if received:
        signal.raise_signal(received[0])


class _Processes(ProcessPoolExecutor):
    """A pool whose processes start shielded from Ctrl-C."""

    def submit(self, fn: Work, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hand work to a process."""
        with _deaf():
            return super().submit(fn, *args, **kwargs)


def _begin(kind: type, marks: Sequence[int]) -> None:
    """Prepare a worker process, which ends on SIGTERM and in any case with the process that started it.

    Parameters
    ----------
    kind : type
        Class of the cache: a process that receives it has imported what the work needs.
    marks : sequence of int
        Of questions, not zero of those for which nobody waits.
    """
    global _marks
    _marks = marks

    def end(number: int, frame: FrameType | None) -> None:
        abandon_compilation(frame)
        # No exception is raised: the next question may already be waiting.
        os._exit(1)

    # Ctrl-C goes to all processes of the terminal's group: only the parent handles it.
    os.setpgrp()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A process that received SIGTERM before it was ready ends here.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOPPING)
    signal.signal(signal.SIGTERM, end)
    end_with_parent(lambda: os.killpg(0, signal.SIGKILL))
