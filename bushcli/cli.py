"""The command line: reads arguments, calls the functions that do the work, prints. The only module that prints.

Data go to stdout, narration and progress to stderr. What a command needs is imported inside it, so that --help answers
at once. Under MPI every rank does the same and the first one speaks.
"""

from __future__ import annotations

import functools
import json as json_format
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bushcli import __version__
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.casefile import Case
    from bushcli.inverse import Fit

DONE, NEGATIVE, WRONG_INPUT, NOT_CONVERGED = 0, 1, 2, 3


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="bushcli")
def main() -> None:
    """Simulate rubber bushings and correlate them with test-rig recordings.

    A case file (TOML) says what the bushing is and which recordings and coupon tests there are; `bushcli init` writes
    an example. Units are N, mm, MPa, s and degrees.

    Exit codes: 0 done; 1 done, but the verdict is negative and --strict was given; 2 usage, case file or recording;
    3 a simulation did not converge.
    """


class Run:
    """Options that every command on a case shares."""

    def __init__(
        self,
        case: Path,
        overrides: tuple[str, ...],
        output: Path | None,
        json: bool,
        quiet: bool,
        verbose: bool,
    ) -> None:
        self.path, self.overrides, self.output = case, overrides, output
        self.json, self.quiet, self.verbose = json, quiet, verbose
        self.begin = time.perf_counter()
        self.seconds: dict[str, float] = {}

    def load(self) -> Case:
        """Read and validate the case."""
        from bushcli.casefile import load_case

        if self.output is not None and self.output.exists() and not self.output.is_dir():
            raise InputError(Problem(str(self.output), "is a file", "", "a folder for the results"))
        with self.timed("case"):
            return load_case(self.path, self.overrides)

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Add the time of a block to the timings."""
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def timings(self) -> dict[str, float]:
        """Seconds by stage, and the total so far."""
        return {**self.seconds, "total": time.perf_counter() - self.begin}

    def say(self, text: str) -> None:
        """Narrate on stderr, unless quiet."""
        if not self.quiet and _speaks():
            click.echo(text, err=True)

    def show(self, *renderables: Any) -> None:
        """Print results for people on stdout; nothing where JSON is asked for."""
        if self.json or not _speaks():
            return
        from rich.console import Console

        terminal = sys.stdout.isatty()
        console = Console(
            width=None if terminal else 120, highlight=False, no_color=None if terminal else True
        )
        for renderable in renderables:
            console.print(renderable)

    def emit(self, result: dict[str, Any]) -> None:
        """Print the result as JSON on stdout if asked to."""
        if self.json and _speaks():
            click.echo(json_format.dumps(result, indent=2, allow_nan=False))


def _speaks() -> bool:
    """Whether this process is the first rank; without MPI it is."""
    if "mpi4py.MPI" not in sys.modules:
        return True
    from mpi4py import MPI

    return bool(MPI.COMM_WORLD.rank == 0)


def on_a_case(command: Callable[..., int | None]) -> Callable[..., None]:
    """Give a command the CASE argument and the common options, and turn its errors into exit codes."""

    @click.argument("case", type=click.Path(path_type=Path))
    @click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        help="Override a key of the case file, e.g. geometry.length=38.",
    )
    @click.option(
        "-o",
        "--output",
        type=click.Path(path_type=Path),
        metavar="DIR",
        help="Write result.json, report.html, curves, plots and fields there.",
    )
    @click.option("--json", is_flag=True, help="The result as JSON on stdout, nothing else there.")
    @click.option("-q", "--quiet", is_flag=True, help="No narration and no progress.")
    @click.option("-v", "--verbose", is_flag=True, help="Say more: every step of the march.")
    @click.option("--debug", is_flag=True, help="Show a traceback on errors.")
    @functools.wraps(command)
    def wrapper(
        case: Path,
        overrides: tuple[str, ...],
        output: Path | None,
        json: bool,
        quiet: bool,
        verbose: bool,
        debug: bool,
        **options: Any,
    ) -> None:
        run = Run(case, overrides, output, json, quiet, verbose)
        _finish(lambda: command(run, **options), debug)

    return wrapper


def _finish(work: Callable[[], int | None], debug: bool) -> None:
    """Run, and exit with the code that interface and errors ask for; no traceback unless `debug`."""
    # A pipeline that ends early (`| head`) is no error of ours, and SIGTERM ends like Ctrl-C.
    signal.signal(signal.SIGTERM, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))
    try:
        code = work() or DONE
    except InputError as error:
        if debug:
            raise
        if _speaks():
            click.echo(f"error: {error}", err=True)
        code = WRONG_INPUT
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        code = 130
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - the interpreter flushes it at exit
        code = DONE
    except Exception as error:  # the last line of defence between a traceback and a user
        if debug:
            raise
        if _speaks():
            click.echo(f"internal error: {type(error).__name__}: {error}", err=True)
            click.echo("this is a mistake in bushcli; --debug shows where", err=True)
        code = 70
    sys.exit(code)


# -- commands --------------------------------------------------------------------------------------------------------


@main.command()
@click.argument("directory", type=click.Path(path_type=Path), default=".")
def init(directory: Path) -> None:
    """Write a commented example case with its recordings into DIRECTORY."""

    def work() -> int:
        from bushcli.example import write_example

        for file in write_example(directory):
            click.echo(str(file))
        click.echo(f"try: bushcli direct {directory / 'case.toml'} -o {directory / 'out'}", err=True)
        return DONE

    _finish(work, debug=False)


@main.command()
@on_a_case
def check(run: Run) -> int:
    """Validate CASE and its recordings, print a summary, solve nothing."""
    from bushcli import report
    from bushcli.direct import check_material
    from bushcli.recording import read_coupon, read_recording

    case = run.load()
    curves = [read_recording(source) for source in case.recordings]
    coupons = [read_coupon(source) for source in case.coupons]
    if not case.needs_fit:
        check_material(case, case.material)
    run.show(report.case_text(case, curves, coupons))
    run.emit(report.case_json(case, curves, coupons, run.timings()))
    return DONE


@main.command()
@on_a_case
def mesh(run: Run) -> int:
    """Build the meshes that CASE needs; a picture and a file for ParaView of each."""
    from bushcli import report
    from bushcli.meshes import meshes

    case = run.load()
    output = run.output or Path("out")
    with run.timed("mesh"):
        built = meshes(case, output)
    run.show(report.mesh_text(built))
    run.emit(report.mesh_json(case, built, run.timings()))
    if _speaks():
        report.write_meshes(output, built)
        run.say(f"wrote {output}")
    return DONE


weighted = click.option(
    "--weighting",
    type=click.Choice(["relative", "absolute"]),
    default="relative",
    show_default=True,
    help="Coupon misfit over the stress itself, or over the coupon's largest stress.",
)


@main.command()
@click.option("--model", metavar="LAW", help="Law to fit instead of the case's.")
@weighted
@click.option("--strict", is_flag=True, help="Exit 1 when the fit has problems.")
@on_a_case
def fit(run: Run, model: str | None, weighting: str, strict: bool) -> int:
    """Identify the law of CASE from its coupon tests."""
    from bushcli import report

    case = run.load()
    found = _fit(run, case, model, weighting)
    result = report.fit_json(case, found, run.timings())
    run.show(report.fit_text(found))
    run.emit(result)
    if run.output and _speaks():
        report.write_fit(run.output, result, case, found)
        run.say(f"wrote {run.output}")
    return NEGATIVE if strict and found.conditions else DONE


def _fit(run: Run, case: Case, model: str | None, weighting: str) -> Fit:
    from bushcli.inverse import fit_coupons

    law = model or case.material.law
    run.say(f"fitting {law} to {len(case.coupons)} coupon test{'s' if len(case.coupons) != 1 else ''}")

    def progress(number: int, rms: float, parameters: Any) -> None:
        if run.verbose:
            shown = "  ".join(f"{name} {value:.5g}" for name, value in parameters.items())
            run.say(f"  evaluation {number}: rms {rms:.3f} %  {shown}")

    with run.timed("fit"):
        return fit_coupons(case, model, weighting=weighting, progress=progress)  # type: ignore[arg-type]


@main.command()
@weighted
@click.option(
    "--mesh-check",
    is_flag=True,
    help="Solve again on a finer mesh and say how well the curves are converged.",
)
@click.option("--no-fields", is_flag=True, help="With -o: no field files (they are the largest).")
@click.option(
    "--strict", is_flag=True, help="Exit 1 when a simulated curve is not within 10 % of its recording."
)
@on_a_case
def direct(run: Run, weighting: str, mesh_check: bool, no_fields: bool, strict: bool) -> int:
    """Predict the curves of CASE and correlate them with its recordings.

    A law without parameters is fitted to the coupon tests first.
    """
    from bushcli import report
    from bushcli.direct import predict
    from bushcli.misfit import misfits

    case = run.load()
    found = _fit(run, case, None, weighting) if case.needs_fit else None
    with run.timed("solve"), _progress(run) as progress:
        response = predict(
            case,
            found.material if found else None,
            mesh_check=mesh_check,
            fields=run.output if run.output and not no_fields else None,
            progress=progress,
        )
    compared = misfits(response)
    result = report.direct_json(response, compared, found, run.timings())
    run.show(report.direct_text(response, compared, found))
    run.emit(result)
    if run.output and _speaks():
        report.write_direct(run.output, result, response, compared, found)
        run.say(f"wrote {run.output}")
    if not response.complete:
        return NOT_CONVERGED
    good = all(misfit.within_10_percent for misfit in compared.values())
    return NEGATIVE if strict and not good else DONE


@contextmanager
def _progress(run: Run) -> Iterator[Callable[[str, int, int, int, float], None] | None]:
    """Progress of the march: a bar with step, Newton count and time left on a terminal, plain lines when piped."""
    if run.quiet or not _speaks():
        yield None
        return
    if not sys.stderr.isatty() or run.verbose:
        begin: dict[str, float] = {}

        def line(name: str, step: int, steps: int, newton: int, q: float) -> None:
            start = begin.setdefault(name, time.perf_counter())
            if not run.verbose and step not in {steps, *(round(steps * share / 4) for share in (1, 2, 3))}:
                return
            spent = time.perf_counter() - start
            left = spent / step * (steps - step)
            run.say(f"{name}: step {step}/{steps}, {newton} Newton iterations, {left:.0f} s left")

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:12s}"),
        BarColumn(),
        TextColumn("step {task.completed:.0f}/{task.total:.0f}, {task.fields[newton]} Newton,"),
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


@main.command("list")
@click.argument("kind", type=click.Choice(["laws", "shapes", "modes"]))
@click.option("--json", is_flag=True, help="As JSON on stdout.")
def list_(kind: str, json: bool) -> None:
    """Print what there is: laws with their parameters, shapes with their dimensions, modes."""

    def work() -> int:
        from bushcli import catalogue

        if json:
            click.echo(json_format.dumps(catalogue.as_json(kind), indent=2, allow_nan=False))
        else:
            click.echo(catalogue.as_text(kind))
        return DONE

    _finish(work, debug=False)


@main.command()
@click.option("--json", is_flag=True, help="As JSON on stdout.")
def doctor(json: bool) -> None:
    """Versions, BLAS, MPI, compiler and cache: what is there, and what is missing."""

    def work() -> int:
        from bushcli.doctor import examine

        found = examine()
        if json:
            problems = [vars(problem) for problem in found.problems]
            click.echo(json_format.dumps({"facts": dict(found.facts), "problems": problems}, indent=2))
        else:
            width = max(map(len, found.facts))
            for name, fact in found.facts.items():
                click.echo(f"{name:{width}s}  {fact}")
            for problem in found.problems:
                click.echo(f"problem: {problem.message}\n  remedy: {problem.remedy}")
        return NEGATIVE if found.problems else DONE

    _finish(work, debug=False)


if __name__ == "__main__":
    main()
