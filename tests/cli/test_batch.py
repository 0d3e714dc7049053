"""A batch of parts from the command line: scatter, outliers with their causes, files, and the case it leaves."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.study.batch import shift
from tests.cli.test_six import CASE

COUNT, SPREAD = 20, 0.04
SPECIMENS = '[[specimens]]\nmode = "axial"\nfile = "parts/*.csv"\n'


def bushcli(*arguments: object) -> Result:
    return CliRunner().invoke(main, [*map(str, arguments)])


@pytest.fixture(scope="module")
def curve(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Return displacement and force of the bushing of `CASE`."""
    folder = tmp_path_factory.mktemp("truth")
    (folder / "case.toml").write_text(CASE + '[[load_cases]]\nmode = "axial"\namplitude = 6.0\nsteps = 24\n')
    assert bushcli("direct", folder / "case.toml", "-q", "--no-fields", "-o", folder / "out").exit_code == 0
    return np.loadtxt(folder / "out" / "axial.csv", delimiter=",", skiprows=1).T


def batch_of(folder: Path, curve: np.ndarray, planted: bool) -> tuple[Path, np.ndarray]:
    """Write parts, five of them with a stiffer rubber, a friction, a clamp, a wrong sign and an offset if `planted`."""
    draw = np.random.default_rng(3)
    time = np.arange(0.0, 20.001, 0.1)
    programmed = 5.0 * np.sin(2.0 * np.pi * time / 10.0)
    factors = np.exp(SPREAD * draw.standard_normal(COUNT))
    (folder / "parts").mkdir()

    def force(q: np.ndarray) -> np.ndarray:
        return np.sign(q) * np.interp(np.abs(q), *curve)

    for number, factor in enumerate(factors, start=1):
        q, shift, loop, scale = programmed, 0.0, 0.0, factor
        if planted and number in (5, 10, 14, 17, 19):
            scale = {5: 1.35, 17: -factor}.get(number, factor)
            loop, shift = (35.0 if number == 10 else 0.0), (0.4 if number == 19 else 0.0)
            q = np.clip(q, -3.2, 3.2) if number == 14 else q
        F = scale * force(q - shift) + loop * np.sign(np.gradient(programmed))
        noisy = q + 0.002 * draw.standard_normal(len(q)), F + 1.5 * draw.standard_normal(len(q))
        rows = "\n".join(f"{t:.1f},{a:.5f},{b:.4f}" for t, a, b in zip(time, *noisy, strict=True))
        (folder / "parts" / f"part_{number:02d}.csv").write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    case = folder / "case.toml"
    case.write_text(CASE.split("[material.parameters]")[0] + SPECIMENS)
    return case, factors


def test_the_outliers_are_named_with_their_causes(tmp_path: Path, curve: np.ndarray) -> None:
    case, factors = batch_of(tmp_path, curve, planted=True)
    out = tmp_path / "out"
    done = bushcli("batch", case, "-q", "-o", out, "--strict")
    assert done.exit_code == 1, done.output
    found = json.loads((out / "result.json").read_text())
    parts = {one["name"]: one for one in found["parts"]}
    assert {name: parts[name]["outlier"] for name in found["outliers"]} == {
        "part_05": ["stiffness"],
        "part_10": ["shape"],
        "part_14": ["program"],
        "part_17": ["data"],
        "part_19": ["shape"],
    }
    kinds = {name: [cause["kind"] for cause in parts[name]["causes"]] for name in found["outliers"]}
    assert kinds == {
        "part_05": [],
        "part_10": ["friction"],
        "part_14": ["travel"],
        "part_17": ["sign"],
        "part_19": ["offset"],
    }
    assert "clamped" in parts["part_14"]["causes"][0]["text"]
    like = [name for name in parts if name not in found["outliers"]]
    true = factors[[int(name[-2:]) - 1 for name in like]]
    # Relative to their mean, to within the noise of 1.5 N on 1,900 N.
    assert [parts[name]["factor"] for name in like] == pytest.approx(list(true / true.mean()), rel=2e-4)
    assert parts["part_14"]["factor"] == pytest.approx(factors[13] / true.mean(), rel=2e-3)
    (band,) = found["curves"]
    assert band["scatter_percent"] == pytest.approx(100.0 * np.std(np.log(true), ddof=1), rel=1e-3)
    assert parts["part_14"]["own_simulation"]
    assert not parts["part_05"]["own_simulation"]
    assert len((out / "parts.csv").read_text().splitlines()) == COUNT + 1
    q, mean, lower, upper = np.loadtxt(out / "axial-band.csv", delimiter=",", skiprows=1).T
    assert np.all((lower <= mean) & (mean <= upper))
    assert (
        np.abs(mean / (true.mean() * np.sign(q) * np.interp(np.abs(q), *curve)) - 1.0)[np.abs(q) > 1].max()
        < 3e-3
    )
    # The case of the result is that of the mean part.
    carried = load_case(out)
    assert carried.recordings[0].file == out / "axial-mean.csv"
    again = bushcli("direct", out, "-q", "--no-fields", "-o", tmp_path / "again")
    assert again.exit_code == 0, again.output
    compared = json.loads((tmp_path / "again" / "result.json").read_text())["load_cases"][0]["recording"]
    assert compared["rms_percent"] < 0.1


