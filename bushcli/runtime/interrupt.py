"""Ctrl-C, SIGTERM and the end of the terminal (SIGHUP): all end a run in the same way, whatever the run is doing.

A signal is raised as an exception wherever the interpreter is. In a callback of PETSc it becomes PETSc's own error,
and a kernel that was being compiled leaves a file whose completion every later run would wait for.

Ranks of `mpirun` that solve one model together must stop together: there a signal is remembered, and all ranks
raise it where they meet. mpirun itself would kill them a quarter of a second after Ctrl-C; the launcher
(setup/venv.sh) sends SIGUSR1 instead, which mpirun passes on to all ranks.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from cases.interrupt import is_interrupt

# Seconds within which a second signal is the same request: a terminal sends Ctrl-C to the command and to the program
# that started it, which passes it on.
SAME = 1.0
_COMPILER = ("compile_forms", "compile_expressions")
# Packages that call Python while their native code is loaded. An exception there ends the process (nanobind's
# python_error has no handler, Open MPI dumps its stack): a signal waits, and is sent again after so many seconds.
_NATIVE = ("basix", "dolfinx", "gmsh", "mpi4py", "petsc4py")
AGAIN = 0.02
_NO_HANDLERS = "-no_signal_handler"

# Signals that were received and not raised yet.
_remembered: list[int] = []
# Not empty while signals are held back.
_holding: list[bool] = []


def listen(clock: Callable[[], float] = time.monotonic, together: bool | None = None) -> None:
    """Raise KeyboardInterrupt on Ctrl-C, SIGTERM and SIGHUP from now on, once for signals that come together.

    Parameters
    ----------
    clock : callable
        Returns the time, s.
    together : bool or None
        Remember the first signal for `meet` instead of raising it; None: if `mpirun` has started several ranks.
    """
    last, several = -SAME, ranks_started() > 1
    waits = several if together is None else together
    _remembered.clear()
    _holding.clear()

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal last
        if clock() - last < SAME:
            return
        if _loads_native_code(frame):
            _send_again(number)
            return
        last = clock()
        if (waits or _holding) and not _remembered:
            _remembered.append(number)
            return
        abandon_compilation(frame)
        raise KeyboardInterrupt

    def once_more() -> None:
        nonlocal last
        last = -math.inf
        _send_again(signal.SIGINT)

    hook = sys.unraisablehook
    sys.unraisablehook = _Dropped(hook.before if isinstance(hook, _Dropped) else hook, once_more)
    for signum in (signal.SIGINT, signal.SIGTERM, *([signal.SIGUSR1] if several else [])):
        signal.signal(signum, interrupt)
    _keep_signals()
    # Under nohup a run goes on when its terminal is closed.
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, interrupt)


def _keep_signals() -> None:
    """Have native libraries leave SIGHUP alone when they are loaded: PETSc would abort on it, and UCX swallow it."""
    options = os.environ.get("PETSC_OPTIONS", "")
    if _NO_HANDLERS not in options.split():
        os.environ["PETSC_OPTIONS"] = f"{options} {_NO_HANDLERS}".strip()
    # UCX, the transport of Open MPI, enters its debug mode on this signal, SIGHUP by default.
    os.environ.setdefault("UCX_DEBUG_SIGNO", "0")


class _Dropped:
    """Hook for exceptions that Python drops, where an object is destroyed or a weak reference dies."""

    def __init__(self, before: Callable[[Any], None], interrupted: Callable[[], None]) -> None:
        self.before, self._interrupted = before, interrupted

    def __call__(self, dropped: Any) -> None:
        if issubclass(dropped.exc_type, KeyboardInterrupt):
            self._interrupted()
        else:
            self.before(dropped)


def _send_again(number: int) -> None:
    """Send a signal to this process after `AGAIN` seconds."""
    timer = threading.Timer(AGAIN, signal.raise_signal, [number])
    timer.daemon = True
    timer.start()


def hold() -> None:
    """Hold the next signal back until `let_go`: what was calculated is written first, which takes a moment.

    A further signal is raised at once. Under `mpirun` nothing is held back, because the ranks stop together.
    """
    if ranks_started() == 1:
        _holding.append(True)


def let_go() -> None:
    """Raise KeyboardInterrupt if a signal has been held back, and hold no more."""
    held = bool(_holding and _remembered)
    _holding.clear()
    if held:
        _remembered.clear()
        raise KeyboardInterrupt


def meet(comm: Any) -> None:
    """Raise KeyboardInterrupt on all ranks if one of them has received a signal; collective.

    Parameters
    ----------
    comm : MPI.Comm
        Ranks that work together. A rank that works alone raises its own signal: mpirun sends it to every rank.
    """
    received = len(_remembered)
    if comm.allreduce(received) if comm.size > 1 else received:
        _remembered.clear()
        raise KeyboardInterrupt


def ranks_started() -> int:
    """Return the number of processes that `mpirun` has started, without loading MPI; 1 without it."""
    for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"):
        if os.environ.get(name, "").isdecimal():
            return int(os.environ[name])
    return 1


def end_with_parent(end: Callable[[], None]) -> None:
    """Call `end` in a thread when the parent of this process has ended, in whatever way."""

    def wait() -> None:
        from multiprocessing import parent_process

        parent = parent_process()
        if parent is not None:
            parent.join()
        end()

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def unwrapped_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt for an interruption, whatever exception it has become inside the block."""
    try:
        yield
    except Exception as error:
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        raise


def abandon_compilation(frame: FrameType | None) -> None:
    """Remove the source of the kernel that is being compiled in this frame or in one that called it.

    FFCx takes a source as the sign of a compilation under way, and removes it on errors, but not on interruptions.
    """
    for caller in _callers(frame):
        if caller.f_code.co_name in _COMPILER and caller.f_globals.get("__name__", "").startswith("ffcx."):
            folder, name = caller.f_locals.get("cache_dir"), caller.f_locals.get("module_name")
            # The source that another process is compiling, while this one waits, is kept.
            waits = any(caller.f_code.co_name == "get_cached_module" for caller in _callers(frame))
            if folder and name and not waits:
                source = Path(folder) / f"{name}.c"
                if not source.with_suffix(".c.cached").exists():
                    with suppress(OSError):
                        source.unlink()


def _loads_native_code(frame: FrameType | None) -> bool:
    """Whether this frame, or one that called it, imports one of `_NATIVE`."""
    return any(
        caller.f_code.co_name == "_find_and_load"
        and "importlib" in caller.f_code.co_filename
        and str(caller.f_locals.get("name", "")).partition(".")[0] in _NATIVE
        for caller in _callers(frame)
    )


def _callers(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
