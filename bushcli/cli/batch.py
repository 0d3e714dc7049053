"""The `batch` command, which compares the parts of one drawing."""

from __future__ import annotations

import click

from bushcli.cli.progress import search_progress
from bushcli.cli.run import Run, on_a_case, verdict_code


@click.command()
@click.option("--model", metavar="LAW", help="Law to identify instead of the case's.")
@click.option("--strict", is_flag=True, help="Exit 1 when there is an outlier.")
@on_a_case
def batch(run: Run, model: str | None, strict: bool) -> int:
    """Identify one law from the recordings of several parts, and the stiffness of each.

    The [[specimens]] of CASE are parts of one drawing. The result has the scatter of their stiffness, the mean curve
    with its tolerance band, and the outliers, with what their recordings show of the cause.
    """
    from bushcli.inverse import Task
    from bushcli.study.batch import batch as compared

    case = run.load()
    law = model or case.material.law
    with run.timer("batch"):
        progress = search_progress(run, Task(case, law).rotational_parameters, 1)
        comparison = compared(case, law, tables=run.tables, progress=progress, told=run.say)
    run.deliver(comparison)
    return verdict_code(comparison.conditions, comparison.fit.converged, strict and bool(comparison.outliers))
