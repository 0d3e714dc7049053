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
from scipy.interpolate import CubicSpline

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


@pytest.mark.slow
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
    # A free tilt moves, without a moment.
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


def test_a_force_is_prescribed_in_place_of_a_motion(cli: Cli, case: Path) -> None:
    case.write_text(CASE + PATH.replace("uz = [0.0, 0.0, 3.0]", "fz = [0.0, 0.0, 800.0]"))
    checked = cli("check", case)
    assert "3 poses: ux, rz moved; fz prescribed; ry free" in checked.stdout
    done = cli("direct", case, "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    (found,) = result["load_cases"]
    assert (found["by_force"], found["free"]) == (["uz"], ["ry"])
    assert found["force"]["fz"][-1] == pytest.approx(800.0, rel=1e-6)
    assert 1.5 < found["motion"]["uz"][-1] < 3.0
    assert result["case"]["load_cases"][0]["path"]["fz"] == [0.0, 0.0, 800.0]
    assert result["case"]["load_cases"][0]["path"]["free"] == ["ry"]
    assert "uz (by force), mm" in cli("direct", case).stdout


@pytest.mark.slow
def test_a_mode_has_the_stiffness_matrix_too(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(CASE + '[[load_cases]]\nmode = "radial"\namplitude = 1.0\nsteps = 2\n')
    done = cli("direct", file, "--stiffness-matrix", "--json")
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)["load_cases"]
    assert found["mode"] == "radial"
    K0, K1 = (np.array(found[name]) for name in ("stiffness_matrix_start", "stiffness_matrix"))
    assert K0[0, 0] == pytest.approx(K0[1, 1], rel=1e-6)
    # Across the load the stiffness is the secant; the force is from a model of a quarter, whose mesh differs a little.
    assert K1[1, 1] == pytest.approx(found["force"][-1] / 1.0, rel=5e-3)
    assert abs(K1[2, 4]) > 100.0
    shown = cli("direct", file, "--stiffness-matrix")
    assert "radial: stiffness matrix at the end (1.00 mm), N, mm, rad" in shown.stdout
    refused = cli("direct", file, "--stiffness-at", "3")
    assert refused.returncode == 2
    assert "no channel reaches 3" in refused.stderr


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ('path.free=["ux"]', '"ux" in load_cases[0].path.free and load_cases[0].path.ux are given'),
        ("path.fx=[0.0, 9.0, 9.0]", "load_cases[0].path.ux and load_cases[0].path.fx are given"),
        ("path.my=[0.0, 9.0, 9.0]", '"ry" in load_cases[0].path.free and load_cases[0].path.my are given'),
        ("path.fy=[5.0, 9.0, 9.0]", "path.fy begins at 5"),
        ("path.fy=[0.0, 9.0]", "path.fy has 2 values"),
        ("path.ux=[0.0, 1.0]", "has 2 values"),
        ("path.time=[0.0, 2.0, 1.0]", "does not increase"),
        ("path.time=[1.0, 2.0, 3.0]", "does not begin at 0"),
        ("path.uz=[1.0, 1.0, 1.0]", "begins at 1"),
        ("path.ux=[0.0, 10.0, 10.0]", "closes the gap"),
        ("path.rx=[0.0, 0.0, 50.0]", "rx = 50 moves an end of the sleeve by"),
        ("path.rz=[0.0, 0.0, 200.0]", "more than 180 degrees"),
        ("path.vx=[0.0, 0.0, 1.0]", "not a key"),
        ("path=[0.0, 1.0]", "has six motions; amplitude, file or a list of points gives one"),
        ("mode=radial", 'is a table of six motions, and mode "radial" has one'),
        ("rate=1.0", "has no meaning"),
        ("path={time = [0.0, 1.0], uz = [0.0, 0.0]}", "moves nothing"),
    ],
)
def test_what_is_wrong_with_a_path_is_said(key: str, said: str, case: Path) -> None:
    done = CliRunner().invoke(main, ["check", str(case), "--set", f"load_cases.0.{key}"])
    assert done.exit_code == 2
    assert said in done.output


def test_a_path_has_the_time_that_an_effect_needs(case: Path) -> None:
    case.write_text(
        CASE + PATH + '[[effects]]\nname = "viscoelasticity"\nparameters = { g1 = 0.3, tau1 = 2.0 }\n'
    )
    done = CliRunner().invoke(main, ["check", str(case)])
    assert done.exit_code == 0, done.output


@pytest.mark.slow
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


