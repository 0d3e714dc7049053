"""Progress on stderr: bars on a terminal, plain lines when piped."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from bushcli.cli.run import Run, on_terminal, speaks

if TYPE_CHECKING:
    from bushcli.inverse import Evaluation


@contextmanager
def march_progress(run: Run) -> Iterator[Callable[[str, int, int, int, float], None] | None]:
    """Progress of the march: a bar with step, Newton count and time left on a terminal, plain lines when piped."""
    if run.quiet or not speaks():
        yield None
        return
    if not on_terminal(sys.stderr) or run.verbose:
        begin: dict[str, float] = {}

        def line(name: str, step: int, steps: int, newton: int, q: float) -> None:
            start = begin.setdefault(name, time.perf_counter())
            if not run.verbose and step not in {steps, *(round(steps * share / 4) for share in (1, 2, 3))}:
                return
            spent = time.perf_counter() - start
            left = spent / step * (steps - step)
            run.say(f"{name}: step {step}/{steps}, {newton} iterations, {left:.0f} s left")

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:12s}"),
        BarColumn(),
        TextColumn("step {task.completed:.0f}/{task.total:.0f}, {task.fields[newton]} iterations,"),
        TimeRemainingColumn(compact=True),
        TextColumn("left"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        tasks: dict[str, Any] = {}

        def advance(name: str, step: int, steps: int, newton: int, q: float) -> None:
            if name not in tasks:
                tasks[name] = bar.add_task(name, total=steps, newton=0)
            bar.update(tasks[name], completed=step, total=steps, newton=newton)

        yield advance


def search_progress(run: Run) -> Callable[[Evaluation], None] | None:
    """Progress of an identification: a line per evaluation, with the misfit, the step and the parameters.

    Of the fast fits to coupons every line is only shown when asked for (-v).
    """
    if run.quiet or not speaks():
        return None
    before: dict[str, float] = {}

    def line(found: Evaluation) -> None:
        step = max(
            (abs(v - before.get(k, v)) / max(abs(v), 1e-12) for k, v in found.parameters.items()), default=0.0
        )
        before.update(found.parameters)
        shown = "  ".join(f"{name} {value:.5g}" for name, value in found.parameters.items())
        rms = "no solution" if math.isnan(found.cost) else f"misfit {math.sqrt(found.cost):9.4g}"
        run.say(
            f"  {found.number:3d}  {rms}  step {100 * step:7.2g} %  {shown}{'  best' if found.best else ''}"
            f"{'  profile' if found.stage == 'profile' else ''}"
        )

    return line