def test_like_parts_have_no_outliers_and_one_simulation(tmp_path: Path, curve: np.ndarray) -> None:
    case, _ = batch_of(tmp_path, curve, planted=False)
    done = bushcli("batch", case, "-q", "-o", tmp_path / "out", "--strict", "--model", "neo_hookean")
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert found["outliers"] == []
    assert found["programs"] == 1
    assert found["law"] == "neo_hookean"
    # As many simulations as iterations on one channel take, not twenty times as many.
    assert found["forward_solves"] < COUNT


@pytest.mark.parametrize(
    ("specimens", "said"),
    [
        ("", "no parts"),
        ('[[specimens]]\nmode = "axial"\nfile = "parts/part_01.csv"\n', "one part"),
        ('[[specimens]]\nmode = "axial"\nfile = "nothing/*.csv"\n', "nothing/*.csv"),
        ('[[specimens]]\nmode = "sideways"\nfile = "parts/*.csv"\n', "sideways"),
        ('[[specimens]]\nmode = "axial"\nfiles = "parts/*.csv"\n', "files"),
    ],
)
def test_what_is_no_batch_is_refused(tmp_path: Path, curve: np.ndarray, specimens: str, said: str) -> None:
    case, _ = batch_of(tmp_path, curve, planted=False)
    case.write_text(CASE + specimens)
    refused = bushcli("batch", case)
    assert refused.exit_code == 2
    assert said in refused.output


def test_the_remedy_for_a_part_in_another_unit_corrects_that_part_alone(
    tmp_path: Path, curve: np.ndarray
) -> None:
    case, _ = batch_of(tmp_path, curve, planted=False)
    file = tmp_path / "parts" / "part_07.csv"
    time, q, F = np.loadtxt(file, delimiter=",", skiprows=1).T
    rows = "\n".join(f"{t:.1f},{a:.5f},{b:.7f}" for t, a, b in zip(time, q, F / 1000.0, strict=True))
    file.write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    wrong = bushcli("batch", case, "-q", "--json")
    found = json.loads(wrong.stdout)
    assert {one["name"]: one["outlier"] for one in found["parts"]}["part_07"] == ["data"]
    (fault,) = (one for one in found["problems"] if one["name"] == "faulty_data")
    # The pattern's table has the units of twenty parts.
    assert "a [[specimens]] table of its own" in fault["remedy"]
    assert 'units = { force = "kN" }' in fault["remedy"]
    alone = '[[specimens]]\nmode = "axial"\nfile = "parts/part_07.csv"\nunits = { force = "kN" }\n'
    case.write_text(case.read_text() + alone)
    checked = bushcli("check", case, "-q", "--json", "--strict")
    assert checked.exit_code == 0, checked.output
    assert len(json.loads(checked.stdout)["recordings"]) == COUNT
    right = bushcli("batch", case, "-q", "--json", "--strict")
    assert right.exit_code == 0, right.output
    assert sorted(one["name"] for one in json.loads(right.stdout)["parts"]) == [
        f"part_{number:02d}" for number in range(1, COUNT + 1)
    ]


