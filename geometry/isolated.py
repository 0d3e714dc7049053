"""Run functions that read or mesh a file in a process of their own, with limits on time and memory.

On some files Gmsh, OpenCASCADE and the parsers of drawings and meshes loop, take all memory, or end the process. In a
process of its own that becomes a `GeometryError`. One process, the reader, answers all questions of this process, and
its answers (values, without tags of an open Gmsh session) come back as pickles; if a file ends it, the next question
starts another one.
"""

from __future__ import annotations

import atexit
import faulthandler
import importlib
import os
import resource
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from geometry.errors import GeometryError

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")

#: Processor time, s, and bytes of address space for one answer: the largest files that are read at all take 16 s
#: (`geometry.file`); recordings have the same limits. Below, the clock time on a busy machine, as a multiple.
LONGEST, MOST_MEMORY = 60.0, 6_000_000_000
_WAITING = 5.0
#: Elements of a free mesh, as estimated before, that are made in a second at the least. A part with kidney voids on a
#: busy machine: 9,000 in 1.6 s, 120,000 in 6 s, 380,000 in 13 s; a section: 1,000 in 0.1 s. With `LONGEST` the bound
#: is some fifty times as long.
_SLOWEST = 500.0
_ROOT = Path(__file__).resolve().parents[1]
# What an error in a program raises. A damaged file makes our parsers raise errors of values, keys or numbers, and
# libraries anything.
_MISTAKES = (AssertionError, AttributeError, ImportError, NameError, NotImplementedError, TypeError)
#: Remedy for a file that takes too long.
SIMPLER = (
    "a simpler file: without small faces, curves that zigzag, and parts that do not belong to the bushing"
)
_REMEDY = "is the file complete, and does the program that wrote it open it? if so, export it again"


class Mistake(Exception):
    """An error in the reader's own code, which no file is to blame for."""


def isolated(
    failed: str,
    where: Callable[Asked, str | Path],
    seconds: Callable[Asked, float] = lambda *_, **__: LONGEST,
) -> Callable[[Callable[Asked, Answer]], Callable[Asked, Answer]]:
    """Decorate a function of a module so that the reader runs it; arguments and answer are values that can be pickled.

    Parameters
    ----------
    failed : str
        What is said of a file on which the function fails, such as "cannot be read as CAD".
    where : callable
        From the function's arguments: the file, or the key of the case.
    seconds : callable
        From the function's arguments: the processor time that it may take, s.
    """

    def decorate(function: Callable[Asked, Answer]) -> Callable[Asked, Answer]:
        @wraps(function)
        def ask_reader(*args: Asked.args, **kwargs: Asked.kwargs) -> Answer:
            if _reader is None:
                return function(*args, **kwargs)
            place, limit = str(where(*args, **kwargs)), seconds(*args, **kwargs)
            question = (_folder(), function.__module__, function.__qualname__, args, kwargs, limit)
            try:
                answer, error, details = _reader.ask(question, _WAITING * limit)
            except TimeoutError:
                raise GeometryError(place, f"{failed}: {_too_long(limit)}", SIMPLER) from None
            except EOFError:
                code = -_reader.end()
                if code == signal.SIGXCPU:
                    raise GeometryError(place, f"{failed}: {_too_long(limit)}", SIMPLER) from None
                signal_name = signal.Signals(code).name if code > 0 else str(-code)
                raise GeometryError(
                    place, f"{failed}: the program library for it crashes ({signal_name})", _REMEDY
                ) from None
            if isinstance(error, GeometryError):
                raise error
            if isinstance(error, Mistake):
                raise error from RuntimeError(details)
            if error is not None:
                words = " ".join(str(error).split())[:300]
                raise GeometryError(place, f"{failed}: {words}", _REMEDY) from RuntimeError(details)
            return cast("Answer", answer)

        return ask_reader

    return decorate


def _folder() -> Path:
    """Return where relative paths begin now; the root where that folder has been deleted."""
    with suppress(FileNotFoundError):
        return Path.cwd()
    return Path("/")


def seconds_for(cells: float) -> float:
    """Return the processor time that meshing about this many elements may take, s."""
    return LONGEST + cells / _SLOWEST


def _too_long(seconds: float) -> str:
    return f"it takes more than {seconds:.0f} s of processor time"


