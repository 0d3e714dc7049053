"""`bushcli export` from a case file and from the folders of other commands, and the exports that it refuses."""

import json
import os
from pathlib import Path

import pytest

CASE = """
title = "12/22/40"
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 6
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
[[load_cases]]
mode = "axial"
amplitude = 4.0
rate = 1.0
steps = 4
"""
SERIES = """
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.25, tau1 = 3.0 }
"""
GAIN = """
[[effects]]
name = "gain"
parameters = { error = 0.05 }
"""

MODES = ("radial", "conical", "torsional")


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


def test_a_card_goes_to_stdout(cli, case):
    done = cli("export", case, "--to", "abaqus", "--units", "si", "--density", 1100)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-5:] == [
        "*MATERIAL, NAME=rubber_12_22_40",
        "*DENSITY",
        "1100",
        "*HYPERELASTIC, YEOH",
        "500000, -50000, 10000, 1e-09, 0, 0",
    ]
    assert "units: N, m, s; stress Pa" in done.stdout


def test_a_file_is_written_and_replaced_but_nobody_elses(cli, case, tmp_path):
    target = tmp_path / "rubber.k"
    for _ in range(2):
        done = cli("export", case, "--to", "lsdyna", "-o", target, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["program"] == "lsdyna"
        assert "*MAT_077_H_TITLE" in target.read_text()
    for content in ("mine", "# notes on bushcli: do not lose\n", "title = 'run with bushcli direct'\n"):
        target.write_text(content)
        done = cli("export", case, "--to", "lsdyna", "-o", target)
        assert done.returncode == 2
        assert "was not written by an earlier export" in done.stderr
        assert target.read_text() == content


def test_a_pipe_is_not_replaced(cli, case, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for target in (tmp_path / "pipe", "/dev/null", tmp_path):
        done = cli("export", case, "--to", "abaqus", "-o", target)
        assert done.returncode == 2
        assert "-o FILE" in done.stderr
    assert (tmp_path / "pipe").is_fifo()


def test_an_export_does_not_replace_its_own_case(cli, case):
    before = case.read_text()
    case.write_text("# bushcli direct case.toml\n" + before)
    done = cli("export", case, "--to", "abaqus", "-o", case)
    assert done.returncode == 2
    assert "was not written by an earlier export" in done.stderr
    assert case.read_text().endswith(before)


def test_the_folder_of_direct_gives_its_curves_from_any_folder(cli, case, tmp_path):
    out = tmp_path / "out"
    assert cli("direct", "case.toml", "-q", "--no-fields", "-o", "out", cwd=tmp_path).returncode == 0
    done = cli("export", out, "--to", "csv", cwd=Path("/"))
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in done.stdout.splitlines()]
    assert rows[0] == ["channel", "mode", "time_s", "displacement_mm_or_rad", "force_N_or_moment_Nmm"]
    curve = json.loads((out / "result.json").read_text())["load_cases"][0]
    assert [float(row[3]) for row in rows[1:]] == pytest.approx(curve["displacement"])
    assert [float(row[4]) for row in rows[1:]] == pytest.approx(curve["force"])


def test_an_identified_law_is_exported(cli, tmp_path):
    out = tmp_path / "fit"
    root = Path(__file__).parents[2]
    assert (
        cli("fit", root / "examples/batch/case.toml", "--model", "mooney_rivlin", "-q", "-o", out).returncode
        == 0
    )
    found = json.loads((out / "result.json").read_text())["parameters"]
    done = cli("export", out, "--to", "calculix")
    assert done.returncode == 0, done.stderr
    numbers = [float(x) for x in done.stdout.splitlines()[-1].split(",")]
    assert numbers == pytest.approx([found["C10"]["value"], found["C01"]["value"], 1e-3])


def test_a_case_without_parameters_is_fitted_first(cli):
    root = Path(__file__).parents[2]
    done = cli("export", root / "examples/batch/case.toml", "--to", "febio", "-q")
    assert done.returncode == 0, done.stderr
    assert 'type="Yeoh"' in done.stdout


WRONG = {
    "unknown program": (["--to", "abacus"], 'did you mean "abaqus"?'),
    "unknown units": (["--to", "abaqus", "--units", "N-mm"], 'did you mean "N-mm-s"?'),
    "law": (
        ["--to", "abaqus", "--set", 'material={law="gent", parameters={mu=1.0, Jm=30.0}}'],
        "no gent law",
    ),
    "incompressible": (
        ["--to", "calculix", "--set", "material.bulk_modulus=inf"],
        "an exactly incompressible",
    ),
    "no such effect": (["--to", "abaqus", "--without", "mullins"], "not an effect of this case"),
    "no matrix": (["--to", "chrono"], "--stiffness-matrix"),
    "no radial curve": (["--to", "adams"], 'mode = "radial"'),
    "a folder": (["--to", "abaqus", "-o", "/tmp"], "is a folder"),
    "no folder": (["--to", "abaqus", "-o", "/nowhere/card.inp"], "does not exist"),
    "fmu to stdout": (["--to", "fmu2"], "-o FILE.fmu"),
    "json to stdout": (["--to", "abaqus", "--json"], "-o FILE"),
}


@pytest.mark.parametrize(("arguments", "words"), WRONG.values(), ids=WRONG.keys())
def test_wrong_input_ends_with_2_and_one_sentence(cli, case, arguments, words):
    done = cli("export", case, *arguments)
    assert done.returncode == 2, done.stdout
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_folder_without_a_result_is_refused(cli, tmp_path):
    done = cli("export", tmp_path, "--to", "abaqus")
    assert done.returncode == 2
    assert "folder without result.json" in done.stderr
    (tmp_path / "result.json").write_text('{"command": "doctor"}')
    done = cli("export", tmp_path, "--to", "abaqus")
    assert done.returncode == 2
    assert "is not the result of a command on a case" in done.stderr


def test_an_effect_can_be_left_out(cli, case):
    case.write_text(CASE + SERIES)
    assert "no model for the effect viscoelasticity" in cli("export", case, "--to", "calculix").stderr
    done = cli("export", case, "--to", "calculix", "--without", "viscoelasticity")
    assert done.returncode == 0, done.stderr
    assert "500000" not in done.stdout
    assert "0.5, -0.05, 0.01, 0.001, 1e+30, 1e+30" in done.stdout


def test_a_property_file_has_the_curve_after_a_long_rest(cli, case):
    turns = "".join(
        f'[[load_cases]]\nmode = "{mode}"\namplitude = 2.0\nrate = 1.0\nsteps = 4\n' for mode in MODES
    )
    case.write_text(CASE + turns)
    plain = cli("export", case, "--to", "adams").stdout
    case.write_text(CASE + turns + SERIES)
    done = cli("export", case, "--to", "adams")
    assert done.returncode == 0, done.stderr
    assert "$ fully relaxed force: without viscoelasticity" in done.stdout
    rows = [line.split() for line in plain.splitlines() if line.startswith(" ")]
    found = [line.split() for line in done.stdout.splitlines() if line.startswith(" ")]
    assert [float(row[1]) for row in found] == pytest.approx([float(row[1]) for row in rows])


def test_curves_and_matrix_are_of_one_state(cli, case, tmp_path):
    """A sudden step is 1 + g times as stiff as a long rest; curves and lines of the matrix agree in both states."""
    head, _, _ = CASE.partition("[[load_cases]]")
    radial = '[[load_cases]]\nmode = "axial"\namplitude = 0.02\nrate = 0.01\nsteps = 2\n'
    case.write_text(head + radial + SERIES)
    slopes = {}
    for option in ((), ("--unrelaxed",)):
        out = tmp_path / f"out{len(option)}"
        done = cli("direct", case, "-q", "--stiffness-matrix", *option, "-o", out, "--json")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)["load_cases"][0]
        assert found["stiffness_matrix_state"] == ("unrelaxed" if option else "relaxed")
        axial = found["stiffness_matrix_start"][2][2]
        assert found["stiffness_matrix"][2][2] == pytest.approx(axial, rel=5e-3)
        text = cli("export", out, "--to", "adams", *option).stdout
        block = text.partition("[FZ_CURVE]")[2].partition("$")[0].splitlines()[2:]
        q, force = (float(word) for word in block[-1].split())
        assert force / q == pytest.approx(axial, rel=5e-3)
        assert ("unrelaxed force: as in a sudden step" if option else "fully relaxed force") in text
        slopes[option] = axial
        # The file of the other state has no matrix, and the message says how to get it.
        other = ("--unrelaxed",) if not option else ()
        for program in ("adams", "chrono"):
            refused = cli("export", out, "--to", program, *other)
            assert refused.returncode == 2
            assert f"--stiffness-matrix{''.join(f' {one}' for one in other)} -o OUT" in refused.stderr
        assert cli("export", out, "--to", "chrono", *option).returncode == 0
    assert slopes["--unrelaxed",] == pytest.approx(1.25 * slopes[()], rel=5e-3)


