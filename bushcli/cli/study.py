"""Commands on many designs: study, design."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bushcli.cli.identification import fit_to_coupons
from bushcli.cli.progress import work_progress
from bushcli.cli.run import DONE, NEGATIVE, NOT_CONVERGED, Run, on_a_case
from bushcli.cli.shared import (
    pool,
    resume_option,
    say_what_is_saved,
    seed_option,
    starts_option,
    worker_options,
)
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.case.tolerance import Toleranced
    from bushcli.study.plan import Plan, Sampling
    from bushcli.study.task import StudyTask

SAMPLINGS = ["grid", "lhs", "sobol", "random", "saltelli", "corners"]


@click.command()
@click.option(
    "--vary",
    "varied",
    multiple=True,
    metavar="KEY=VALUES",
    help='Values or a distribution: 20:24:5 (grid), 20,22,24, 20:24, "22 +- 0.1", "normal(22, 0.05)"; '
    'the key "hardness" varies the moduli by Shore A.',
)
@click.option(
    "--list",
    "listed",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Designs from a CSV: keys in its first line, one design in each further line.",
)
@click.option(
    "--sampling",
    type=click.Choice(SAMPLINGS),
    help="Default: grid if all keys have values, else lhs. saltelli is for Sobol indices, corners for the limits of "
    "tolerances.",
)
@click.option("--designs", type=click.IntRange(1), metavar="N", help="Number of designs of a sample.")
@click.option(
    "--answer",
    "asked",
    multiple=True,
    metavar="[NAME=]ANSWER",
    help="axial.initial, axial.secant@3, axial.tangent@3, axial.force@3, under a load axial.secant@500N, or a key of "
    "the result of `direct`.",
)
@click.option(
    "--limits",
    "limited",
    multiple=True,
    metavar="ANSWER=LIMITS",
    help='Report the share of designs within limits: 300:400, "350 +- 15 %", or 350 for 350 +- 10 %.',
)
@seed_option("sample")
@click.option("--no-curves", is_flag=True, help="Keep no curves, only the answers.")
@resume_option("designs")
@click.option("--strict", is_flag=True, help="Exit 1 when a design fails.")
@worker_options
@on_a_case
def study(
    run: Run,
    varied: tuple[str, ...],
    listed: Path | None,
    sampling: Sampling | None,
    designs: int | None,
    asked: tuple[str, ...],
    limited: tuple[str, ...],
    seed: int,
    no_curves: bool,
    resume: bool | None,
    strict: bool,
    workers: int | None,
    scheduler: str | None,
) -> int:
    """Simulate many designs of CASE: spread, influence of each key, and the share within limits.

    Any keys of the case may be varied. Numbers with a tolerance in the case file, such as
    outer_radius = "22.0 +- 0.1", are varied automatically. With -o DIR the designs are saved in DIR/history-study as
    they come, and in DIR/designs.parquet at the end. Under `mpirun -n N` the first process leads and the others share
    the work; --scheduler shares it among the workers of Dask.
    """
    from bushcli.report.results import StudyResult
    from bushcli.study.analysis import limits_of
    from bushcli.study.rows import parquet
    from bushcli.study.study import study as simulate

    parquet()
    case = run.load()
    plan = _plan(case, varied, listed, sampling, designs, seed)
    limits = dict(limits_of(text, case.tolerance.percent) for text in limited)
    with pool(workers, scheduler) as shared:
        if shared is None:
            # This rank has answered until the first one left the context.
            return DONE
        task = _task(run, case, plan, asked, curves=not no_curves)
        with _folder(run) as folder:
            done = [0]
            try:
                with run.timer("study"), work_progress(run, "designs") as progress:

                    def notify(finished: int, count: int, failed: int) -> None:
                        done[0] = finished
                        if progress is not None:
                            progress(finished, count, failed)

                    result, rows = simulate(
                        case,
                        task,
                        plan,
                        shared,
                        folder,
                        limits=limits,
                        resume=resume,
                        notify=notify,
                        tables=run.tables,
                    )
            except BaseException as error:
                say_what_is_saved(error, run.output, f"{done[0]} of {len(plan.rows)} designs")
                raise
            run.deliver(StudyResult(result, rows.write))
            if result.failed == len(plan.rows):
                return NOT_CONVERGED
            return NEGATIVE if strict and result.failed else DONE


def _plan(
    case: Case,
    varied: tuple[str, ...],
    listed: Path | None,
    sampling: Sampling | None,
    designs: int | None,
    seed: int,
) -> Plan:
    from bushcli.study.plan import from_list, plan
    from bushcli.study.variable import of_tolerance, variable

    variables = [variable(text) for text in varied]
    if listed is not None:
        if sampling or designs:
            name = "--sampling" if sampling else "--designs"
            raise InputError(Problem(name, "cannot be combined with --list, which gives the designs"))
        return from_list(listed, variables)
    has_values = bool(variables) and all(variable.values for variable in variables)
    if sampling != "grid" and not (sampling is None and has_values):
        keys, origin = {variable.key for variable in variables}, str(case.path)
        free = ((key, tolerance) for key, tolerance in case.toleranced.items() if key not in keys)
        variables += [of_tolerance(key, tolerance, origin) for key, tolerance in free]
    return plan(variables, sampling, designs, seed)


def _task(run: Run, case: Case, plan: Plan, questions: tuple[str, ...], curves: bool) -> StudyTask:
    from bushcli.case.hardness import HARDNESS
    from bushcli.report.json.study import response_json
    from bushcli.study.answers import answer, check_within_travel, default_answers
    from bushcli.study.task import StudyTask

    if not case.load_cases and not case.recordings:
        expected = case.expected_tables("[[recordings]] or [[load_cases]]")
        raise InputError(Problem(case.path.name, "there is nothing to simulate", "", expected))
    answers = tuple(answer(case, text) for text in questions) or default_answers(case)
    if not any(key.partition(".")[0] == "load_cases" for key in plan.keys):
        for asked in answers:
            check_within_travel(case, asked)
    material = fit_to_coupons(run, case).material if case.needs_fit else None
    hardness = next((variable for variable in plan.variables if variable.key == HARDNESS), None)
    if hardness is not None and not hardness.is_numeric:
        what = "is not a Shore A hardness"
        raise InputError(Problem(f"--vary hardness={hardness.spec}", what, "", '"60 +- 5"'))
    return StudyTask(
        case=run.path.absolute(),
        overrides=run.overrides,
        keys=plan.keys,
        answers=answers,
        curves=curves,
        material=material,
        hardness=None if hardness is None else float(hardness.nominal),
        describe=response_json if any(answer.of_result for answer in answers) else None,
    )


@contextmanager
def _folder(run: Run) -> Iterator[Path]:
    """Yield the folder for rows: in the output, or one that is deleted afterwards."""
    if run.output is not None:
        yield run.output / "history-study"
        return
    import tempfile

    with tempfile.TemporaryDirectory(prefix="bushcli-study-") as folder:
        yield Path(folder)


@click.command()
@click.option(
    "--target",
    "stated",
    multiple=True,
    required=True,
    metavar="RATE=VALUE",
    help="Stiffness at rest, axial=350, over a travel, radial.secant@2=2500, under a load, radial.secant@500N=2500, "
    "or force, axial.force@5=1800; "
    '"axial=350 +- 10 %" weights it by the deviation allowed.',
)
@click.option(
    "--vary",
    "varied",
    multiple=True,
    required=True,
    metavar="KEY=LOW:HIGH",
    help="A key of the case with its bounds, e.g. geometry.outer_radius=20:24.",
)
@click.option(
    "--tolerance",
    "toleranced",
    multiple=True,
    metavar="KEY=DEVIATION",
    help='Tolerance of a key, in addition to those in the case file: geometry.length=0.3, or "hardness=60 +- 5".',
)
@starts_option
@seed_option("start points")
@click.option("--strict", is_flag=True, help="Exit 1 when a target is missed.")
@worker_options
@on_a_case
def design(
    run: Run,
    stated: tuple[str, ...],
    varied: tuple[str, ...],
    toleranced: tuple[str, ...],
    starts: int,
    seed: int,
    strict: bool,
    workers: int | None,
    scheduler: str | None,
) -> int:
    """Find the geometry of CASE that has the target rates, and the effect of tolerances on them.

    Any keys with numbers may be searched within bounds. The load cases and recordings of CASE are not used.
    """
    from bushcli.case import case_json
    from bushcli.case.hardness import HARDNESS
    from bushcli.study.answers import NoAnswer, number_at
    from bushcli.study.design import bounds_of
    from bushcli.study.design import design as find
    from bushcli.study.target import target
    from bushcli.study.task import StudyTask
    from bushcli.study.variable import variable

    targets = [target(text) for text in stated]
    variables = [variable(text) for text in varied]
    bounds_of(variables)
    keys = [variable.key for variable in variables]
    duplicate = next((key for key in keys if keys.count(key) > 1), None)
    if duplicate:
        raise InputError(Problem(f"--vary {duplicate}", "is varied twice"))
    case = run.load()
    if case.geometry.specimen != "bushing":
        raise InputError(Problem(case.path.name, "is a coupon, which has no geometry to design"))
    tolerances = _tolerances(case, toleranced)
    nominal = next((float(variable.nominal) for variable in variables if variable.key == HARDNESS), None)
    if HARDNESS in tolerances:
        nominal = tolerances[HARDNESS].nominal
    task = StudyTask(
        case=run.path.absolute(),
        overrides=run.overrides,
        keys=tuple(keys),
        answers=(),
        material=fit_to_coupons(run, case).material if case.needs_fit else None,
        hardness=nominal,
    )
    start = []
    for searched in variables:
        # The case's value of a key, or the middle of the key's bounds if the case has none within them.
        value = float("nan")
        with suppress(NoAnswer):
            value = number_at(searched.key, case_json(case))
        start.append(value if searched.low <= value <= searched.high else float(searched.nominal))
    with pool(workers if workers or scheduler or starts > 1 else 1, scheduler) as shared:
        if shared is None:
            # This rank has answered until the first one left the context.
            return DONE
        with run.timer("design"), work_progress(run, "searches") as progress:
            result = find(
                case,
                task,
                variables,
                targets,
                shared,
                start=start,
                starts=starts,
                seed=seed,
                tolerances=tolerances,
                notify=progress,
                tables=run.tables,
            )
    run.deliver(result)
    return NEGATIVE if strict and not all(target.is_met for target in result.targets) else DONE


def _tolerances(case: Case, texts: tuple[str, ...]) -> dict[str, Toleranced]:
    """Return the tolerances of the case file and of ``--tolerance``, by key."""
    from bushcli.case import case_json
    from bushcli.case.tolerance import Toleranced, toleranced_number
    from bushcli.study.answers import NoAnswer, number_at

    tolerances = dict(case.toleranced)
    for text in texts:
        key, _, spec = (part.strip() for part in text.partition("="))
        tolerance = toleranced_number(spec)
        try:
            if tolerance is None:
                tolerance = Toleranced(number_at(key, case_json(case)), float(spec))
        except NoAnswer:
            expected = f'"{key}=NOMINAL +- DEVIATION"'
            raise InputError(Problem(f"--tolerance {text}", f"the case has no {key}", "", expected)) from None
        except ValueError:
            tolerance = None
        if tolerance is None or not tolerance.deviation > 0.0:
            expected = 'geometry.length=0.3, or "hardness=60 +- 5"'
            raise InputError(Problem(f"--tolerance {text}", "is not KEY=DEVIATION", "", expected))
        tolerances[key] = tolerance
    return tolerances
