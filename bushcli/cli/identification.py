"""Commands that identify a law: fit (from coupons), inverse (from recordings), batch (from several parts)."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import click

from bushcli.cli.progress import search_progress
from bushcli.cli.run import DONE, NEGATIVE, Run, on_a_case, verdict_code
from bushcli.cli.shared import (
    names_in,
    pool,
    processes_option,
    resume_option,
    scheduler_option,
    seed_option,
    starts_option,
)
from bushcli.errors import InputError, Problem, count_of

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.inverse import Fit, Task
    from bushcli.inverse.local import Loss
    from bushcli.runtime.executor import Pool

weighted = click.option(
    "--weighting",
    type=click.Choice(["relative", "absolute"]),
    default="relative",
    show_default=True,
    help="Divide coupon misfits by the stress itself, or by the coupon's largest stress.",
)


held_out_channels = click.option(
    "--hold-out",
    "held_out",
    multiple=True,
    metavar="CHANNEL[,CHANNEL...]",
    help="Predict this channel instead of fitting it.",
)
fixed_parameters = click.option(
    "--fix",
    "fixed",
    multiple=True,
    metavar="NAME[,NAME...]",
    help="Keep a parameter, or all parameters of an effect, at the start value; may be repeated.",
)


@click.command()
@click.option("--model", metavar="LAW", help="Law to fit instead of the case's.")
@weighted
@click.option(
    "--branch",
    type=click.Choice(["loading", "unloading", "both"]),
    help="Fit this branch of every coupon, in place of the case's `branch` (loading).",
)
@held_out_channels
@fixed_parameters
@click.option("--strict", is_flag=True, help="Exit 1 when the fit has problems.")
@on_a_case
def fit(
    run: Run,
    model: str | None,
    weighting: str,
    branch: Literal["loading", "unloading", "both"] | None,
    held_out: tuple[str, ...],
    fixed: tuple[str, ...],
    strict: bool,
) -> int:
    """Identify the law of CASE from its coupon tests, and the bulk modulus from volumetric ones.

    Effects on the rubber (viscoelasticity, temperature) are identified with it if their `channels` name coupons, or if
    the case has nothing but coupons.

    Coupons' tables of dynamic moduli give relaxation spectra, the shift of their times with temperature, and a lag of
    the rig.
    """
    from bushcli.inverse.coupon_tables import fit_tables
    from bushcli.report.results import FitResult

    case = run.load()
    with run.timer("spectra"):
        spectra, problems = fit_tables(case, run.tables)
    if problems and not spectra and not case.coupons:
        # The only tables of the case have no spectrum: what prevents it is the answer.
        raise InputError(
            *(Problem(case.path.name, condition.message, "", condition.remedy) for condition in problems)
        )
    if branch is not None:
        case = replace(case, coupons=tuple(replace(source, branch=branch) for source in case.coupons))
    coupon_fit = None
    if case.coupons or not spectra:
        coupon_fit = fit_to_coupons(run, case, model, weighting, names_in(held_out), names_in(fixed))
        coupon_fit = replace(coupon_fit, conditions=(*coupon_fit.conditions, *problems))
        problems = ()
    run.deliver(FitResult(case, coupon_fit, spectra, problems))
    if coupon_fit is None:
        return NEGATIVE if strict and problems else DONE
    return verdict_code(coupon_fit.conditions, coupon_fit.converged, strict and bool(coupon_fit.conditions))


def fit_to_coupons(
    run: Run,
    case: Case,
    model: str | None = None,
    weighting: str = "relative",
    held_out: tuple[str, ...] = (),
    fixed: tuple[str, ...] = (),
) -> Fit:
    """Fit a law to the coupon tests of a case and show the progress if the user asked for details."""
    from bushcli.inverse import fit_coupons
    from forms.law import laws

    law = model or case.material.law
    if case.coupons and law in laws():
        run.say(f"fitting {law} to {count_of(len(case.coupons), 'coupon test')}")
    # A coupon is solved in milliseconds: its evaluations are printed only with --verbose.
    progress = search_progress(run, {}) if run.verbose else None
    with run.timer("fit"):
        return fit_coupons(
            case,
            model,
            weighting=weighting,  # type: ignore[arg-type]
            fixed=fixed,
            hold_out=held_out,
            progress=progress,
            tables=run.tables,
        )


@click.command()
@click.option(
    "--model",
    "models",
    multiple=True,
    metavar="LAW[,LAW...]",
    help="Law or laws to identify instead of the case's; may be repeated; `all` tries every law.",
)
@held_out_channels
@fixed_parameters
@click.option("--bulk-modulus", is_flag=True, help="Identify the bulk modulus too.")
@click.option(
    "--density", is_flag=True, help="Identify the rubber's density too, from tables of dynamic stiffness."
)
@click.option(
    "--loss",
    type=click.Choice(["linear", "soft_l1", "huber", "cauchy", "arctan"]),
    default="linear",
    show_default=True,
    help="How to discount misfits beyond two standard deviations; linear discounts none.",
)
@starts_option
@click.option(
    "--global",
    "globally",
    is_flag=True,
    help="Find a further start by differential evolution on a coarse mesh.",
)
@processes_option("Processes that share the starts.", default=1)
@scheduler_option
@seed_option("start points")
@resume_option("evaluations")
@click.option("--strict", is_flag=True, help="Exit 1 when the identification has problems.")
@on_a_case
def inverse(
    run: Run,
    models: tuple[str, ...],
    held_out: tuple[str, ...],
    fixed: tuple[str, ...],
    bulk_modulus: bool,
    density: bool,
    loss: Loss,
    starts: int,
    globally: bool,
    workers: int,
    scheduler: str | None,
    seed: int,
    resume: bool | None,
    strict: bool,
) -> int:
    """Identify the law of CASE from its recordings.

    Every channel is weighted by its own noise. With -o DIR each evaluation is saved in DIR/history-LAW, from which the
    same command continues after an interruption. --scheduler shares the starts among the workers of Dask, which write
    no such files.
    """
    from bushcli.inverse import Task, refuse_fixed
    from bushcli.report.ranking import rank
    from bushcli.report.results import InverseResult
    from forms.law import laws

    case = run.load()
    if scheduler and workers > 1:
        what = "cannot be combined with --scheduler, which has its own workers"
        raise InputError(Problem("--workers", what))
    model_names = names_in(models) or (case.material.law,)
    if "all" in model_names:
        model_names = tuple(laws())
    tasks = [
        Task(
            case,
            law,
            fixed=names_in(fixed),
            bulk_modulus=bulk_modulus,
            density=density,
            hold_out=names_in(held_out),
            loss=loss,
            starts=starts,
            globally=globally,
            seed=seed,
            workers=workers,
        )
        for law in model_names
    ]
    refuse_fixed(tasks)
    fits = []
    with pool(None, scheduler) if scheduler else nullcontext() as shared:
        for task in tasks:
            fits.append(_identified_fit(run, task, resume, shared))
            if any(condition.name == "interrupted" for condition in fits[-1].conditions):
                break
    last = fits[-1]
    fits.sort(key=rank)
    run.deliver(InverseResult(case, fits))
    return verdict_code(last.conditions, fits[0].converged, strict and bool(fits[0].conditions))


def _identified_fit(run: Run, task: Task, resume: bool | None, shared: Pool | None) -> Fit:
    """Identify one law, and save its evaluations if there is an output folder."""
    from bushcli.inverse import identify

    recordings = {source.label for source in task.case.recordings} - set(task.hold_out)
    tables = {source.label for source in task.case.dynamic} - set(task.hold_out)
    numbers_of_data = [f"{len(recordings)} recording{'s' * (len(recordings) != 1)}"] if recordings else []
    if tables:
        numbers_of_data.append(f"{len(tables)} table{'s' * (len(tables) != 1)} of dynamic stiffness")
    if numbers_of_data:
        # Without any, the task says what is missing.
        run.say(f"identifying {task.model} from {' and '.join(numbers_of_data)}")
    journal = run.output / f"history-{task.model}" if run.output else None
    progress = search_progress(run, task.rotational_parameters, task.starts + task.globally)
    with run.timer(task.model):
        return identify(
            task,
            journal=journal,
            resume=resume,
            progress=progress,
            pool=shared,
            tables=run.tables,
            told=lambda fault: run.say(f"  {fault.channel}: {fault.where}"),
        )


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
