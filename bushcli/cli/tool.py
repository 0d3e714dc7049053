"""Commands about the tool itself: init, list, doctor."""

from __future__ import annotations

import json as json_format
from pathlib import Path

import click

from bushcli.cli.run import DONE, NEGATIVE, finish, is_first_rank
from bushcli.errors import printable


@click.command()
@click.argument("places", type=click.Path(path_type=Path), nargs=-1, metavar="[DIRECTORY]")
@click.option(
    "--from",
    "files",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE...",
    help="Write a case for these files of a test rig instead of the example.",
)
def init(places: tuple[Path, ...], files: tuple[Path, ...]) -> None:
    """Write a commented example case with its recordings into DIRECTORY.

    With --from FILE..., write a case.toml for these files instead, for you to check and complete: bushcli init --from
    axial.mf4 radial.mf4
    """
    # A new folder has no suffix, a file that does not exist is reported as such.
    folders = [place for place in places if place.is_dir() or not (place.suffix or place.exists())]
    named_files = [place for place in places if place.is_file()]
    if named_files and not files:
        what = f"{named_files[0]} is a file; to write a case for files of a rig: bushcli init --from {named_files[0]}"
        raise click.UsageError(what)
    if len(folders) > 1 or (not files and len(places) > len(folders)):
        raise click.UsageError(f"Got unexpected extra argument ({places[-1]})")
    folder = folders[0] if folders else Path()

    def work() -> int:
        from bushcli.case.example import write_case, write_example

        if files:
            from bushcli.case.from_files import case_from_files

            paths = [*files, *(place for place in places if place not in folders)]
            _say(write_case(folder, case_from_files(paths, folder)))
            _say(f"try: bushcli check {folder / 'case.toml'}", err=True)
            return DONE
        for file in write_example(folder):
            _say(file)
        _say(f"try: bushcli direct {folder / 'case.toml'} -o {folder / 'out'}", err=True)
        return DONE

    finish(work, debug=False)


def _say(text: object, err: bool = False) -> None:
    """Print a text that contains paths, with their control characters escaped."""
    click.echo(printable(str(text)), err=err)


@click.command("list")
@click.argument("kind", type=click.Choice(["laws", "shapes", "modes", "effects"]))
@click.option("--json", is_flag=True, help="As JSON on stdout.")
def list_(kind: str, json: bool) -> None:
    """Print the available laws with their parameters, shapes with their dimensions, modes or effects."""

    def work() -> int:
        from bushcli.case import catalogue

        if json:
            click.echo(json_format.dumps(catalogue.as_json(kind), indent=2, allow_nan=False))
        else:
            click.echo(catalogue.as_text(kind))
        return DONE

    finish(work, debug=False)


@click.command()
@click.option("--json", is_flag=True, help="As JSON on stdout.")
def doctor(json: bool) -> None:
    """Print versions, BLAS, MPI, compiler and cache, and what is missing or slow."""

    def work() -> int:
        from bushcli.runtime.doctor import examine

        examination = examine()
        if not is_first_rank():
            return DONE
        if json:
            problems = [vars(problem) for problem in examination.problems]
            click.echo(json_format.dumps({"facts": dict(examination.facts), "problems": problems}, indent=2))
        else:
            width = max(map(len, examination.facts))
            for name, fact in examination.facts.items():
                _say(f"{name:{width}s}  {fact}")
            for problem in examination.problems:
                _say(f"problem: {problem.message}\n  remedy: {problem.remedy}")
        return NEGATIVE if examination.problems else DONE

    finish(work, debug=False)
