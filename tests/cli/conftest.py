"""The command line: its two streams and its exit code, in this process or in one of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bushcli.cli import main

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "batch"
Cli = Callable[..., subprocess.CompletedProcess[str]]

# A coarse case that solves in a fraction of a second: numbers are not what these tests are about.
SMALL = """
title = "small"
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[mesh]
elements_across = 2
elements_along = 4
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.2087
C20 = -0.0108
C30 = 0.00074
[[recordings]]
mode = "axial"
file = "axial.csv"
"""


@pytest.fixture
def command_line() -> Cli:
    """Run bushcli as a user does, for tests of the process itself: its start, its workers, what libraries print."""

    def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "bushcli.cli", *map(str, arguments)],
            capture_output=True,
            text=True,
            cwd=cwd or ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            check=False,
            timeout=300,
        )

    return run


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Cli:
    """Run bushcli in this process, which has loaded the libraries; its signals are not this process's."""

    def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
        words = [*map(str, arguments)]
        with monkeypatch.context() as patch:
            patch.setattr(sys.modules["bushcli.cli.run"], "listen", lambda: None)
            patch.chdir(cwd or ROOT)
            with pytest.raises(SystemExit) as ended:
                main(words)
        streams = capsys.readouterr()
        return subprocess.CompletedProcess(words, ended.value.code, streams.out, streams.err)  # type: ignore[arg-type]

    return run


@pytest.fixture
def inside(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run bushcli in this process, which takes a hundredth of the time; its signals are not this process's."""
    monkeypatch.setattr(sys.modules["bushcli.cli.run"], "listen", lambda: None)

    def run(*arguments: object) -> Result:
        return CliRunner().invoke(main, [*map(str, arguments)])

    return run


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A small case with one recording, in its own folder."""
    shutil.copy(EXAMPLE / "axial.csv", tmp_path)
    case = tmp_path / "case.toml"
    case.write_text(SMALL, encoding="utf-8")
    return case
