"""All ways of setting up use one list of packages; set-up says in one sentence what is wrong."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pip
import pytest
from packaging.requirements import Requirement

from geometry.dolfinx_api import TRIED

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


def test_dolfinx_is_bounded_to_the_releases_that_were_tried():
    (major, minor), (last_major, last_minor) = TRIED
    bounds = f">={major}.{minor},<{last_major}.{last_minor + 1}"
    assert ["python3-dolfinx-real", f"fenics-dolfinx{bounds}"] in ROWS
    # The shell script and the check of interpreters read the bounds there.
    script = f'source "{CHECKOUT}/setup/lib.sh"; echo ">=$oldest_dolfinx,<$next_dolfinx"'
    run = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == bounds
    probe = [sys.executable, str(CHECKOUT / "setup" / "has_dolfinx.py")]
    assert subprocess.run(probe, capture_output=True, text=True, check=True).stdout.strip() == sys.executable


@pytest.mark.parametrize(("version", "tried"), [("0.8.0", False), ("0.11.0.post0", True), ("0.12.0", False)])
def test_an_interpreter_with_another_dolfinx_is_refused(tmp_path, version, tried):
    (tmp_path / "dolfinx.py").write_text(f'__version__ = "{version}"\n')
    run = subprocess.run(
        [sys.executable, str(CHECKOUT / "setup" / "has_dolfinx.py")],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.returncode == 0) is tried
    assert tried or f"DOLFINx {version} is not a tested release: fenics-dolfinx>=" in run.stderr


def set_up(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", str(CHECKOUT / "setup" / "setup.sh"), *arguments],
        env={**os.environ, "BUSHCLI_SUITE": "", **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_unknown_way_is_refused(tmp_path):
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=str(tmp_path / "home"), BUSHCLI_WAY="conda")
    assert run.returncode == 1
    assert "BUSHCLI_WAY=conda is not a way of setting up: python, apt or root." in run.stderr


def test_unknown_suite_is_refused(tmp_path):
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=str(tmp_path / "home"), BUSHCLI_SUITE="bookworm")
    assert run.returncode == 1
    assert "BUSHCLI_SUITE=bookworm is not a release bushcli was tried on: trixie, sid." in run.stderr


def test_a_suite_and_a_way_that_has_none_are_refused(tmp_path):
    home = str(tmp_path / "home")
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=home, BUSHCLI_SUITE="sid", BUSHCLI_WAY="apt")
    assert run.returncode == 1
    assert "BUSHCLI_SUITE=sid asks for an isolated root, BUSHCLI_WAY=apt for none" in run.stderr


def test_each_suite_has_an_environment_of_its_own(tmp_path):
    (tmp_path / "setup").mkdir()
    shutil.copy(CHECKOUT / "setup" / "enter", tmp_path / "setup")
    for name in (".venv", ".venv-sid"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "enter").write_text(f'#!/bin/sh\necho {name} "$@"\n')
        (tmp_path / name / "enter").chmod(0o755)

    def entered(suite):
        run = subprocess.run(
            [tmp_path / "setup" / "enter", "x"],
            env=os.environ | {"BUSHCLI_SUITE": suite},
            capture_output=True,
            text=True,
            check=False,
        )
        return run.stdout.strip() or run.stderr.strip()

    assert [entered(suite) for suite in ("", "trixie", "sid")] == [".venv x", ".venv x", ".venv-sid x"]
    assert entered("forky") == 'there is no environment .venv-forky yet: run "make setup SUITE=forky"'


def test_unwritable_home_is_refused(tmp_path):
    (tmp_path / "file").touch()
    run = set_up(str(tmp_path / "venv"), BUSHCLI_HOME=str(tmp_path / "file"))
    assert run.returncode == 1
    assert f"cannot write in {tmp_path / 'file'}" in run.stderr


# -- packages are verified -------------------------------------------------------------------------------------------

LOCK = CHECKOUT / "setup" / "requirements.lock"
LOCKED = re.findall(r"^([\w.-]+)==(\S+)(.*?)(?=^\S|\Z)", LOCK.read_text(), re.MULTILINE | re.DOTALL)


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def test_every_package_of_the_lock_file_has_hashes():
    assert len(LOCKED) > 80
    assert [name for name, _, rest in LOCKED if not re.search(r"--hash=sha256:[0-9a-f]{64}\b", rest)] == []


@pytest.mark.parametrize(
    "requirement",
    [
        *PROJECT["dependencies"],
        *(one for extra in PROJECT["optional-dependencies"].values() for one in extra),
        *(
            line.partition("#")[0].strip()
            for line in (CHECKOUT / "setup" / "build.in").read_text().splitlines()
        ),
    ],
)
def test_the_lock_file_has_what_is_asked_for(requirement):
    if not requirement or requirement.startswith("bushcli["):
        return
    asked = Requirement(requirement)
    versions = [version for name, version, _ in LOCKED if canonical(name) == canonical(asked.name)]
    assert any(asked.specifier.contains(version) for version in versions), f'{requirement}: run "make lock"'


def test_nothing_is_installed_that_is_not_verified():
    texts = {path: path.read_text() for path in [*(CHECKOUT / "setup").iterdir(), CHECKOUT / "Dockerfile"]}
    for path, text in texts.items():
        assert not re.search(r"unauthenticated|trusted=|no-check-gpg|trusted-host|AllowInsecure", text), path
    # pip installs only packages whose hash is given, or this checkout without its requirements.
    installs = re.findall(r"pip_install (?!\(\))(.*)", texts[CHECKOUT / "setup" / "venv.sh"])
    assert installs
    assert all("--no-deps" in line for line in installs)
    assert all("--require-hashes" in line or "${target[@]}" in line for line in installs)


def locked(*names: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(CHECKOUT / "setup" / "locked.py"), *names],
        capture_output=True,
        text=True,
        check=False,
    )


def test_what_is_there_is_not_taken_from_the_lock_file():
    run = locked("bushcli[dev]", "hatchling", "setuptools")
    assert (run.returncode, run.stdout) == (0, ""), run.stderr


def test_an_installed_bushcli_has_its_optional_parts():
    """`make install` and the container request the optional parts that the messages of the program name."""
    extras = PROJECT["optional-dependencies"]
    script = (CHECKOUT / "setup" / "venv.sh").read_text()
    named = re.search(r"extras=\$\{EXTRAS-([\w,]+)\}", script)[1]
    assert f'"bushcli[{named}]"' in (CHECKOUT / "Dockerfile").read_text()
    assert set(named.split(",")) == set(extras) - {"dev", "slurm"}
    assert locked(f"bushcli[{named}]").returncode == 0


def test_what_the_lock_file_lacks_is_said():
    run = locked("no-such-package>=2")
    assert run.returncode == 1
    assert run.stderr.strip() == 'setup/requirements.lock has no no-such-package>=2: run "make lock"'


def test_what_is_missing_is_taken_with_all_it_needs(tmp_path):
    """In an empty environment: the same versions and hashes, and no more packages than needed."""
    venv.create(tmp_path / "empty", system_site_packages=False, with_pip=False)
    # The script reads versions with a library that pip bundles.
    code = "import sys, runpy; sys.path.append(sys.argv.pop(1)); runpy.run_path(sys.argv.pop(1), run_name='__main__')"
    script = str(CHECKOUT / "setup" / "locked.py")
    (tmp_path / "pip").symlink_to(Path(pip.__file__).parent)
    run = subprocess.run(
        [tmp_path / "empty" / "bin" / "python", "-c", code, str(tmp_path), script, "jinja2>=3.1"],
        capture_output=True,
        text=True,
        check=True,
    )
    named = re.findall(r"^([\w.-]+)==", run.stdout, re.MULTILINE)
    assert named == ["jinja2", "markupsafe"]
    assert run.stdout.count("--hash=sha256:") > 10
