"""Commands about the tool itself: init, list, doctor."""

from __future__ import annotations

import json as json_format
from pathlib import Path

import click

from bushcli.cli.run import DONE, NEGATIVE, finish, speaks


@click.command()
@click.argument("directory", type=click.Path(path_type=Path), default=".")
def init(directory: Path) -> None:
    """Write a commented example case with its recordings into DIRECTORY."""

    def work() -> int:
        from bushcli.case.example import write_example

        for file in write_example(directory):
            click.echo(str(file))
        click.echo(f"try: bushcli direct {directory / 'case.toml'} -o {directory / 'out'}", err=True)
        return DONE

    finish(work, debug=False)


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

        found = examine()
        if not speaks():
            return DONE
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

    finish(work, debug=False)
