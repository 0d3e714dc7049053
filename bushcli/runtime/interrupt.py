"""Ctrl-C and SIGTERM: both end a run in the same way, whatever the run is doing.

A signal is raised as an exception wherever the interpreter is. In a callback of PETSc it comes out as PETSc's own
error, and a kernel that was being compiled leaves a file for whose end every later run would wait.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import FrameType

# Seconds within which a second signal is the same request: a terminal sends Ctrl-C to the command and to what it was
# started by, which passes it on.
SAME = 1.0
_COMPILER = ("compile_forms", "compile_expressions")


def listen(clock: Callable[[], float] = time.monotonic) -> None:
    """Raise KeyboardInterrupt on Ctrl-C and on SIGTERM from now on, once for signals that come together."""
    last = -SAME

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal last
        if clock() - last < SAME:
            return
        last = clock()
        abandon_compilation(frame)
        raise KeyboardInterrupt

    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, interrupt)


def end_with_parent(end: Callable[[], None]) -> None:
    """Call `end` in a thread when the process that has started this one has ended, however that ended."""

    def wait() -> None:
        from multiprocessing import parent_process

        first = parent_process()
        if first is not None:
            first.join()
        end()

    threading.Thread(target=wait, daemon=True).start()


def is_interrupt(error: BaseException | None) -> bool:
    """Whether an exception is an interruption, as it is or as the cause of another one.

    ctypes preserves only its name, in the message of its own error.
    """
    while error is not None:
        if isinstance(error, KeyboardInterrupt) or KeyboardInterrupt.__name__ in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False


def abandon_compilation(frame: FrameType | None) -> None:
    """Remove the source of the kernel that is being compiled in this frame or in one that called it.

    FFCx takes a source for a compilation under way, and removes it on errors, but not when it is interrupted.
    """
    for caller in _callers(frame):
        if caller.f_code.co_name in _COMPILER and caller.f_globals.get("__name__", "").startswith("ffcx."):
            folder, name = caller.f_locals.get("cache_dir"), caller.f_locals.get("module_name")
            # Not the source that another process is compiling while this one waits.
            if folder and name and not _waits(frame):
                source = Path(folder) / f"{name}.c"
                if not source.with_suffix(".c.cached").exists():
                    with suppress(OSError):
                        source.unlink()


def _waits(frame: FrameType | None) -> bool:
    return any(caller.f_code.co_name == "get_cached_module" for caller in _callers(frame))


def _callers(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back
