"""A release of DOLFINx with which bushcli was not tested is named at once, by doctor and check."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from bushcli.cli import main
from bushcli.runtime import doctor, dolfinx_version
from geometry.dolfinx_api import release

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "batch" / "case.toml"


@pytest.mark.parametrize("version", ["0.9.0", "0.9.0.post1", "0.10.0.post5", "0.11.0.dev0", "0.11.0.post0"])
def test_nothing_is_said_of_a_release_that_was_tried(version):
    assert dolfinx_version.untried_dolfinx(version) == ()


@pytest.mark.parametrize(
    ("version", "where"),
    [("0.8.0", "older"), ("0.12.0", "newer"), ("0.12.0.dev0", "newer"), ("1.0.0", "newer")],
)
def test_another_release_is_named_with_those_that_were_tried(version, where):
    (found,) = dolfinx_version.untried_dolfinx(version)
    assert found.name == "untried_dolfinx"
    assert (
        f"DOLFINx {version} is {where} than those that bushcli was tested with, 0.9 to 0.11" in found.message
    )
    assert "make setup" in found.remedy


def test_nothing_is_said_where_the_version_is_not_known():
    assert dolfinx_version.untried_dolfinx(None) == ()


def test_the_version_found_without_loading_it_is_the_one_that_is_loaded():
    import dolfinx

    found = dolfinx_version.installed_dolfinx()
    assert found is None or release(found) == release(dolfinx.__version__)
    code = "import sys\n"
    code += "from bushcli.runtime.dolfinx_version import *\ninstalled_dolfinx()\nassert 'dolfinx' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)


def test_doctor_says_it(monkeypatch):
    monkeypatch.setattr("dolfinx.__version__", "0.12.0")
    assert "untried_dolfinx" in {problem.name for problem in doctor.examine().problems}


@pytest.fixture
def newer(monkeypatch):
    monkeypatch.setattr(dolfinx_version, "installed_dolfinx", lambda: "0.12.0")


def test_check_says_it_and_goes_on(newer):
    done = CliRunner().invoke(main, ["check", str(EXAMPLE)])
    assert done.exit_code == 0
    assert "Plain bushing of another batch" in done.stdout
    assert "problem untried_dolfinx: DOLFINx 0.12.0 is newer than" in done.stdout
    done = CliRunner().invoke(main, ["check", str(EXAMPLE), "--json"])
    assert [problem["name"] for problem in json.loads(done.stdout)["problems"]] == ["untried_dolfinx"]


def test_an_internal_error_names_the_release_that_may_be_why(newer, monkeypatch):
    monkeypatch.setattr("bushcli.simulate.meshes.meshes", lambda *_: {}["max_facet_to_cell_links"])
    done = CliRunner().invoke(main, ["mesh", str(EXAMPLE)])
    assert done.exit_code == 70
    assert "a possible cause: DOLFINx 0.12.0 is newer than" in done.output
