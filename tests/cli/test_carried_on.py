"""What a command identified is a case again: identified.toml, and a results folder in place of a case."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from bushcli.case import case_json, load_case
from bushcli.cli import main
from tests.cli.test_six import CASE

RECORDED = """
[[recordings]]
mode = "axial"
file = "data/axial.csv"
columns = {displacement = "way", force = "load"}
units = {displacement = "mm", force = "N"}
[[load_cases]]
mode = "path"
steps = 2
[load_cases.path]
time = [0.0, 1.0]
ux = [0.0, 0.5]
"""
GAIN = '[[effects]]\nname = "offset"\nparameters = {displacement = 0.05}\nchannels = ["axial"]\n'


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """Return a case with a recording of another law, with noise and a zero error, and a path of six motions."""
    (tmp_path / "data").mkdir()
    q = 3.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 161))
    noise = 0.4 * np.random.default_rng(5).standard_normal(len(q))
    rows = [f"{a:.6f},{250.0 * (a - 0.1) + noise[i]:.6f}" for i, a in enumerate(q)]
    (tmp_path / "data" / "axial.csv").write_text("\n".join(["way,load", *rows]))
    case = tmp_path / "case.toml"
    case.write_text('title = "carried"\n' + CASE + RECORDED + GAIN)
    return case


def bushcli(*arguments: object) -> Result:
    return CliRunner().invoke(main, [*map(str, arguments)])


def test_direct_on_the_folder_of_an_identification_gives_its_curve(recorded: Path, tmp_path: Path) -> None:
    out, again = tmp_path / "results" / "one", tmp_path / "again"
    done = bushcli("inverse", recorded, "--model", "neo_hookean", "-q", "-o", out)
    assert done.exit_code == 0, done.output
    done = bushcli("direct", out, "--no-fields", "-q", "-o", again, "--set", "load_cases=[]")
    assert done.exit_code == 0, done.output
    ended = np.loadtxt(out / "axial-identified.csv", delimiter=",", skiprows=1)
    simulated = np.loadtxt(again / "axial-comparison.csv", delimiter=",", skiprows=1)
    heads = (again / "axial-comparison.csv").read_text().splitlines()[0].split(",")
    column = next(i for i, name in enumerate(heads) if name.startswith("simulated"))
    assert simulated[:, column] == pytest.approx(ended[:, 2], abs=1e-6 * np.ptp(ended[:, 2]))
    carried = load_case(out)
    assert carried.title == "carried"
    assert carried.load_cases[0].six is not None
    assert carried.recordings[0].file.samefile(tmp_path / "data" / "axial.csv")
    result = json.loads((out / "result.json").read_text())
    assert carried.material.parameters["C10"] == result["parameters"]["C10"]["value"]
    assert carried.effects[0].values["displacement"] == result["parameters"]["offset.displacement"]["value"]
    assert carried.material.law == "neo_hookean"


def test_the_folder_of_a_prediction_means_its_case_while_that_is_the_same(
    recorded: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert bushcli("check", recorded, "-q", "-o", out).exit_code == 0
    assert case_json(load_case(out / "result.json")) == case_json(load_case(recorded))
    recorded.write_text(recorded.read_text().replace("length = 40.0", "length = 41.0"))
    refused = bushcli("check", out)
    assert refused.exit_code == 2
    assert "geometry differ" in refused.output


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"case": {"path": "none.toml"}}'])
def test_a_folder_without_a_case_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "result.json").write_text(content)
    refused = bushcli("direct", tmp_path)
    assert refused.exit_code == 2
    assert "Traceback" not in refused.output
