"""Options of the commands that share their work among processes, and the pools that do the work."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from bushcli.cli.run import ranks_there_are
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from bushcli.runtime.executor import Pool

F = TypeVar("F", bound=Callable[..., Any])


def shares_work(command: F) -> F:
    """Give a command the options ``--workers`` and ``--scheduler``."""
    command = click.option(
        "--workers",
        type=click.IntRange(1, 256),
        help="Processes of this machine that share the work; as many as it has processors if not given.",
    )(command)
    return scheduled(command)


def scheduled(command: F) -> F:
    """Give a command the option ``--scheduler``."""
    return click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Share the work among the workers of this Dask scheduler, e.g. tcp://127.0.0.1:8786.",
    )(command)


def resumes(what: str) -> Callable[[F], F]:
    """Give a command the option ``--resume/--fresh``.

    Parameters
    ----------
    what : str
        What a run saves, in the plural.
    """
    return click.option(
        "--resume/--fresh",
        default=None,
        help=f"Continue from the {what} that an earlier run of the same question saved in -o DIR: this is the default "
        "where there are any; --resume refuses to begin anew beside those of another question. --fresh deletes them.",
    )


@contextmanager
def pool(workers: int | None, scheduler: str | None) -> Iterator[Pool | None]:
    """Yield the pool of workers; None on the ranks of `mpirun` that work for the first one.

    Parameters
    ----------
    workers : int or None
        Number of processes; None for as many as there are processors.
    scheduler : str or None
        Address of a Dask scheduler.

    Raises
    ------
    InputError
        Options contradict each other, or the scheduler does not answer.
    """
    from bushcli.runtime.executor import Pool, dask, processes
    from bushcli.runtime.workers import ranks

    several = ranks_there_are()
    if workers is not None and (several > 1 or scheduler):
        where = "mpirun" if several > 1 else "--scheduler"
        raise InputError(Problem("--workers", f"cannot be combined with {where}, which has its own workers"))
    if several > 1 and scheduler:
        raise InputError(Problem("--scheduler", "cannot be used under mpirun", "", "give one of the two"))
    if several > 1:
        with ranks() as executor:
            yield None if executor is None else Pool(executor, several - 1)
    elif scheduler:
        with dask(scheduler) as found:
            yield found
    else:
        with processes(workers or len(os.sched_getaffinity(0))) as found:
            yield found


@contextmanager
def elsewhere(several: bool, scheduler: str | None) -> Iterator[Executor | None]:
    """Yield an executor on other ranks or on Dask; None without one, and on the ranks that work for the first one.

    Parameters
    ----------
    several : bool
        Whether `mpirun` has started several processes.
    scheduler : str or None
        Address of a Dask scheduler.

    Raises
    ------
    InputError
        The scheduler does not answer.
    """
    from bushcli.runtime.executor import dask
    from bushcli.runtime.workers import ranks

    if several:
        with ranks() as executor:
            yield executor
    elif scheduler:
        with dask(scheduler) as found:
            yield found.executor
    else:
        yield None
