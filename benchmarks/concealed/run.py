"""Diagnose every recording in a separate process, and save its answer.

The command gets only the case file, in a folder without access to the truth. A recording that is done (or failed, or
ran out of time) is not run again, so that a killed run continues where it stopped.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

# Characters kept of a failed command's stderr.
TAIL = 2000


@dataclass(frozen=True)
class Run:
    """How a diagnosis went.

    Attributes
    ----------
    seconds : float
        Wall-clock time.
    code : int or None
        Exit code; None where it ran out of time.
    result : bool
        Whether there is a result.json.
    stderr : str
        Its last characters, if there is no result.
    """

    seconds: float
    code: int | None
    result: bool
    stderr: str

    @property
    def how(self) -> str:
        """How it ended, in words."""
        if self.result:
            return "done"
        return "out of time" if self.code is None else f"exit code {self.code}"


class Running:
    """The running processes, which `stop` ends."""

    def __init__(self) -> None:
        self.stopped = threading.Event()
        self._lock = threading.Lock()
        self._processes: set[subprocess.Popen[str]] = set()

    def add(self, process: subprocess.Popen[str]) -> None:
        """Register a process; after `stop` it is ended at once."""
        with self._lock:
            self._processes.add(process)
            if self.stopped.is_set():
                end(process)

    def remove(self, process: subprocess.Popen[str]) -> None:
        """Forget a process that has ended."""
        with self._lock:
            self._processes.discard(process)

    def stop(self) -> None:
        """End all running processes."""
        with self._lock:
            self.stopped.set()
            for process in self._processes:
                end(process)


def run_all(
    folder: Path,
    command: Sequence[str],
    workers: int = 2,
    timeout: float = 1800.0,
    count: int | None = None,
    again: bool = False,
) -> Generator[str, None, None]:
    """Diagnose the recordings that have not been diagnosed yet; yield a line for each.

    Parameters
    ----------
    folder
        Folder that contains ``cases`` and gets ``results``.
    command
        Command, to which ``CASE --json -o OUT`` is appended.
    workers
        Number of recordings at the same time.
    timeout
        Limit for each, s.
    count
        Largest number of recordings to run; None = all.
    again
        Whether to repeat recordings without a result.
    """
    todo = []
    for case in sorted((folder / "cases").glob("*/case.toml")):
        done = folder / "results" / case.parent.name / "run.json"
        if not done.exists() or (again and not read_run(done).result):
            todo.append(case)
    todo = todo[:count]
    running = Running()
    with ThreadPoolExecutor(workers) as pool:
        jobs = {
            pool.submit(run_one, case, folder, command, timeout, running): case.parent.name for case in todo
        }
        try:
            for job in as_completed(jobs):
                if (run := job.result()) is not None:
                    yield f"{jobs[job]}: {run.how}, {run.seconds:.0f} s"
        finally:
            # If interrupted, running diagnoses end with this process and leave no files.
            pool.shutdown(wait=False, cancel_futures=True)
            running.stop()


def run_one(
    case: Path,
    folder: Path,
    command: Sequence[str],
    timeout: float,
    running: Running,
    results: str = "results",
) -> Run | None:
    """Diagnose one recording; its files appear whole or not at all, and not if it was stopped (None)."""
    if running.stopped.is_set():
        return None
    target = folder / results / case.parent.name
    target.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        # A copy, so that the command finds nothing else beside its case.
        copy, out = Path(scratch) / "case", Path(scratch) / "out"
        shutil.copytree(case.parent, copy)
        begin = time.perf_counter()
        whole = [*command, str(copy / "case.toml"), "--json", "-o", str(out)]
        code, stdout, stderr = _call(whole, copy, timeout, running)
        if running.stopped.is_set():
            return None
        seconds = round(time.perf_counter() - begin, 1)
        text = (out / "result.json").read_text("utf-8") if (out / "result.json").exists() else stdout
    result = code is not None and _is_result(text)
    if result:
        _replace(target / "result.json", text)
    run = Run(seconds, code, result, "" if result else stderr[-TAIL:])
    _replace(target / "run.json", json.dumps(asdict(run), indent=1) + "\n")
    return run


def read_run(file: Path) -> Run:
    """Read a run.json."""
    return Run(**json.loads(file.read_text("utf-8")))


def _call(
    command: Sequence[str], folder: Path, timeout: float, running: Running
) -> tuple[int | None, str, str]:
    """Return exit code (None = out of time), stdout and stderr; child processes end with it."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        running.add(process)
        try:
            stdout, stderr = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            end(process)
            stdout, stderr = process.communicate()
            return None, stdout, stderr
        finally:
            running.remove(process)
        return process.returncode, stdout, stderr


def end(process: subprocess.Popen[str]) -> None:
    """End a process and all processes that it started, which share its session."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)


def _is_result(text: str) -> bool:
    try:
        return "verdict" in json.loads(text)
    except (ValueError, TypeError):
        return False


def _replace(file: Path, text: str) -> None:
    part = file.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(file)
