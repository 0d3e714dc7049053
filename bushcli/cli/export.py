"""The `export` command, which writes files for other programs."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from bushcli.cli.identification import fit_to_coupons
from bushcli.cli.progress import march_progress
from bushcli.cli.run import DONE, Run, number_of_ranks, on_a_case
from bushcli.cli.shared import PositiveNumber
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.export.curves import BushingData


@click.command()
@click.option(
    "--to",
    "program",
    required=True,
    metavar="PROGRAM",
    help="Material card: abaqus, ansys, calculix, febio, lsdyna, marc, radioss. Vehicle model: adams, altair, chrono, "
    "csv, json, fmu2, fmu3; over frequency: nastran, csv_dynamic.",
)
@click.option(
    "--units",
    "system",
    default="N-mm-s",
    show_default=True,
    metavar="SYSTEM",
    help="N-mm-s, SI, kN-mm-ms, N-mm-ms or lbf-in-s.",
)
@click.option(
    "--density",
    type=PositiveNumber(),
    metavar="KG_PER_M3",
    help="Density of the rubber, for cards.  [default: material.density of the case]",
)
@click.option(
    "--viscoelastic",
    "form",
    default="time-prony",
    show_default=True,
    metavar="FORM",
    help="Viscoelasticity of a card: time-prony, or of abaqus frequency-prony, frequency-tabular.",
)
@click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    help="Leave an effect of the case out; may be given several times.",
)
@click.option(
    "--unrelaxed",
    is_flag=True,
    help="Of adams, altair and chrono: curves and stiffness as in a sudden step, not after a long rest.",
)
@functools.partial(on_a_case, into="FILE", writes="Write this file; without it the text goes to stdout.")
def export(
    run: Run,
    program: str,
    system: str,
    density: float | None,
    form: str,
    without: tuple[str, ...],
    unrelaxed: bool,
) -> int:
    """Write CASE for another program: a material card, a vehicle model, dynamic stiffness, a force law.

    CASE is a case file, or a folder that `direct`, `dynamic`, `fit`, `inverse` or `diagnose` wrote with -o: then the
    identified rubber and effects are exported. The text goes to FILE with -o FILE, else to stdout. What a program
    cannot express is refused by name.
    """
    from bushcli.export import Order, read_source, unit_system, writer_for
    from bushcli.export.bushing import bushing_of
    from bushcli.export.file import check_file, write_file
    from bushcli.export.rubber import rubber_of
    from bushcli.report.json.common import result_json

    if number_of_ranks() > 1:
        raise InputError(Problem("bushcli export", "runs in one process only", "", "run it without mpirun"))
    writer, units = writer_for(program), unit_system(system)
    writer.check_form(form)
    if unrelaxed and not writer.static:
        what = f"{writer.name} has no single state: its file has the memory of the rubber, or the curves as they are"
        raise InputError(Problem("--unrelaxed", what, "", "leave it out; it is for adams, altair and chrono"))
    if run.output is not None:
        check_file(run.output)
    if writer.kind == "force_law" and run.output is None:
        raise InputError(Problem("bushcli export", "an FMU is an archive, not text", "", "-o FILE.fmu"))
    if run.json and run.output is None:
        raise InputError(Problem("--json", "needs a file for the export itself", "", "-o FILE"))
    source = read_source(run.path, run.overrides, run.tables).without(without)
    if source.case.needs_fit and writer.kind != "matrix":
        if not source.case.coupons:
            what = f"has no parameters of {source.case.material.law}, and no coupon tests to fit it to"
            remedy = "run `bushcli inverse CASE -o OUT`, then export OUT"
            raise InputError(Problem(source.where, what, "", remedy))
        fitted = fit_to_coupons(run, source.case)
        source = replace(source, case=replace(source.case, material=fitted.material))
    order = Order(source.case.title, source.where, units, form=form)
    if writer.kind == "card":
        material = rubber_of(source.case.material, source.case.effects)
        writer.check(material, form)
        order = replace(order, rubber=replace(material, density=density or material.density))
    else:
        # Curves and matrices that the source lacks are simulated.
        with run.timer("solve"), march_progress(run) as progress:
            order = replace(order, bushing=bushing_of(source, writer, progress, run.tables, unrelaxed))
    content = writer.text(order)
    if run.output is not None:
        write_file(run.output, content)
        for line in (f"wrote {run.output} for {writer.title}", *_remarks(order.bushing)):
            run.say(line)
        entries: dict[str, Any] = {"program": writer.name, "units": units.name, "file": str(run.output)}
        if order.bushing.law is not None:
            entries["force_law"] = order.bushing.law.summary()
        run.emit(result_json("export", source.case, (), entries, run.timings()))
    else:
        click.echo(content.decode("ascii"), nl=False)
    return DONE


def _remarks(bushing: BushingData) -> list[str]:
    """Return what a vehicle model leaves out, and how far a force law is from the bushing, a line per channel."""
    remarks = list(bushing.remarks)
    for channel in bushing.law.channels if bushing.law is not None else ():
        remarks.append(
            f"{channel.name}: the force law deviates by {channel.rms_percent:.2g} % of the force range (rms; at most "
            f"{channel.peak_percent:.2g} %) from a simulation that was not used to fit it"
        )
        if channel.sines:
            stiffness, angle = (
                max(map(abs, errors)) for errors in zip(*(s.errors for s in channel.sines), strict=True)
            )
            remarks.append(
                f"{channel.name}: its dynamic stiffness deviates by at most {stiffness:.2g} %, its loss angle by "
                f"{angle:.2g} degrees, from {len(channel.sines)} vibrations along time, up to all of the travel"
            )
    return remarks
