"""Make many recordings in worker processes; nothing heavy, in particular no MPI, is imported into the first process."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from bushcli.runtime.interrupt import end_with_parent


def make_all(folder: Path, seeds: Sequence[int], workers: int) -> Iterator[str]:
    """Make the recordings that do not exist yet; yield a line for each that does not reveal what it conceals."""
    missing = [seed for seed in seeds if not (folder / "truth" / f"{seed:07d}.json").exists()]
    # Spawned: MPI does not survive a fork.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=follow) as pool:
        jobs = {pool.submit(_make, seed, folder): seed for seed in missing}
        for done in as_completed(jobs):
            # A failure must be reported, but must not stop the others.
            failure = done.exception()
            yield done.result() if failure is None else f"{jobs[done]}: {type(failure).__name__}: {failure}"


def follow() -> None:
    """Make this process end with its parent, however that ends."""
    end_with_parent(lambda: os._exit(1))


def _make(seed: int, folder: Path) -> str:
    from benchmarks.concealed.make import Unsuitable, make

    try:
        truth = make(seed, folder)
    except Unsuitable as failure:
        return f"{seed}: none: {failure}"
    return f"{truth.name}: {truth.seconds:.0f} s, attempt {truth.attempt + 1}"
