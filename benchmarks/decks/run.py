"""Diagnose a deck's recordings, each in a separate process on a copy of its case; continue an earlier run.

Besides ``DIR/results-LABEL/NAME`` each writes a line to the ledger in git (`ledger`). Recordings in the ledger are
done, on whichever machine.
"""

from __future__ import annotations

import json
import resource
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from benchmarks.concealed.run import Run, Running, run_one
from benchmarks.decks import ledger

# Exit codes of a process that has exceeded its processor time (SIGXCPU, SIGKILL), or of its shell.
OUT_OF_TIME = (-24, -9, 152, 137)
# Exit codes of a process that a user has ended: SIGINT, SIGTERM.
INTERRUPTED = (-2, -15, 130, 143)


def cases_to_run(
    deck: str, folder: Path, label: str, *, again: bool = False, ledgers: Path = ledger.FOLDER
) -> list[Path]:
    """Cases that are not in the ledger, in order; with `again` also those without a verdict in their last line."""
    known = ledger.read(deck, label, ledgers)
    cases = sorted((folder / "cases").glob("*/case.toml"))

    def open_(case: Path) -> bool:
        line = known.get(case.parent.name)
        return line is None or (again and "verdict" not in line)

    return [case for case in cases if open_(case)]


def run_all(
    deck: str,
    folder: Path,
    command: Sequence[str],
    label: str,
    *,
    workers: int = 1,
    timeout: float = 600.0,
    processor: int | None = None,
    count: int | None = None,
    again: bool = False,
    ledgers: Path = ledger.FOLDER,
) -> Generator[str, None, None]:
    """Diagnose the recordings that have not been diagnosed yet; yield a line for each.

    Parameters
    ----------
    deck, folder
        Name of the deck, and where its ``cases`` are.
    command
        Command, to which ``CASE --json -o OUT`` is appended.
    label
        Name of the code that is run.
    workers, timeout, count
        Number of recordings at the same time; limit of wall-clock time for each, s; largest number to run now.
    processor
        Limit of processor time for each, s, which does not depend on other work on the machine.
    again
        Whether to repeat recordings without a result.
    ledgers
        Folder of the ledger.
    """
    if processor is not None:
        command = ["sh", "-c", f'ulimit -t {processor:d}; exec "$@"', "sh", *command]
    todo = cases_to_run(deck, folder, label, again=again, ledgers=ledgers)[:count]
    running, before = Running(), processor_seconds()
    with ThreadPoolExecutor(workers) as pool:
        jobs = {pool.submit(_run_case, case, folder, command, timeout, running, label): case for case in todo}
        try:
            for job in as_completed(jobs):
                run = job.result()
                if run is None:
                    continue
                name = jobs[job].parent.name
                if run.code in INTERRUPTED:
                    # Ended from outside: the recording counts as not done.
                    yield f"{deck} {name}: interrupted, {run.seconds:.0f} s"
                    continue
                result = None
                if run.result:
                    file = folder / f"results-{label}" / name / "result.json"
                    result = json.loads(file.read_text("utf-8"))
                line = ledger.compact(
                    name,
                    result,
                    seconds=run.seconds,
                    code=None if run.code in OUT_OF_TIME else run.code,
                    stderr=run.stderr,
                )
                # Processor time of children that have ended; with one worker, of this recording.
                used, before = processor_seconds() - before, processor_seconds()
                if workers == 1:
                    line["processor_seconds"] = round(used, 1)
                ledger.append(deck, label, line, ledgers)
                yield f"{deck} {name}: {run.how}, {run.seconds:.0f} s"
        finally:
            # If interrupted, running diagnoses end with this process and count as not done.
            pool.shutdown(wait=False, cancel_futures=True)
            running.stop()


def processor_seconds() -> float:
    """Processor time of all child processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _run_case(
    case: Path, folder: Path, command: Sequence[str], timeout: float, running: Running, label: str
) -> Run | None:
    return run_one(case, folder, command, timeout, running, f"results-{label}")