def test_a_state_is_refused_where_there_is_none(cli, case):
    done = cli("export", case, "--to", "csv", "--unrelaxed")
    assert done.returncode == 2
    assert "adams, altair and chrono" in done.stderr
    done = cli("direct", case, "--unrelaxed")
    assert done.returncode == 2
    assert "--stiffness-matrix" in done.stderr


def test_a_direct_curve_is_without_the_rig(cli, case):
    plain = cli("export", case, "--to", "json").stdout
    case.write_text(CASE + GAIN)
    with_gain = cli("export", case, "--to", "json")
    assert with_gain.returncode == 0, with_gain.stderr
    force = json.loads(plain)["curves"][0]["force"]
    found = json.loads(with_gain.stdout)
    assert found["curves"][0]["force"] == pytest.approx(force, rel=1e-3)
    assert found["remarks"] == ["without effects of the rig: gain"]


PATH = """
[[load_cases]]
mode = "path"
steps = 2
[load_cases.path]
time = [0.0, 1.0]
ux = [0.0, 1.0]
uz = [0.0, 2.0]
"""


@pytest.mark.parametrize("program", ["csv", "fmu2"])
def test_a_path_of_six_motions_is_no_curve_and_that_is_said(cli, case, tmp_path, program):
    target = tmp_path / "bushing"
    case.write_text(CASE + PATH)
    for _ in range(2):  # a table or an FMU that bushcli wrote is replaced
        done = cli("export", case, "--to", program, "-o", target)
        assert done.returncode == 0, done.stderr
    assert "without path: a path of several motions gives no curve of one" in done.stderr
    if program == "csv":
        assert {line.split(",")[0] for line in target.read_text().splitlines()} == {"channel", "axial"}
    else:
        assert "axial: the force law deviates by" in done.stderr
    case.write_text(CASE.partition("[[load_cases]]")[0] + PATH)
    done = cli("export", case, "--to", program, "-o", target)
    assert done.returncode == 2
    assert "has only paths of six motions" in done.stderr


def test_an_fmu_without_a_file_is_refused_before_anything_is_simulated(cli, case):
    done = cli("export", case, "--to", "fmu3")
    assert done.returncode == 2
    assert "error: bushcli export: an FMU is an archive, not text (-o FILE.fmu)" in done.stderr
    assert "step" not in done.stderr
