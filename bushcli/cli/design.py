"""The `design` command, which finds a geometry for target rates."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import click

from bushcli.cli.identification import fit_to_coupons
from bushcli.cli.progress import work_progress
from bushcli.cli.run import DONE, NEGATIVE, Run, on_a_case
from bushcli.cli.shared import pool, worker_options
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.case.toleranced import Toleranced


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
@click.option(
    "--starts", type=click.IntRange(1, 1000), default=1, show_default=True, help="Number of start points."
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the start points."
)
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
    from bushcli.case.toleranced import Toleranced, toleranced_number
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