class _Reader:
    """The process that reads for this one, started by the first question."""

    def __init__(self) -> None:
        self._asks = self._pid = 0
        self._connection: Connection | None = None
        self._lock = threading.Lock()

    def ask(self, question: object, timeout: float) -> tuple[Any, Exception | None, str]:
        """Return the answer, or the error and its traceback; raise EOFError or TimeoutError where there is neither."""
        with self._lock:
            # A copy of this process would share the connection.
            if self._connection is None or self._asks != os.getpid():
                self._connection, self._asks = self._start(), os.getpid()
            try:
                self._connection.send(question)
                if self._connection.poll(timeout):
                    return self._connection.recv()
            except OSError:
                raise EOFError from None
            except KeyboardInterrupt:
                self.end()
                raise
            self.end()
            raise TimeoutError

    def _start(self) -> Connection:
        parent_end, child_end = Pipe()
        if _can_be_copied():
            import gmsh

            with warnings.catch_warnings():
                # Python warns of the copy of a process with threads, MPI's too.
                warnings.simplefilter("ignore", DeprecationWarning)
                self._pid = os.fork()
            if self._pid == 0:
                if gmsh.isInitialized():
                    gmsh.finalize()
                os.dup2(child_end.fileno(), 0)
                parent_end.close()
                serve()
        else:
            # -P, because a file in the user's folder may have the name of a module. The path to the packages is
            # appended for a checkout that is not installed.
            start = f"import sys; sys.path.append({str(_ROOT)!r}); from {__name__} import serve; serve()"
            command = [sys.executable, "-P", "-W", "ignore", "-c", start]
            standard_input = (os.POSIX_SPAWN_DUP2, child_end.fileno(), 0)
            self._pid = os.posix_spawn(sys.executable, command, os.environ, file_actions=[standard_input])
        child_end.close()
        return parent_end

    def end(self) -> int:
        """End the reader, whatever it is doing, and return its exit code: negative for a signal."""
        if self._connection is None or self._asks != os.getpid():
            return 0
        self._connection.close()
        self._connection = None
        # A process that is ending already keeps the exit code that it has.
        os.kill(self._pid, signal.SIGKILL)
        return os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])


def _can_be_copied() -> bool:
    """Whether a copy of this process can be the reader, which takes 0.03 s; a new process takes 0.3 s.

    A copy has none of the threads of its original, but all locks that these held, and MPI's memory for other ranks is
    not to be copied. Linux lists the threads, of libraries too: two are MPI's, which the reader does not use.
    """
    mpi, threads = sys.modules.get("mpi4py.MPI"), Path("/proc/self/task")
    has_few_threads = threads.exists() and len(list(threads.iterdir())) <= (1 if mpi is None else 3)
    return has_few_threads and threading.active_count() == 1 and (mpi is None or mpi.COMM_WORLD.size == 1)


#: None in the reader itself.
_reader: _Reader | None = _Reader()


@atexit.register
def _close() -> None:
    if _reader is not None:
        _reader.end()


def serve() -> None:
    """Answer the questions that come over the standard input, as the reader, until the other process ends."""
    global _reader
    _reader = None
    faulthandler.disable()
    for number in (
        signal.SIGTERM,
        signal.SIGSEGV,
        signal.SIGABRT,
        signal.SIGFPE,
        signal.SIGBUS,
        signal.SIGILL,
    ):
        signal.signal(number, signal.SIG_DFL)
    # The terminal sends Ctrl-C to all processes; the other one ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection(os.dup(0))
    null_device = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(null_device, standard)
    _limit(resource.RLIMIT_AS, MOST_MEMORY)
    _limit(resource.RLIMIT_CORE, 0)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            connection.send(_answer(*connection.recv()))
    os._exit(0)


def _answer(
    folder: Path, module: str, name: str, args: tuple[object, ...], kwargs: dict[str, object], seconds: float
) -> tuple[Any, Exception | None, str]:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    _limit(resource.RLIMIT_CPU, int(usage.ru_utime + usage.ru_stime + seconds) + 1)
    try:
        os.chdir(folder)
        return getattr(importlib.import_module(module), name)(*args, **kwargs), None, ""
    except GeometryError as error:
        return None, error, ""
    except MemoryError:
        return None, RuntimeError(f"it takes more than {MOST_MEMORY / 1e9:g} GB"), traceback.format_exc()
    except Exception as error:  # noqa: BLE001 - a library may raise anything for a damaged file
        # Errors of libraries cannot all be sent.
        text = traceback.format_exc()
        if isinstance(error, _MISTAKES) and _is_ours(error):
            return None, Mistake(f"{type(error).__name__}: {error}"), text
        return None, RuntimeError(str(error) or type(error).__name__), text


def _is_ours(error: Exception) -> bool:
    """Whether an error comes from a module of this project, and not from a library that one calls."""
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    source_file = Path(frame.f_code.co_filename).resolve()
    return source_file.is_relative_to(_ROOT / __package__)


def _limit(kind: int, limit: int) -> None:
    hard_limit = resource.getrlimit(kind)[1]
    resource.setrlimit(
        kind, (limit if hard_limit == resource.RLIM_INFINITY else min(limit, hard_limit), hard_limit)
    )


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)
