"""Load cases, rates and targets at a force from the command line, with effects and with wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from bushcli.cli import main
from bushcli.curve.curve import Curve
from bushcli.study.answers import NoAnswer, monotonic_stretch
from bushcli.study.target import place_of
from tests.cli.test_six import CASE

LOADED = """
[[load_cases]]
mode = "axial"
force = 1000.0
steps = 4
"""


def run(folder: Path, text: str, *arguments: str) -> Result:
    file = folder / "case.toml"
    file.write_text(CASE + text)
    command, *rest = arguments
    return CliRunner().invoke(main, [command, str(file), *rest, "-o", str(folder / "out")])


def direct(folder: Path, text: str, code: int = 0) -> dict:
    done = run(folder, text, "direct", "-q", "--no-fields")
    assert done.exit_code == code, done.output
    return json.loads((folder / "out" / "result.json").read_text())


def test_a_load_case_by_force_is_one_by_the_travel_that_it_found(tmp_path: Path) -> None:
    loaded = direct(tmp_path, LOADED)["load_cases"][0]
    travel = loaded["displacement"][-1]
    assert loaded["force"] == pytest.approx([0.0, 250.0, 500.0, 750.0, 1000.0], abs=1e-3)
    moved = direct(tmp_path, f'[[load_cases]]\nmode = "axial"\namplitude = {travel!r}\nsteps = 4\n')[
        "load_cases"
    ][0]
    assert moved["force"][-1] == pytest.approx(loaded["force"][-1], rel=1e-6)
    assert loaded["stiffness"]["secant"] == pytest.approx(1000.0 / travel, rel=1e-3)


def test_a_constant_force_makes_viscoelastic_rubber_creep(tmp_path: Path) -> None:
    times = [0.0, 0.01, 1.0, 10.0, 100.0, 1000.0]
    rows = "".join(f"{t},{0.0 if t == 0.0 else 300.0}\n" for t in times)
    (tmp_path / "load.csv").write_text("time_s,force_N\n" + rows)
    effect = '[[effects]]\nname = "viscoelasticity"\nparameters = {g1 = 0.5, tau1 = 10.0}\n'
    crept = direct(tmp_path, '[[load_cases]]\nmode = "axial"\nforce_file = "load.csv"\n' + effect)[
        "load_cases"
    ][0]
    plain = direct(tmp_path, '[[load_cases]]\nmode = "axial"\nforce_path = [0, 300]\nsteps = 4\n')[
        "load_cases"
    ][0]
    assert crept["force"][1:] == pytest.approx([300.0] * 5, rel=1e-6)
    assert np.all(np.diff(crept["displacement"]) > 0.0)
    # The law is the relaxed one; a step meets 1 + g1 times its stiffness (small strain: 1 %).
    assert crept["displacement"][-1] == pytest.approx(plain["displacement"][-1], rel=1e-3)
    assert crept["displacement"][1] == pytest.approx(plain["displacement"][-1] / 1.5, rel=1e-2)


def test_what_stands_beside_the_bushing_shares_the_force_and_the_rig_is_left_out(tmp_path: Path) -> None:
    plain = direct(tmp_path, LOADED)["load_cases"][0]
    scaled = direct(
        tmp_path,
        LOADED.replace("1000.0", "1200.0")
        + '[[effects]]\nname = "batch_stiffness"\nparameters = {log_factor = 0.1823215568}\n'
        + '[[effects]]\nname = "rig_compliance"\nparameters = {compliance = 1e-4}\n',
    )
    assert scaled["load_cases"][0]["displacement"] == pytest.approx(plain["displacement"], rel=1e-5)
    (left_out,) = [one for one in scaled["problems"] if one["name"] == "effect_left_out"]
    assert "rig_compliance" in left_out["message"]
    assert "batch" not in left_out["message"]


def test_a_limit_point_ends_with_a_sentence(tmp_path: Path) -> None:
    text = "[mesh]\nelements_across = 4\nelements_along = 8\n" + LOADED.replace("axial", "torsional")
    text = text.replace("1000.0", "12000.0").replace("steps = 4", "steps = 8")
    file = tmp_path / "case.toml"
    head = CASE.replace("C20 = -0.05", "C20 = -0.5").replace("C30 = 0.01", "C30 = 0.0")
    file.write_text(head[: head.index("[mesh]")] + head[head.index("[material]") :] + text)
    done = CliRunner().invoke(main, ["direct", str(file), "-q", "--no-fields", "-o", str(tmp_path / "out")])
    assert done.exit_code == 3
    (stopped,) = [
        one
        for one in json.loads((tmp_path / "out" / "result.json").read_text())["problems"]
        if one["name"] == "not_converged"
    ]
    assert "the largest found is" in stopped["message"]
    assert "N mm at" in stopped["message"]


def test_a_force_of_which_not_even_the_first_step_is_solved(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE + LOADED.replace("1000.0", "1e9"))
    done = CliRunner().invoke(main, ["direct", str(tmp_path / "case.toml"), "-q"])
    assert done.exit_code == 3
    said = " ".join(done.output.split())
    assert "the first step towards the prescribed force found no equilibrium" in said
    assert "prescribe a smaller force, for instance force = 1000 (N)" in said
    assert "amplitude = 0" not in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('mode = "axial"\nforce = 5.0\namplitude = 3.0', "has amplitude and force"),
        ('mode = "axial"\nforce = 0.0', "stands still"),
        ('mode = "axial"\nforce = "5 N"', "load_cases[0].force"),
        ('mode = "axial"\nforce_file = "none.csv"', "does not exist"),
        ('mode = "path"\nforce = 5.0', "is loaded by a displacement"),
        ('mode = "axial"\nforce_path = [0.0]', "force_path"),
    ],
)
def test_wrong_loads_are_refused(tmp_path: Path, text: str, said: str) -> None:
    done = run(tmp_path, f"[[load_cases]]\n{text}\n", "direct")
    assert done.exit_code == 2
    assert said in done.output


def test_rates_at_a_load_are_those_at_its_travel(tmp_path: Path) -> None:
    answers = [f"--answer=axial.{kind}@500N" for kind in ("travel", "secant", "tangent")]
    vary = "--vary=material.parameters.C10=0.499:0.501"
    done = run(tmp_path, LOADED, "study", vary, *answers, "--designs", "4", "-q")
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "out" / "result.json").read_text())["answers"]
    curve = direct(tmp_path, LOADED)["load_cases"][0]
    secant = found["axial.secant@500N"]["mean"]
    assert secant == pytest.approx(500.0 / curve["displacement"][2], rel=2e-3)
    assert found["axial.travel@500N"]["mean"] * secant == pytest.approx(500.0, rel=1e-3)
    assert found["axial.tangent@500N"]["mean"] < secant  # it softens


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("axial.force@5N=3", "force needs a travel"),
        ("axial.travel@5=3", "travel needs a load"),
        ("axial.secant@5Nmm=3", "Nmm is not the unit of a travel or of a load in mode axial"),
        ("axial@500=300", 'did you mean "axial@500N, if it is a load"?'),
        ("axial@0,5=300", 'did you mean "@0.5"?'),
        ("axial=300N/mm", "300N/mm is no number"),
        ("axial.secant@0N=3", "that is not 0"),
    ],
)
def test_wrong_targets_are_refused(tmp_path: Path, target: str, said: str) -> None:
    done = run(tmp_path, LOADED, "design", f"--target={target}", "--vary=geometry.length=30:50")
    assert done.exit_code == 2
    assert said in done.output


@pytest.mark.parametrize(
    ("place", "mode", "expected"),
    [
        ("0.5kN", "axial", (500.0, True)),
        ("500 N", "axial", (500.0, True)),
        ("2mm", "radial", (2.0, False)),
        ("-2", "radial", (-2.0, False)),
        ("5 Nm", "torsional", (5000.0, True)),
        ("8deg", "torsional", (8.0, False)),
    ],
)
def test_a_travel_or_a_load_may_have_its_unit(place: str, mode: str, expected: tuple[float, bool]) -> None:
    assert place_of("--answer", mode, place) == expected


def test_a_load_without_unit_is_a_travel_that_no_curve_reaches() -> None:
    curve = Curve("axial", [0.0, 1.0, 2.0], [0.0, 300.0, 600.0])
    with pytest.raises(NoAnswer, match="from 0 to 2 mm; a load has its unit, @500N"):
        monotonic_stretch(curve, 500.0, "axial.secant@500")
    with pytest.raises(NoAnswer, match=r"from 0 to 2 mm$"):
        monotonic_stretch(curve, 3.0, "axial.secant@3")
