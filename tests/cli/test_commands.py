"""What users and scripts rely on: streams, exit codes, JSON keys, files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bushcli.cli import main

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "batch"
Cli = Callable[..., subprocess.CompletedProcess[str]]

FORBIDDEN = ("Traceback", "internal error")


def test_every_command_has_help_and_says_what_it_does() -> None:
    for name, command in main.commands.items():
        assert command.help, name
        for parameter in command.params:
            assert parameter.param_type_name == "argument" or parameter.help, (name, parameter.name)


def test_help_needs_none_of_the_finite_element_stack() -> None:
    # --help is fast because nothing heavy is imported; the time is not tested.
    code = (
        "import sys\nfrom click.testing import CliRunner\nfrom bushcli.cli import main\n"
        "assert CliRunner().invoke(main, ['--help']).exit_code == 0\n"
        "heavy = {'dolfinx', 'petsc4py', 'gmsh', 'scipy', 'matplotlib', 'pydantic', 'numpy'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)


def test_direct_gives_json_on_stdout_and_nothing_else_there(command_line: Cli, small: Path) -> None:
    done = command_line("direct", small, "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert {"command", "case", "versions", "timings_s", "problems", "load_cases"} <= result.keys()
    assert result["command"] == "direct"
    (axial,) = result["load_cases"]
    assert axial["mode"] == "axial"
    assert len(axial["displacement"]) == len(axial["force"]) > 5
    assert set(axial["stiffness"]) >= {"initial", "secant"}
    recording = axial["recording"]
    assert {"rms_percent", "peak_percent", "stiffness_measured", "stiffness_simulated"} <= recording.keys()
    # The recording is of a batch 0.56 times as stiff, so the direct method is too stiff by about 1/0.56 = 1.79.
    assert recording["stiffness_simulated"] / recording["stiffness_measured"] == pytest.approx(1.78, abs=0.04)
    assert recording["within_10_percent"] is False


@pytest.mark.slow
def test_a_sweep_in_the_shell_changes_the_case(cli: Cli, small: Path) -> None:
    forces = []
    for length in (30, 40):
        done = cli("direct", small, "--set", f"geometry.length={length}", "--json", "-q")
        assert done.stderr == ""
        result = json.loads(done.stdout)
        assert result["case"]["geometry"]["length"] == length
        forces.append(max(result["load_cases"][0]["force"]))
    # Axial stiffness grows with the length, a little less than in proportion to it (the ends are softer).
    assert 1.2 < forces[1] / forces[0] < 40 / 30 + 0.05


@pytest.mark.slow
def test_strict_turns_a_negative_verdict_into_exit_1(cli: Cli, small: Path) -> None:
    assert cli("direct", small, "-q").returncode == 0
    assert cli("direct", small, "-q", "--strict").returncode == 1


@pytest.mark.slow
def test_output_folder_holds_result_curves_plots_and_report(cli: Cli, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = cli("direct", small, "-o", out)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in out.iterdir()}
    assert {"result.json", "report.html", "axial.csv", "axial.xdmf", "axial.h5"} <= names
    assert any(name.endswith(".png") for name in names)
    assert any(name.endswith(".svg") for name in names)
    assert json.loads((out / "result.json").read_text())["command"] == "direct"
    header = (out / "axial.csv").read_text().splitlines()[0]
    assert header.split(",")[-2:] == ["displacement_mm", "force_N"]
    page = (out / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page.replace("https://www.w3.org", "")


def test_the_example_runs_from_any_folder(cli: Cli, tmp_path: Path) -> None:
    assert cli("init", "bushing", cwd=tmp_path).returncode == 0
    assert (tmp_path / "bushing" / "case.toml").is_file()
    done = cli("check", "bushing/case.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    again = cli("init", "bushing", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr


def test_fit_identifies_the_law_of_the_example(cli: Cli) -> None:
    done = cli("fit", EXAMPLE / "case.toml", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    # examples/batch/README.md: the bushing's rubber was made from a Yeoh fit to the same data, C10 = 0.2096 MPa;
    # another weighting of the points moves it by a few per cent.
    assert result["parameters"]["C10"]["value"] == pytest.approx(0.2096, rel=0.03)
    assert {"value", "std", "lower", "upper", "at_bound"} <= result["parameters"]["C10"].keys()
    assert set(result["misfit"]) == {"uniaxial", "equibiaxial", "planar"}
    assert {
        "correlation",
        "forward_solves",
        "sweeps",
        "iterations",
        "converged",
        "identifiability",
    } <= result.keys()


def test_mesh_writes_pictures_and_files(cli: Cli, small: Path, tmp_path: Path) -> None:
    done = cli("mesh", small, "-o", tmp_path / "mesh")
    assert done.returncode == 0, done.stderr
    endings = {path.suffix for path in (tmp_path / "mesh").iterdir()}
    assert {".png", ".xdmf"} <= endings


@pytest.mark.parametrize("kind", ["laws", "shapes", "modes", "effects"])
def test_list_prints_every_entry(cli: Cli, kind: str) -> None:
    entries = json.loads(cli("list", kind, "--json").stdout)
    text = cli("list", kind).stdout
    assert len(entries) > 3
    for entry in entries:
        assert entry["name"] in text


@pytest.mark.slow
def test_a_march_that_cannot_go_on_keeps_what_it_has(cli: Cli, small: Path, tmp_path: Path) -> None:
    # Gent's chains lock at I1 - 3 = 0.5: simple shear of 9 mm rubber gets there at about 6 mm.
    text = small.read_text().split("[material]")[0] + (
        '[material]\nlaw = "gent"\n[material.parameters]\nmu = 0.8\nJm = 0.3\n'
        '[[load_cases]]\nmode = "axial"\namplitude = 8.0\nsteps = 16\n'
    )
    small.write_text(text)
    out = tmp_path / "out"
    done = cli("direct", small, "-o", out, "--no-fields")
    assert done.returncode == 3, done.stderr
    result = json.loads((out / "result.json").read_text())
    assert "not_converged" in [problem["name"] for problem in result["problems"]]
    (axial,) = result["load_cases"]
    assert 1 < len(axial["displacement"]) < 17
    assert max(axial["displacement"]) < 8.0


WRONG = {
    "unknown key": (["--set", "geometry.lenght=38"], ["lenght", "length"]),
    "unknown law": (["--set", "material.law=yeho"], ["yeho", "yeoh"]),
    "inner beyond outer": (["--set", "geometry.inner_radius=20"], ["inner_radius", "outer_radius"]),
    "zero length": (["--set", "geometry.length=0"], ["geometry.length"]),
    "parameter out of bounds": (["--set", "material.parameters.C10=-1"], ["C10"]),
    "unstable law": (["--set", "material.parameters.C20=-0.5"], ["unstable", "yeoh"]),
    "missing recording": (["--set", "recordings.0.file=absent.csv"], ["absent.csv"]),
    "not a number": (["--set", "geometry.length=long"], ["geometry.length"]),
    "no value": (["--set", "geometry.length"], ["KEY=VALUE"]),
}


@pytest.mark.parametrize(("arguments", "words"), WRONG.values(), ids=WRONG.keys())
def test_wrong_input_ends_with_2_and_says_where(
    cli: Cli, small: Path, arguments: list[str], words: list[str]
) -> None:
    out = small.parent / "out"
    done = cli("direct", small, "-o", out, *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert not any(word in done.stderr for word in FORBIDDEN), done.stderr
    for word in words:
        assert word in done.stderr
    assert not out.exists()


def test_voids_that_cut_the_sleeves_are_refused(cli: Cli, small: Path) -> None:
    text = small.read_text().replace(
        'shape = "plain"',
        'shape = "voided"\nvoid_inner_radius = 8.0\nvoid_outer_radius = 16.0\nvoid_angle = 60.0',
    )
    small.write_text(text)
    done = cli("check", small)
    assert done.returncode == 2
    assert "void_inner_radius" in done.stderr
    assert "sleeve" in done.stderr


def test_a_broken_recording_is_named_with_its_line(cli: Cli, small: Path) -> None:
    file = small.parent / "axial.csv"
    lines = file.read_text().splitlines()
    lines[10] = lines[10].rsplit(",", 1)[0] + ",abc"
    file.write_text("\n".join(lines))
    done = cli("check", small)
    assert done.returncode == 2
    assert "axial.csv" in done.stderr
    assert "11" in done.stderr


def test_a_missing_case_file_is_said_plainly(cli: Cli, tmp_path: Path) -> None:
    done = cli("direct", tmp_path / "none.toml")
    assert done.returncode == 2
    assert "none.toml" in done.stderr
    assert not any(word in done.stderr for word in FORBIDDEN)


def test_an_identification_without_recordings_only_says_that_there_are_none(cli: Cli, small: Path) -> None:
    done = cli("inverse", small, "--hold-out", "axial")
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["error: --hold-out: leaves no channel to fit (axial)"]


def test_an_output_that_is_a_file_is_refused_before_anything_is_solved(cli: Cli, small: Path) -> None:
    done = cli("direct", small, "-o", small.parent / "axial.csv")
    assert done.returncode == 2
    assert "axial.csv" in done.stderr


def test_a_closed_pipe_is_no_error(small: Path) -> None:
    command = f"{sys.executable} -m bushcli.cli list laws | head -n 1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        timeout=60,
    )
    assert done.stderr == ""


def test_doctor_says_what_is_there(command_line: Cli) -> None:
    done = command_line("doctor", "--json")
    facts = json.loads(done.stdout)["facts"]
    assert "dolfinx" in facts


def test_check_writes_its_result_where_it_is_told_to(cli: Cli, small: Path, tmp_path: Path) -> None:
    done = cli("check", small, "-o", tmp_path / "out", "--json", "-q")
    assert done.returncode == 0
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["result.json"]
    written = json.loads((tmp_path / "out" / "result.json").read_text())
    assert written.pop("files") == ["result.json"]
    # The digest by which the same question is known again is of the folder alone.
    assert written.pop("question")
    assert written == json.loads(done.stdout)


def spoiled(case: Path, change: Callable[[int, float], float]) -> None:
    """Change the force column of the case's recording, by row number."""
    file = case.parent / "axial.csv"
    head, *lines = file.read_text().splitlines()
    rows = [line.split(",") for line in lines]
    written = [",".join([*row[:2], f"{change(i, float(row[2])):.6g}"]) for i, row in enumerate(rows)]
    file.write_text("\n".join([head, *written]) + "\n")