def test_a_fault_that_most_parts_have_is_said_once_and_sets_none_apart(
    tmp_path: Path, curve: np.ndarray
) -> None:
    """All forces are read in mN, which nothing contradicts: the outliers are those of the parts in N."""
    case, _ = batch_of(tmp_path, curve, planted=True)
    case.write_text(case.read_text().replace('mode = "axial"', 'mode = "axial"\nunits = { force = "mN" }'))
    done = bushcli("batch", case, "-q", "--json")
    found = json.loads(done.stdout)
    (doubt,) = (one for one in found["problems"] if one["name"] == "doubtful_data")
    assert doubt["message"].startswith(f"{COUNT} of {COUNT} parts have this fault, such as part_01: ")
    causes = {
        part["name"]: [cause["kind"] for cause in part["causes"]]
        for part in found["parts"]
        if part["outlier"]
    }
    assert causes == {
        "part_05": [], "part_10": ["friction"], "part_14": ["travel"], "part_17": ["sign"], "part_19": ["offset"],
    }  # fmt: skip


@pytest.mark.parametrize("command", ["inverse", "direct", "diagnose"])
def test_commands_on_one_part_name_the_one_for_a_batch(
    tmp_path: Path, curve: np.ndarray, command: str
) -> None:
    case, _ = batch_of(tmp_path, curve, planted=False)
    refused = bushcli(command, case)
    assert refused.exit_code == 2
    assert "[[specimens]] are for `bushcli batch`" in refused.output


def test_recordings_that_end_some_samples_earlier_ran_the_same_program(
    tmp_path: Path, curve: np.ndarray
) -> None:
    case, _ = batch_of(tmp_path, curve, planted=False)
    for number in range(1, COUNT + 1):
        file = tmp_path / "parts" / f"part_{number:02d}.csv"
        lines = file.read_text().splitlines()
        file.write_text("\n".join(lines[: len(lines) - number % 4]) + "\n")
    done = bushcli("batch", case, "-q", "--json", "--strict", "--model", "neo_hookean")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["programs"] == 1
    assert not any(one["own_simulation"] for one in found["parts"])


@pytest.mark.parametrize(("begin", "expected"), [(13, 13.0), (7.4, 7.4), (-11, -11.0), (0, 0.0)])
def test_a_recording_that_begins_at_another_phase_is_of_the_same_program(
    begin: float, expected: float
) -> None:
    """Four sines of 50 samples each; a negative number is a rest before the program."""
    program = np.sin(2.0 * np.pi * np.arange(201) / 50.0)
    if begin < 0:
        other = np.concatenate([np.zeros(-int(begin)), program])
    else:
        other = np.sin(2.0 * np.pi * (np.arange(201 - begin) + begin) / 50.0)
    assert shift(program, other) == pytest.approx(expected, abs=0.05)
    # Another amplitude, or hardly anything in common, is another program.
    assert shift(program, 1.1 * other) is None
    assert shift(program[:60], -program[:60]) is None


def test_parts_recorded_from_another_phase_on_share_one_simulation(tmp_path: Path, curve: np.ndarray) -> None:
    case, factors = batch_of(tmp_path, curve, planted=False)
    for number, skipped in ((3, 17), (8, 31), (12, 5)):
        file = tmp_path / "parts" / f"part_{number:02d}.csv"
        head, *rows = file.read_text().splitlines()
        file.write_text("\n".join([head, *rows[skipped:]]) + "\n")
    done = bushcli("batch", case, "-q", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert (found["programs"], found["outliers"]) == (1, [])
    ratio = np.array([one["factor"] for one in found["parts"]]) / factors
    assert ratio / ratio.mean() == pytest.approx(np.ones(COUNT), rel=2e-3)
