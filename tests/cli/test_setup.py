"""The one list of packages serves all ways of setting up; set-up says what is wrong in one sentence."""

from __future__ import annotations

import os
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
LIST = CHECKOUT / "setup" / "packages.txt"
ROWS = [line.split() for line in LIST.read_text().splitlines() if line and not line.startswith("#")]
PROJECT = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]


def test_every_row_names_both_distributions():
    assert [row for row in ROWS if len(row) != 2] == []


def test_conda_environment_is_the_second_column():
    lines = (CHECKOUT / "environment.yml").read_text().splitlines()
    named = [line[4:] for line in lines[lines.index("dependencies:") + 1 :]]
    assert named == [conda for _, conda in ROWS if conda != "-"] + ["make"]


@pytest.mark.parametrize("requirement", PROJECT["dependencies"])
def test_what_the_program_imports_comes_from_both_distributions(requirement):
    name = re.split(r"[<>=]", requirement)[0]
    assert [f"python3-{name}", requirement] in ROWS


def test_container_installs_from_the_list_and_nothing_else():
    text = (CHECKOUT / "Dockerfile").read_text()
    assert "COPY setup/packages.txt" in text
    assert not [debian for debian, _ in ROWS if "-" in debian[1:] and re.search(rf"\b{debian}\b", text)]


def test_oldest_python_is_the_one_that_set_up_accepts():
    assert PROJECT["requires-python"] == ">=3.11"
    assert "(3, 11)" in (CHECKOUT / "setup" / "has_dolfinx.py").read_text()


def set_up(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", str(CHECKOUT / "setup" / "setup.sh"), *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_unknown_way_is_refused(tmp_path):
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=str(tmp_path / "home"), BUSHCLI_WAY="conda")
    assert run.returncode == 1
    assert "BUSHCLI_WAY=conda is not a way of setting up: python, apt or root." in run.stderr


def test_unwritable_home_is_refused(tmp_path):
    (tmp_path / "file").touch()
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=str(tmp_path / "file"))
    assert run.returncode == 1
    assert f"cannot write in {tmp_path / 'file'}" in run.stderr