def test_check_finds_no_fault_in_the_example(cli: Cli) -> None:
    done = cli("check", EXAMPLE / "case.toml", "--json", "--strict")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["data_faults"] == []
    assert result["problems"] == []


@pytest.mark.parametrize(
    ("kind", "factor", "remedy", "problem"),
    [
        ("sign", -1.0, 'reverse = ["force"]', "faulty_data"),
        # Nothing contradicts a rubber that is too soft.
        ("unit", 1e-3, 'units = { force = "kN" }', "doubtful_data"),
    ],
)
def test_check_says_a_fault_with_its_remedy(
    cli: Cli, small: Path, kind: str, factor: float, remedy: str, problem: str
) -> None:
    fatal = problem == "faulty_data"
    spoiled(small, lambda _, force: factor * force)
    done = cli("check", small)
    assert done.returncode == 0, done.stderr
    assert f"problem {problem}: axial: " in done.stdout
    assert remedy in " ".join(done.stdout.split())
    strict = cli("check", small, "--json", "--strict")
    assert strict.returncode == 1
    result = json.loads(strict.stdout)
    (fault,) = result["data_faults"]
    assert (fault["channel"], fault["kind"], fault["fatal"], fault["samples"]) == ("axial", kind, fatal, 0)
    assert result["problems"] == [
        {"name": problem, "message": f"axial: {fault['where']}", "remedy": fault["remedy"]}
    ]
    # With the key that the remedy names, the fault is gone.
    key = "recordings.0." + ('reverse=["force"]' if kind == "sign" else 'units.force="kN"')
    assert cli("check", small, "--strict", "--set", key).returncode == 0


