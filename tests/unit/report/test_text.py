"""The output on a terminal, and into a pipe."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from bushcli.case import load_case
from bushcli.recording import RecordedProgram, read_recording
from bushcli.report.results import Checked, FitResult, MeshResult
from bushcli.report.views.check import check_document
from bushcli.report.views.direct import direct_document
from bushcli.report.views.fit import fit_document
from bushcli.report.views.mesh import mesh_document
from bushcli.report.writers.terminal import terminal_text
from bushcli.simulate.meshes import Meshed
from bushcli.standards.protocol import protocol


def printed(document, terminal=False):
    out = io.StringIO()
    colours = "standard" if terminal else None
    console = Console(file=out, width=120, force_terminal=terminal, highlight=False, color_system=colours)
    console.print(terminal_text(document))
    return out.getvalue()


@pytest.fixture
def direct(answer, channel):
    def make(*channels, fit=None, conditions=()):
        found = answer(*channels, conditions=conditions, fit=fit)
        return direct_document(found)

    return make


def test_piped_output_is_plain_and_aligned(direct, channel):
    text = printed(direct(channel("axial", 645.0, 363.0), channel("torsional", 1800.0, 18000.0)))
    assert text.isascii()
    assert "\x1b" not in text
    lines = text.splitlines()
    head = next(line for line in lines if line.startswith("channel"))
    rows = [line for line in lines if "secant, N" in line]
    assert len(rows) == 2
    # Numbers are right-aligned under their heads.
    end = head.index("measured") + len("measured")
    assert [row[:end].split()[-1] for row in rows] == ["363", "314"]
    assert all(row[end - 1] != " " for row in rows)


def test_a_terminal_gets_rules_and_colour(direct, channel):
    text = printed(direct(channel("axial", 645.0, 363.0)), terminal=True)
    assert "\x1b[" in text
    assert "─" in text


def test_the_verdict_stands_under_the_table(direct, channel):
    text = printed(direct(channel("axial", 645.0, 363.0)))
    assert text.index("sim/meas") < text.index("Too stiff: axial outside the accepted 10 %.")
    assert "78 % too stiff" in text
    assert "no" in text.split("within 10 %")[1].splitlines()[1]


def test_problems_come_with_their_remedy(case, fit):
    text = printed(fit_document(FitResult(case(), fit)))
    assert "problem at_bound: C20 lies on its bound" in text
    assert "remedy: choose another law" in text


def test_a_fit_shows_parameters_with_unit_bounds_and_stability(case, fit):
    lines = printed(fit_document(FitResult(case(), fit))).splitlines()
    row = next(line.split() for line in lines if line.startswith("C10"))
    assert row == ["C10", "0.2000", "0.0050", "MPa", "1.00e-06", "to", "inf"]
    assert any("(at bound)" in line for line in lines if line.startswith("C20"))
    planar = next(line for line in lines if line.startswith("planar"))
    assert planar.split() == ["planar", "planar", "20", "%", "stretch", "1.00", "to", "3.00", "all"]
    assert any("0.50 to 2.50" in line for line in lines if line.startswith("second"))


def test_names_in_brackets_are_no_markup(direct, channel):
    text = printed(direct(channel("axial", 100.0, 100.0, name="[red]rig[/red] 2")), terminal=True)
    assert "[red]rig[/red] 2" in text


def test_without_recordings_the_simulated_stiffness_is_shown(direct, channel):
    text = printed(direct(channel("axial", 100.0), channel("uniaxial", 2.0)))
    assert "Simulated stiffness" in text
    assert "measured" not in text


def test_a_case_is_summed_up(case):
    used = case("my [bushing]")
    curves = [read_recording(source) for source in used.recordings]
    text = printed(check_document(Checked(used, curves, [], protocol(used, curves, []), (), [None])))
    assert "my [bushing]" in text
    assert "plain: inner radius 9 mm, outer radius 18 mm, length 34 mm" in text
    assert "yeoh: C10 = 0.5, C20 = -0.05, C30 = 0.01" in text
    assert "infinite: incompressible" in text
    row = next(line.split() for line in text.splitlines() if line.startswith("measured"))
    assert row == ["measured", "axial", "6", "1", "0", "5.00", "mm", "0", "500", "N"]


def test_meshes_are_listed(case):
    mesh = Meshed("section", ("axial", "torsional"), 2, 66, 299, {"inner": 11}, {"rubber": 66})
    text = printed(mesh_document(MeshResult(case(), [mesh])))
    assert "axial, torsional" in text
    assert "299" in text


def test_load_cases_are_shown_with_their_range_rate_and_motions(tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(
        """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "neo_hookean"
[material.parameters]
C10 = 0.5
[[load_cases]]
mode = "torsional"
path = [0, 10, -5, 0]
rate = 2.0
steps = 6
[[load_cases]]
mode = "axial"
file = "program.csv"
[[load_cases]]
mode = "path"
path = {time = [0, 1, 2], ux = [0, 0.5, 0.5], uz = [0, 0, 1], free = ["ry"]}
"""
    )
    (tmp_path / "program.csv").write_text("displacement_mm\n0\n1.5\n-2\n0\n")
    used = load_case(file)
    read = RecordedProgram("torsional", "torsional", None, np.array([0.0, 1.5, -2.0, 0.0]))
    text = printed(check_document(Checked(used, [], [], protocol(used, [], []), (), [None, read, None])))
    rows = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    words = {name: " ".join(row.split()) for name, row in rows.items()}
    assert words["torsional"] == (
        "torsional torsional 3 segments, up to 6 steps each, 2.00 deg/s -5.00 10.0 deg"
    )
    assert words["axial"] == "axial axial 4 points of program.csv -2.00 1.50 mm"
    assert "3 poses: ux, uz moved; ry free" in words["path"]
