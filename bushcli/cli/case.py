"""Commands that simulate a case: check, mesh, direct, dynamic."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bushcli.cli.identification import fit_to_coupons, weighted
from bushcli.cli.progress import march_progress
from bushcli.cli.run import DONE, NEGATIVE, NOT_CONVERGED, Run, is_first_rank, on_a_case
from bushcli.errors import InputError, Problem
from geometry.errors import GeometryError

if TYPE_CHECKING:
    from bushcli.recording.dynamic.table import DynamicTable
    from bushcli.recording.source import Quantity
    from bushcli.runtime.condition import Condition
    from bushcli.simulate.dynamic_tables import ComparedTable


@click.command()
@click.option(
    "--strict",
    is_flag=True,
    help="Exit 1 when a recording has a fault or does not meet the standard that it names, or a number is unusual.",
)
@on_a_case
def check(run: Run, strict: bool) -> int:
    """Validate CASE and its recordings, print a summary, solve nothing.

    The summary includes faults of the recordings, such as wrong units or spikes, each with its remedy; cycles, rates
    and holds, beside what a standard asks for; and the questions that the recordings cannot answer.
    """
    from bushcli.case.hardness import known_from_hardness
    from bushcli.case.load import unedited_lines
    from bushcli.case.temperatures import unused_temperatures
    from bushcli.case.typical import unusual_values
    from bushcli.faults import find_faults
    from bushcli.faults.dynamic import table_faults
    from bushcli.recording import read_program, read_recording
    from bushcli.recording.dynamic.read import read_dynamic
    from bushcli.report.results import CheckResult
    from bushcli.runtime.dolfinx_version import installed_dolfinx, untried_dolfinx
    from bushcli.simulate.admissible import check_material, check_travel
    from bushcli.simulate.play import check_play, check_play_of_load_cases
    from bushcli.standards.protocol import protocol

    case = run.load()
    curves = [read_recording(source, tables=run.tables) for source in (*case.recordings, *case.specimens)]
    coupons = [read_recording(source, run.tables) for source in case.coupons]
    tables = [read_dynamic(source, run.tables) for source in case.dynamic]
    # What is not compared is simulated: its contents and its faults count too.
    records, materials = [curve.record for curve in curves], [curve.record for curve in coupons]
    if not case.needs_fit:
        check_material(case, case.material)
    for curve in records:
        check_play(case, curve.name, curve.mode, curve.displacement)
    check_play_of_load_cases(case, run.tables)
    programs = []
    for load_case in case.load_cases:
        program = None
        if load_case.source is not None:
            quantity: Quantity = "force" if load_case.by_force else "displacement"
            program = replace(read_program(load_case.source, run.tables, quantity), name=load_case.label)
        programs.append(program)
    run.tables.clear()  # all is read: what the search for faults needs is not taken by the texts
    faults = (*find_faults(case, [*records, *materials]), *table_faults(case.geometry, tables))
    if not any(fault.fatal for fault in faults):
        check_travel(case, records, faults)
    forced = {load_case.label for load_case in case.load_cases if load_case.by_force}
    displacement_programs = [read for read in programs if read is not None and read.name not in forced]
    doubts = unusual_values(case, case.material, (*records, *materials, *displacement_programs))
    conditions = (
        *unedited_lines(case.path),
        *known_from_hardness(case.material),
        *untried_dolfinx(installed_dolfinx()),
        *doubts,
        *unused_temperatures(case, (*records, *materials)),
    )
    tests = protocol(case, curves, coupons, displacement_programs)
    checked = CheckResult(case, records, materials, tests, faults, programs, conditions, tables)
    run.deliver(checked)
    return NEGATIVE if strict and (faults or tests.is_violated or doubts) else DONE


@click.command()
@on_a_case
def mesh(run: Run) -> int:
    """Build the meshes that CASE needs, and write a picture and a file for ParaView of each.

    CASE may also be a part: a STEP, BREP, DXF, MSH or INP file. Its axis, bonds and symmetry are found and shown, and a
    case file to start from is written.
    """
    from bushcli.case import starter_case
    from bushcli.report.results import MeshResult
    from bushcli.report.writers.files import BEGINNING, write_refused, write_starter_case
    from bushcli.report.writers.folder import STAGING
    from bushcli.simulate.meshes import meshes

    output = run.write_into(Path("out"))
    try:
        case = run.load(parts=True)
        with run.timer("mesh"):
            built = meshes(case, output / STAGING)
    except GeometryError as error:
        if is_first_rank():
            with suppress(InputError):  # the geometry is what has to be said
                for picture in write_refused(output, error)[:1]:
                    run.say(f"see the picture {picture}")
        raise
    run.deliver(MeshResult(case, built))
    part = case.path.suffix != ".toml"
    if part and is_first_rank() and write_starter_case(output, starter_case(case, output)):
        run.say(f"wrote {output / BEGINNING}: a case file to start from; enter your rubber and loads")
    return DONE


@click.command()
@weighted
@click.option(
    "--mesh-check",
    is_flag=True,
    help="Solve again on a finer mesh and estimate the discretisation error of the curves.",
)
@click.option(
    "--stiffness-matrix",
    is_flag=True,
    help="Add the 6 x 6 tangent stiffness of the inner sleeve at rest and at the end of every channel.",
)
@click.option(
    "--stiffness-at",
    type=float,
    metavar="TRAVEL",
    help="Add the tangent stiffness at this travel too: mm or degrees; a time in s on a path of six motions.",
)
@click.option(
    "--unrelaxed",
    is_flag=True,
    help="Stiffness matrices as in a sudden step; without it those after a long rest. Friction is in neither.",
)
@click.option("--no-fields", is_flag=True, help="With -o: write no field files, which are the largest.")
@click.option(
    "--strict",
    is_flag=True,
    help="Exit 1 when a simulated curve or dynamic stiffness is not within the tolerance of its recording.",
)
@on_a_case
def direct(
    run: Run,
    weighting: str,
    mesh_check: bool,
    stiffness_matrix: bool,
    stiffness_at: float | None,
    unrelaxed: bool,
    no_fields: bool,
    strict: bool,
) -> int:
    """Predict the curves of CASE and correlate them with its recordings.

    A law without parameters is fitted to the coupon tests first.
    """
    from bushcli.report.results import DirectResult
    from bushcli.simulate.misfit import misfits
    from bushcli.simulate.predict import predict
    from bushcli.simulate.prediction_cache import PredictionCache
    from bushcli.simulate.recording_cache import RecordingCache
    from bushcli.simulate.response import PredictionInterrupted
    from cases.mode import modes

    if unrelaxed and not stiffness_matrix and stiffness_at is None:
        what = "is a state of stiffness matrices, and none is asked for"
        raise InputError(Problem("--unrelaxed", what, "", "add --stiffness-matrix, or leave it out"))
    case = run.load()
    # Tables of coupons are fitted, not compared.
    tables = [source for source in case.dynamic if modes()[source.mode].specimen == "bushing"]
    read: list[DynamicTable] = []
    if tables:
        from bushcli.recording.dynamic.read import read_dynamic

        read = [read_dynamic(source, run.tables) for source in tables]
    if not case.recordings and not case.load_cases and not tables:
        tables_of_case = "[[recordings]] or [[load_cases]]; vibrations are in `bushcli dynamic`"
        expected = case.expected_tables(tables_of_case)
        raise InputError(Problem(case.path.name, "there is nothing to simulate", "", expected))
    fit = fit_to_coupons(run, case, None, weighting) if case.needs_fit else None
    interrupted = False
    with run.timer("solve"), march_progress(run) as progress:
        try:
            response = predict(
                case,
                fit.material if fit else None,
                mesh_check=mesh_check,
                fields=None if no_fields else run.staging_folder,
                pictures=run.output is not None,
                progress=progress,
                stiffness=stiffness_matrix or stiffness_at is not None,
                stiffness_at=stiffness_at,
                unrelaxed=unrelaxed,
                kept=PredictionCache(measured=RecordingCache(run.tables)),
            )
        except PredictionInterrupted as ended:
            response, interrupted = ended.response, True
    compared = misfits(response)
    vibrations: Sequence[ComparedTable] = ()
    doubts: Sequence[Condition] = ()
    if tables and not interrupted:
        from bushcli.simulate.dynamic_tables import compare_tables

        with run.timer("dynamic"):
            vibrations, doubts = compare_tables(case, response.material, read)
    run.deliver(DirectResult(response, compared, fit, vibrations if tables else None, doubts))
    if interrupted:
        raise KeyboardInterrupt
    if not response.complete or sum(len(vibration.table) for vibration in vibrations) < sum(map(len, read)):
        return NOT_CONVERGED
    good = all(misfit.within for misfit in compared.values())
    good = good and all(vibration.within(case.tolerance) for vibration in vibrations)
    return NEGATIVE if strict and not good else DONE


@click.command()
@weighted
@on_a_case
def dynamic(run: Run, weighting: str) -> int:
    """Compute dynamic stiffness and loss angle of CASE over frequency, about each preload.

    The load cases are those with a table [load_cases.dynamic]. A law without parameters is fitted to the coupon tests
    first. The rubber has relaxed under the preload. The vibration is small, or has the amplitudes that the case gives.
    """
    from bushcli.recording.dynamic.read import read_dynamic
    from bushcli.report.results import DynamicResult
    from bushcli.simulate.dynamic import DynamicInterrupted, vibrate
    from bushcli.simulate.extent import of_table, tested_temperatures

    case = run.load()
    tested = [
        *tested_temperatures(case),
        *(of_table(read_dynamic(source, run.tables)) for source in case.dynamic),
    ]
    fit = fit_to_coupons(run, case, None, weighting) if case.needs_fit else None
    interrupted = False
    with run.timer("solve"), march_progress(run) as progress:
        try:
            response = vibrate(case, fit.material if fit else None, progress=progress, tested=tested)
        except DynamicInterrupted as ended:
            response, interrupted = ended.response, True
    run.deliver(DynamicResult(response, fit))
    if interrupted:
        raise KeyboardInterrupt
    return DONE if response.complete else NOT_CONVERGED
