"""The `diagnose` command, which finds the physics that a model leaves out."""

from __future__ import annotations

import time
from collections.abc import Callable

import click

from bushcli.cli.run import (
    DONE,
    INTERRUPTED,
    NEGATIVE,
    NOT_CONVERGED,
    Run,
    is_first_rank,
    number_of_ranks,
    on_a_case,
)
from bushcli.cli.shared import (
    PositiveNumber,
    names_in,
    processes_option,
    processors,
    remote_executor,
    resume_option,
    say_what_is_saved,
    scheduler_option,
)
from bushcli.errors import InputError, Problem, count_of
from bushcli.runtime.interrupt import listen

# Judgement: three fits run at once (`selection.queue.AT_ONCE`), so that more processes would only share
# derivatives. Each takes 0.4 GB, measured with an axial and a radial channel.
MOST_WORKERS = 4


@click.command()
@click.option("--model", metavar="LAW", help="Law of the plain model instead of the case's.")
@click.option(
    "--effects",
    "requested",
    multiple=True,
    metavar="NAME[,NAME...]",
    help="Look for these effects only (see `bushcli list effects`); may be given several times.",
)
@click.option(
    "--hold-out",
    "hold_out",
    multiple=True,
    metavar="CHANNEL[,CHANNEL...]",
    help="Leave this channel out of fits and evidence, and predict it; may be given several times.",
)
@click.option(
    "--uniform-odds",
    is_flag=True,
    help="Give all effects the same prior odds, however common or rare they are.",
)
@click.option(
    "--budget",
    type=PositiveNumber(),
    metavar="MINUTES",
    help="Start no further fits after this time, and answer with the models fitted so far.",
)
@processes_option(
    "Processes that share the work; the answer does not depend on their number. If not given, as many as this machine "
    f"has processors, {MOST_WORKERS} at most."
)
@scheduler_option
@resume_option("fits")
@click.option("--no-maps", is_flag=True, help="Do not compute the maps of the bushing.")
@click.option("--strict", is_flag=True, help='Exit 1 unless the verdict is "explained".')
@on_a_case
def diagnose(
    run: Run,
    model: str | None,
    requested: tuple[str, ...],
    hold_out: tuple[str, ...],
    uniform_odds: bool,
    budget: float | None,
    workers: int | None,
    scheduler: str | None,
    resume: bool | None,
    no_maps: bool,
    strict: bool,
) -> int:
    """Find where the simulation of CASE misses its recordings, which physics was left out, and with what probability.

    The result lists the probability of every effect, the most probable models, and the fit before and after. With
    -o DIR each fit is saved in DIR/history-diagnose; the same command uses those of an earlier run. Under
    `mpirun -n N` the first process leads and the others share the work, on one machine or several; --scheduler shares
    it among the workers of Dask.
    """
    from bushcli.diagnosis.diagnose import diagnose as find
    from bushcli.runtime.store import SUFFIX

    case = run.load()
    has_ranks = number_of_ranks() > 1
    if has_ranks and (workers or 1) > 1:
        raise InputError(Problem("--workers", "cannot be used under mpirun, which starts the workers"))
    if scheduler and (has_ranks or (workers or 1) > 1):
        other = "mpirun" if has_ranks else "--workers"
        what = f"cannot be combined with {other}"
        raise InputError(Problem("--scheduler", what, "", "give one of the two"))
    names = list(names_in(requested))
    if requested and not names:
        raise InputError(Problem("--effects", "names no effect", "", "NAME[,NAME...]"))
    with remote_executor(has_ranks, scheduler) as executor:
        if has_ranks and executor is None:
            # This rank has answered until the first one left the context.
            return DONE
        journal = run.output / "history-diagnose" if run.output else None
        if has_ranks:
            # The other ranks work for this one, and end with it.
            listen(together=False)
        try:
            with run.timer("diagnose"):
                diagnosis = find(
                    case,
                    model=model,
                    effects=names or None,
                    hold_out=names_in(hold_out),
                    uniform=uniform_odds,
                    budget=None if budget is None else 60.0 * budget,
                    workers=workers or min(processors(), MOST_WORKERS),
                    executor=executor,
                    journal=journal,
                    resume=resume,
                    maps=not no_maps,
                    tables=run.tables,
                    progress=_progress(run, None if budget is None else 60.0 * budget),
                )
        except BaseException as error:
            if journal is not None and journal.is_dir():
                count = len(list(journal.glob(f"*{SUFFIX}")))
                say_what_is_saved(error, run.output, count_of(count, "result"))
            raise
        run.deliver(diagnosis)
        ended = {condition.name for condition in diagnosis.conditions}
        if "interrupted" in ended:
            return INTERRUPTED
        if "not_converged" in ended:
            return NOT_CONVERGED
        return NEGATIVE if strict and diagnosis.verdict != "explained" else DONE


def _progress(run: Run, budget: float | None = None) -> Callable[[str, str, str], None] | None:
    """Return a function that prints a line per step on stderr: seconds spent and left, stage, effect, misfit."""
    if run.quiet or not is_first_rank():
        return None
    start, last = time.perf_counter(), ""

    def line(stage: str, what: str, text: str) -> None:
        nonlocal last
        repeated, last = last == what, what if stage == "screen" else ""
        if stage == "screen" and not run.verbose:
            if repeated:
                return
            text = ""
        spent = time.perf_counter() - start
        remaining = "" if budget is None else f"{max(0.0, budget - spent):5.0f} s left  "
        run.say(f"  {spent:5.0f} s  {remaining}{stage:10s} {what:30s} {text}".rstrip())

    return line