@pytest.mark.slow
def test_direct_and_inverse_say_faults_before_anything_of_the_law(cli: Cli, small: Path) -> None:
    spoiled(small, lambda i, force: force + (400.0 if i == 250 else 0.0))
    for command in ("direct", "inverse"):
        result = json.loads(cli(command, small, "--json", "-q").stdout)
        assert [fault["kind"] for fault in result["data_faults"]] == ["spikes"], command
        assert result["problems"][0]["name"] == "bad_samples", command


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--fix", "C99"], "no law or effect of this identification has C99"),
        (["--fix", "c30"], 'did you mean "C30"'),
        (["--fix", "C10,C20", "--fix", "C30"], "leaves no parameter of yeoh to identify"),
        (["--model", "yeoh", "--model", "gent", "--fix", "mu1"], "C10, C20, C30, mu, Jm"),
    ],
)
def test_parameters_to_be_kept_must_exist(cli: Cli, small: Path, arguments: list[str], said: str) -> None:
    done = cli("inverse", small, *arguments)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())


def test_check_says_which_columns_were_read_and_which_effects_the_case_has(cli: Cli, small: Path) -> None:
    small.write_text(small.read_text() + '\n[[effects]]\nname = "swaging"\nparameters = {reduction = 0.4}\n')
    done = cli("check", small)
    assert done.returncode == 0, done.stderr
    assert "swaging: reduction 0.4 mm" in done.stdout
    told = " ".join(done.stdout.split())
    assert (
        "axial: displacement = column 2 (displacement_mm) in mm; force = column 3 (force_N) in N; time"
        in told
    )
    (file,) = json.loads(cli("check", small, "--json").stdout)["sources"]
    assert [(one["quantity"], one["number"], one["assumed"]) for one in file["columns"]] == [
        ("displacement", 2, False),
        ("force", 3, False),
        ("time", 1, False),
    ]