NOISE = 1e-3
RECORDED = """
[[recordings]]
mode = "path"
file = "combined.csv"
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a case and a recording of it by this tool, 60 samples with noise (fixed seed)."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "truth.toml").write_text(
        CASE + PATH.replace('free = ["ry"]\n', "").replace("steps = 3", "steps = 6")
    )
    done = CliRunner().invoke(
        main, ["direct", str(folder / "truth.toml"), "-o", str(folder / "truth"), "--no-fields", "-q"]
    )
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader((folder / "truth" / "path.csv").read_text().splitlines()))
    time = np.array([float(row["time_s"]) for row in rows])
    at, rng = np.linspace(0.0, time[-1], 61), np.random.default_rng(7)
    names = ("ux_mm", "uz_mm", "rz_deg", "fx_N", "fz_N", "my_Nmm", "mz_Nmm")
    columns = [at]
    for name in names:
        values = np.array([float(row[name]) for row in rows])
        smooth = CubicSpline(time[time <= 1.0], values[time <= 1.0])
        after = CubicSpline(time[time >= 1.0], values[time >= 1.0])
        exact = np.where(at <= 1.0, smooth(np.minimum(at, 1.0)), after(np.maximum(at, 1.0)))
        columns.append(
            exact + (NOISE * np.ptp(values) if name[0] in "fm" else 0.0) * rng.standard_normal(len(at))
        )
    text = ",".join(("time_s", *names)) + "\n"
    text += "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in np.column_stack(columns))
    (folder / "combined.csv").write_text(text)
    (folder / "case.toml").write_text(CASE + RECORDED)
    return folder


def test_a_recorded_path_is_compared_reaction_by_reaction(recorded: Path) -> None:
    done = CliRunner().invoke(
        main, ["direct", str(recorded / "case.toml"), "--json", "-q", "--stiffness-at", "1"]
    )
    assert done.exit_code == 0, done.output
    found = {one["name"]: one for one in json.loads(done.stdout)["load_cases"]}
    # my has no recorded motion: ry is held.
    assert found.keys() == {"path.fx", "path.fz", "path.mz"}
    for one in found.values():
        assert one["recording"]["rms_percent"] == pytest.approx(100 * NOISE, rel=0.5)
        assert one["recording"]["within_10_percent"]
        K = np.array(one["stiffness_matrix_at"])
        assert abs(K[2, 4]) > 100.0


@pytest.mark.slow
def test_the_law_is_identified_from_a_recorded_path(recorded: Path) -> None:
    """From all reactions together; so small a travel determines only a combination of C20 and C30, as is reported."""
    start = "material.parameters={C10 = 0.7, C20 = -0.02, C30 = 0.01}"
    arguments = [
        "inverse",
        str(recorded / "case.toml"),
        "--json",
        "-q",
        "--model",
        "yeoh",
        "--fix",
        "C30",
        "--set",
        start,
    ]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["converged"]
    for name, true in (("C10", 0.5), ("C20", -0.05)):
        estimate = found["parameters"][name]
        assert abs(estimate["value"] - true) < 4 * estimate["std"]
    assert found["parameters"]["C10"]["value"] == pytest.approx(0.5, rel=5e-3)
    assert found["misfit"].keys() == {"path.fx", "path.fz", "path.mz"}


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ('motions={ux = "ux_mm"}', None),
        ('motions={wx = "ux_mm"}', "wx"),
        ('motions={ux = "Weg"}', "no column"),
        ('forces={fx = "fx_N", fy = "Kraft"}', 'has no column "Kraft"'),
        ("forces={fx = 5, fy = 99}", "has no column 99"),
        ('forces={fy = "fx_N"}', "no reaction along a motion in which the sleeve moves"),
        ('columns={force = "fx_N"}', "has no meaning for mode path"),
        ("cycles=[1]", "has no meaning for mode path"),
        ("mode=radial", "could each be the displacement"),
    ],
)
def test_what_is_wrong_with_a_recorded_path_is_said(key: str, said: str | None, recorded: Path) -> None:
    done = CliRunner().invoke(main, ["check", str(recorded / "case.toml"), "--set", f"recordings.0.{key}"])
    assert done.exit_code == (0 if said is None else 2), done.output
    assert said is None or said in done.output


def test_all_prescribed_motions_are_listed_as_read(recorded: Path) -> None:
    """A motion is used by every reaction of the path, not only by its own."""
    options = ["--json", "--set", 'recordings.0.free=["uz"]']
    done = CliRunner().invoke(main, ["check", str(recorded / "case.toml"), *options])
    assert done.exit_code == 0, done.output
    read = {one["channel"]: one for one in json.loads(done.stdout)["sources"]}
    own = {one["quantity"]: one["name"] for one in read["path.fx"]["columns"]}
    assert own == {"displacement": "ux_mm", "force": "fx_N", "time": "time_s", "rz": "rz_deg"}
    assert read["path.fx"]["unused"] == ["uz_mm", "fz_N", "my_Nmm", "mz_Nmm"]


def test_keys_of_a_path_are_refused_elsewhere(recorded: Path) -> None:
    case = recorded / "other.toml"
    case.write_text(
        CASE
        + RECORDED.replace('"path"', '"radial"')
        + 'free = ["ry"]\ncolumns = { displacement = "ux_mm", force = "fx_N" }\n'
    )
    done = CliRunner().invoke(main, ["check", str(case)])
    assert done.exit_code == 2
    assert "has no meaning for mode radial" in done.output


def test_the_reaction_of_a_free_motion_is_no_channel(recorded: Path) -> None:
    """It is zero by definition: rounding in it would be fitted with the weight of a measurement."""
    options = ["--json", "--set", 'recordings.0.free=["rz"]']
    done = CliRunner().invoke(main, ["check", str(recorded / "case.toml"), *options])
    assert done.exit_code == 0, done.output
    names = [one["name"] for one in json.loads(done.stdout)["recordings"]]
    assert names == ["path.fx", "path.fz"]
