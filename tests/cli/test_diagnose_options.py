"""The options of `bushcli diagnose` reach the diagnosis; nothing is solved."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bushcli.cli import main
from bushcli.diagnosis import diagnose as driver
from bushcli.errors import InputError, Problem

CASE = Path(__file__).parents[2] / "examples" / "batch" / "case.toml"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], {"budget": None, "hold_out": (), "uniform": False}),
        (["--budget", "1.5"], {"budget": 90.0}),
        (["--hold-out", "radial", "--hold-out", "radial"], {"hold_out": ("radial",)}),
        (["--uniform-odds"], {"uniform": True}),
        (["--workers", "3"], {"workers": 3}),
        ([], {"workers": min(len(os.sched_getaffinity(0)), 4)}),
    ],
)
def test_options_reach_the_diagnosis(
    options: list[str], expected: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def diagnose(case: object, **given: Any) -> None:
        asked.update(given)
        raise InputError(Problem("test", "asked enough"))

    monkeypatch.setattr(driver, "diagnose", diagnose)
    done = CliRunner().invoke(main, ["diagnose", str(CASE), *options])
    assert done.exit_code == 2, done.output
    assert expected.items() <= asked.items()


@pytest.mark.parametrize("minutes", ["0", "nan", "inf"])
def test_a_budget_is_some_time(minutes: str) -> None:
    done = CliRunner().invoke(main, ["diagnose", str(CASE), "--budget", minutes])
    assert done.exit_code == 2
    assert "--budget" in done.output


def test_a_density_is_a_number() -> None:
    done = CliRunner().invoke(main, ["export", str(CASE), "--to", "abaqus", "--density", "nan"])
    assert done.exit_code == 2
    assert "nan is not a finite number" in done.output
