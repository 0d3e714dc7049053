"""Options of the commands that share their work among processes, and the pools that do the work."""

from __future__ import annotations

import math
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from bushcli.cli.run import is_first_rank, number_of_ranks
from bushcli.errors import InputError, Problem
from cases.interrupt import is_interrupt

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from bushcli.runtime.executor import Pool

F = TypeVar("F", bound=Callable[..., Any])


class _Address(click.ParamType):
    """An address: an empty one, such as an unset variable of the shell, would mean no scheduler."""

    name = "address"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if not str(value).strip():
            self.fail("is empty: give the address that `dask scheduler` prints", param, ctx)
        return str(value)


scheduler_option = click.option(
    "--scheduler",
    type=_Address(),
    metavar="ADDRESS",
    help="Share the work among the workers of this Dask scheduler, e.g. tcp://127.0.0.1:8786.",
)
starts_option = click.option(
    "--starts", type=click.IntRange(1, 1000), default=1, show_default=True, help="Number of start points."
)


def seed_option(of: str) -> Callable[[F], F]:
    """Give a command the option ``--seed``."""
    return click.option(
        "--seed", type=click.IntRange(0), default=0, show_default=True, help=f"Seed of the {of}."
    )


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


def processes_option(meaning: str, default: int | None = None) -> Callable[[F], F]:
    """Give a command the option ``--workers``."""
    return click.option(
        "--workers", type=click.IntRange(1, 256), default=default, show_default=True, help=meaning
    )


def worker_options(command: F) -> F:
    """Give a command the options ``--workers``, all processors if it is not given, and ``--scheduler``."""
    meaning = "Processes of this machine that share the work; as many as it has processors if not given."
    return scheduler_option(processes_option(meaning)(command))


def resume_option(what: str) -> Callable[[F], F]:
    """Give a command the option ``--resume/--fresh``."""
    return click.option(
        "--resume/--fresh",
        default=None,
        help=f"Continue from the {what} that an earlier run of the same question saved in -o DIR: this is the default "
        "where there are any; --resume refuses to begin anew beside those of another question. --fresh replaces "
        "those of the same question; those of other questions stay.",
    )


def say_what_is_saved(error: BaseException, folder: Path | None, what: str) -> None:
    """Say on stderr, where a run has been interrupted or its scheduler was lost, what is saved and how to go on."""
    from bushcli.runtime.executor import SchedulerLost

    scheduler_lost = isinstance(error, SchedulerLost)
    if folder is None or not (scheduler_lost or is_interrupt(error)) or not is_first_rank():
        return
    command = shlex.join(["bushcli", *sys.argv[1:]])
    after = " (with a scheduler that runs)" if scheduler_lost else ""
    click.echo(f"no result yet; {what} are saved in {folder}; to continue{after}: {command}", err=True)


@contextmanager
def pool(workers: int | None, scheduler: str | None) -> Iterator[Pool | None]:
    """Yield the pool of workers; None on the ranks of `mpirun` that work for the first one."""
    from bushcli.runtime.executor import Pool, dask, processes
    from bushcli.runtime.workers import ranks

    rank_count = number_of_ranks()
    if workers is not None and (rank_count > 1 or scheduler):
        where = "mpirun" if rank_count > 1 else "--scheduler"
        raise InputError(Problem("--workers", f"cannot be combined with {where}, which has its own workers"))
    if rank_count > 1 and scheduler:
        raise InputError(Problem("--scheduler", "cannot be used under mpirun", "", "give one of the two"))
    if rank_count > 1:
        with ranks() as executor:
            yield None if executor is None else Pool(executor, rank_count - 1)
    elif scheduler:
        with dask(scheduler) as started:
            yield started
    else:
        with processes(workers or processors()) as started:
            yield started


@contextmanager
def remote_executor(several: bool, scheduler: str | None) -> Iterator[Executor | None]:
    """Yield an executor on other ranks or on Dask; None without one, and on the ranks that work for the first one."""
    from bushcli.runtime.executor import dask
    from bushcli.runtime.workers import ranks

    if several:
        with ranks() as executor:
            yield executor
    elif scheduler:
        with dask(scheduler) as cluster:
            yield cluster.executor
    else:
        yield None


class PositiveNumber(click.FloatRange):
    """A finite number above zero.

    Comparisons with nan are false, so that it would pass the bounds of its base class.
    """

    def __init__(self) -> None:
        super().__init__(min=0.0, min_open=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number, or refuse one that is not finite or not above zero."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


def names_in(options: Sequence[str]) -> tuple[str, ...]:
    """Return the names that all uses of an option give, each once."""
    names = [name.strip() for option in options for name in option.split(",")]
    return tuple(dict.fromkeys(name for name in names if name))
