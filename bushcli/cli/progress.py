"""Progress on stderr: bars on a terminal, plain lines when piped."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bushcli.cli.run import Run, is_first_rank, is_terminal

if TYPE_CHECKING:
    from rich.progress import Progress

    from bushcli.effects.effect import EffectParameter
    from bushcli.inverse import Evaluation


@contextmanager
def march_progress(run: Run) -> Iterator[Callable[[str, int, int, int, float], None] | None]:
    """Show the progress of a march: a bar on a terminal, plain lines when the output is piped."""
    if run.quiet or not is_first_rank():
        yield None
        return
    if not is_terminal(sys.stderr) or run.verbose:
        starts: dict[str, float] = {}

        def line(name: str, step: int, steps: int, newton: int, q: float) -> None:
            start = starts.setdefault(name, time.perf_counter())
            if not run.verbose and step not in {steps, *(round(steps * share / 4) for share in (1, 2, 3))}:
                return
            spent = time.perf_counter() - start
            remaining = spent / step * (steps - step)
            run.say(f"{name}: step {step}/{steps}, {newton} iterations, {remaining:.0f} s left")

        yield line
        return
    with _bars("step {task.completed:.0f}/{task.total:.0f}, {task.fields[newton]} iterations,") as bar:
        tasks: dict[str, Any] = {}

        def advance(name: str, step: int, steps: int, newton: int, q: float) -> None:
            if name not in tasks:
                tasks[name] = bar.add_task(name, total=steps, newton=0)
            bar.update(tasks[name], completed=step, total=steps, newton=newton)

        yield advance


@contextmanager
def work_progress(run: Run, what: str) -> Iterator[Callable[[int, int, int], None] | None]:
    """Show how much of a long list of work is done, and the time left: a bar on a terminal, lines when piped."""
    if run.quiet or not is_first_rank():
        yield None
        return
    start, already_done, shown = time.perf_counter(), -1, -1

    def left(done: int, total: int) -> float:
        """Return the seconds left; results of an earlier run took no time."""
        nonlocal already_done
        if already_done < 0:
            already_done = max(0, done - 1)
        return (time.perf_counter() - start) / max(done - already_done, 1) * (total - done)

    if not is_terminal(sys.stderr) or run.verbose:

        def line(done: int, total: int, failed: int) -> None:
            nonlocal shown
            remaining, tenth = left(done, total), 10 * done // total
            if tenth != shown or run.verbose:
                shown = tenth
                failures = f", {failed} failed" if failed else ""
                run.say(f"{what}: {done}/{total}{failures}, {remaining:.0f} s left")

        yield line
        return
    with _bars("{task.completed:.0f}/{task.total:.0f}{task.fields[lost]},") as bar:
        shared = bar.add_task(what, total=None, lost="")

        def advance(done: int, total: int, failed: int) -> None:
            lost = f", {failed} failed" if failed else ""
            bar.update(shared, completed=done, total=total, lost=lost)

        yield advance


def _bars(done: str) -> Progress:
    """Return bars on stderr, each with its name, with what is done as a template says, and with the time left."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    name, left = TextColumn("{task.description:12s}"), (TimeRemainingColumn(compact=True), TextColumn("left"))
    return Progress(name, BarColumn(), TextColumn(done), *left, console=Console(stderr=True))


def search_progress(
    run: Run, rotational: Mapping[str, EffectParameter], starts: int = 1
) -> Callable[[Evaluation], None] | None:
    """Return a function that prints one line for each evaluation of an identification.

    Fast fits to coupons show their lines only on request (-v).
    """
    if run.quiet or not is_first_rank():
        return None

    from bushcli.inverse.file_units import values_in_file_units

    start, started = time.perf_counter(), 0

    def line(evaluation: Evaluation) -> None:
        nonlocal started
        if evaluation.start > started:
            started = evaluation.start
            remaining = (time.perf_counter() - start) / started * (starts - started)
            run.say(f"start {started + 1} of {starts}, about {remaining:.0f} s left")
        values = values_in_file_units(evaluation.parameters, rotational)
        run.say(progress_line(replace(evaluation, parameters=values)))

    return line


def progress_line(evaluation: Evaluation) -> str:
    """Return one evaluation as a line: "  4  misfit  1.064  it 2  C10 0.118"."""
    cost = evaluation.cost
    misfit = "no solution     " if math.isnan(cost) else f"misfit {math.sqrt(cost):9.4g}"
    where = f"it {evaluation.iteration}" if evaluation.iteration else "start"
    where = "profile" if evaluation.stage == "profile" else where
    values = "  ".join(f"{name} {value:.5g}" for name, value in evaluation.parameters.items())
    start = f"start {evaluation.start}  " if evaluation.start else ""
    return f"  {evaluation.number:3d}  {misfit}  {start}{where:7s}  {values}{'  best' if evaluation.best else ''}"
