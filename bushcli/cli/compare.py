"""The `compare` command, which compares results with each other."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bushcli.cli.run import DONE, Run, on_a_case
from bushcli.errors import InputError, Problem

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.study.compare import ComparedResult


@click.command()
@click.argument("before", nargs=-1, required=True, type=click.Path(path_type=Path))
@on_a_case
def compare(run: Run, before: tuple[Path, ...]) -> int:
    """Put results or cases beside each other, two or more, and compare them with the first.

    Each is a folder that a command wrote with -o, or a case file, which is simulated as by `bushcli direct`. The result
    has the keys of the cases and the numbers that differ, and the curves over each other.
    """
    from bushcli.study.compare import compare as compared

    paths = [*before, run.path]
    folders = [path.parent if path.name == "result.json" else path for path in paths]
    if len({path.resolve() for path in folders}) < len(folders):
        raise InputError(Problem(str(paths[-1]), "is given twice", "", "two or more results or cases"))
    # The shortest names that tell the paths apart: their last parts, as many as it takes.
    parts, count = [path.resolve().parts for path in folders], 1
    while len({part[-count:] for part in parts}) < len(parts):
        count += 1
    names = ["/".join(part[-count:]) for part in parts]
    results = [_item(run, path, name) for path, name in zip(paths, names, strict=True)]
    if run.output is not None:
        run.prepare(run.output, results[0][1])
    result = compared([item for item, _ in results])
    run.deliver(result)
    return DONE


def _item(run: Run, path: Path, name: str) -> tuple[ComparedResult, Case]:
    """Return one result, read from its folder or computed from its case."""
    from bushcli.case import load_case
    from bushcli.case.identified import IDENTIFIED
    from bushcli.case.load import RESULT
    from bushcli.case.rebuild import read_result, rebuilt_case
    from bushcli.study.compare import ComparedResult, curves_in

    file = path if path.name == RESULT else path / RESULT
    if file.is_file():
        result = read_result(file)
        try:
            case = rebuilt_case(json.loads(json.dumps(result["case"])), file.parent)
        except (KeyError, TypeError, AttributeError, ValueError):
            what = "is not a complete result of bushcli"
            raise InputError(Problem(str(file), what, "", "run the command again")) from None
        curves = curves_in(result)
        if not curves and (file.parent / IDENTIFIED).is_file():
            try:
                case_found = load_case(file.parent, (), run.tables)
                if case_found.recordings or case_found.load_cases:
                    curves = curves_in(_simulated_item(run, case_found, name))
            except InputError as error:
                run.say(f"{name} is compared without curves: {error}")
        return ComparedResult(name, result, curves), case
    case = load_case(path, run.overrides, run.tables)
    result = _simulated_item(run, case, name)
    return ComparedResult(name, result, curves_in(result)), case


def _simulated_item(run: Run, case: Case, name: str) -> dict[str, Any]:
    """Return the result of `bushcli direct` on a case."""
    from bushcli.report import as_json
    from bushcli.report.results import DirectResult
    from bushcli.simulate.misfit import misfits
    from bushcli.simulate.predict import predict

    run.say(f"simulating {name}")
    with run.timer(name):
        if case.needs_fit:
            from bushcli.cli.identification import fit_to_coupons

            case = replace(case, material=fit_to_coupons(run, case).material)
        response = predict(case, pictures=False)
    return as_json(DirectResult(response, misfits(response)))
