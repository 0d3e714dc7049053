"""Paths of six motions and stiffness matrices from the command line: JSON, tables, files, wrong input."""

from __future__ import annotations

import csv
import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.cli import main

Cli = Callable[..., subprocess.CompletedProcess[str]]

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 4
elements_around = 8
[material]
law = "yeoh"
bulk_modulus = 200.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
"""
PATH = """
[[load_cases]]
mode = "path"
steps = 3
[load_cases.path]
time = [0.0, 1.0, 2.0]
ux = [0.0, 1.0, 1.0]
uz = [0.0, 0.0, 3.0]
rz = [0.0, 0.0, 8.0]
free = ["ry"]
"""
MOTIONS, REACTIONS = ("ux", "uy", "uz", "rx", "ry", "rz"), ("fx", "fy", "fz", "mx", "my", "mz")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    file = tmp_path / "case.toml"
    file.write_text(CASE + PATH)
    return file


def test_a_path_has_six_motions_and_reactions(cli: Cli, case: Path, tmp_path: Path) -> None:
    done = cli("direct", case, "--json", "--stiffness-matrix", "--stiffness-at", "1", "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)["load_cases"]
    assert found["mode"] == "path"
    count = len(found["time"])
    assert count >= 7
    assert found["motion"].keys() == set(MOTIONS)
    assert found["force"].keys() == set(REACTIONS)
    assert all(len(values) == count for values in (*found["motion"].values(), *found["force"].values()))
    assert [found["motion"][name][-1] for name in ("ux", "uz", "rz")] == pytest.approx([1.0, 3.0, 8.0])
    # A free tilt moves, and no moment holds it.
    assert abs(found["motion"]["ry"][-1]) > 0.1
    assert max(map(abs, found["force"]["my"])) < 1e-6 * found["force"]["mz"][-1]
    for name in ("stiffness_matrix_start", "stiffness_matrix_at", "stiffness_matrix"):
        matrix = np.array(found[name])
        assert matrix.shape == (6, 6)
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-6 * np.abs(matrix).max())
        assert np.all(np.diag(matrix) > 0)
    assert found["stiffness_matrix_at_displacement"] == 1.0
    # Torsion: 4 pi mu L / (a^-2 - b^-2), at any length; the coarse mesh is 0.5 % off.
    exact = 4 * np.pi * 1.0 * 40.0 / (12.0**-2 - 22.0**-2)
    assert found["stiffness_matrix_start"][5][5] == pytest.approx(exact, rel=0.01)
    rows = list(csv.DictReader((tmp_path / "out" / "path.csv").read_text().splitlines()))
    assert len(rows) == count
    assert float(rows[-1]["rz_deg"]) == pytest.approx(8.0)
    assert float(rows[-1]["mz_Nmm"]) == pytest.approx(found["force"]["mz"][-1])
    assert {file.name for file in (tmp_path / "out").iterdir()} >= {
        "path-six.png",
        "path.xdmf",
        "report.html",
    }
    assert "stiffness matrix at the end" in (tmp_path / "out" / "report.html").read_text()


def test_a_mode_has_the_stiffness_matrix_too(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(CASE + '[[load_cases]]\nmode = "radial"\namplitude = 1.0\nsteps = 2\n')
    done = cli("direct", file, "--stiffness-matrix", "--json")
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)["load_cases"]
    assert found["mode"] == "radial"
    K0, K1 = (np.array(found[name]) for name in ("stiffness_matrix_start", "stiffness_matrix"))
    assert K0[0, 0] == pytest.approx(K0[1, 1], rel=1e-6)
    # Across the load it is the secant; the force is that of a quarter, which is meshed a little otherwise.
    assert K1[1, 1] == pytest.approx(found["force"][-1] / 1.0, rel=5e-3)
    assert abs(K1[2, 4]) > 100.0
    shown = cli("direct", file, "--stiffness-matrix")
    assert "radial: stiffness matrix at the end (1.00 mm), N, mm, rad" in shown.stdout
    refused = cli("direct", file, "--stiffness-at", "3")
    assert refused.returncode == 2
    assert "no channel passes 3" in refused.stderr


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ('path.free=["ux"]', "is in load_cases[0].path.free"),
        ("path.ux=[0.0, 1.0]", "has 2 values"),
        ("path.time=[0.0, 2.0, 1.0]", "does not increase"),
        ("path.time=[1.0, 2.0, 3.0]", "does not begin at 0"),
        ("path.uz=[1.0, 1.0, 1.0]", "begins at 1"),
        ("path.ux=[0.0, 10.0, 10.0]", "closes the gap"),
        ("path.rz=[0.0, 0.0, 200.0]", "more than 180 degrees"),
        ("path.vx=[0.0, 0.0, 1.0]", "not a key"),
        ("path=[0.0, 1.0]", "do not go together"),
        ("mode=radial", "do not go together"),
        ("rate=1.0", "has no meaning"),
        ("path={time = [0.0, 1.0], uz = [0.0, 0.0]}", "moves nothing"),
    ],
)
def test_what_is_wrong_with_a_path_is_said(key: str, said: str, case: Path) -> None:
    done = CliRunner().invoke(main, ["check", str(case), "--set", f"load_cases.0.{key}"])
    assert done.exit_code == 2
    assert said in done.output


def test_effects_of_the_assembly_act_and_those_of_the_rig_are_refused(cli: Cli, case: Path) -> None:
    stiffer = '[[effects]]\nname = "swaging"\n[effects.parameters]\nreduction = 0.2\n'
    forces = []
    for effects in ("", stiffer):
        case.write_text(CASE + PATH + effects)
        done = cli("direct", case, "--json")
        assert done.returncode == 0, done.stderr
        forces.append(json.loads(done.stdout)["load_cases"][0]["force"]["fx"][-1])
    assert forces[1] > 1.02 * forces[0]
    case.write_text(CASE + PATH + '[[effects]]\nname = "gain"\n')
    refused = cli("direct", case)
    assert refused.returncode == 2
    assert "gain" in refused.stderr
