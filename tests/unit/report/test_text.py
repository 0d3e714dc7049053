"""Documents of small results, and how a document stands on a terminal and in a pipe."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from bushcli.case import load_case
from bushcli.recording import RecordedProgram, read_recording
from bushcli.report.document import Table
from bushcli.report.results import CheckResult, FitResult, MeshResult
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


def rows_of(document):
    """Return the rows of each table by their first cell, by title; a table without a title has its section's."""
    tables = [
        (one.title or section.heading, one)
        for section in document.sections
        for one in section.blocks
        if isinstance(one, Table)
    ]
    return {title: {row[0]: row[1:] for row in one.rows} for title, one in tables}


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
    document = direct(channel("axial", 645.0, 363.0))
    text = printed(document)
    assert text.index("sim/meas") < text.index(document.headline)
    assert document.tone == "bad"


def test_problems_come_with_their_remedy(case, fit):
    text = printed(fit_document(FitResult(case(), fit)))
    assert "problem at_bound: C20 lies on its bound" in text
    assert "remedy: choose another law" in text


def test_a_fit_shows_parameters_with_unit_bounds_and_stability(case, fit):
    rows = rows_of(fit_document(FitResult(case(), fit)))
    assert rows["Law yeoh"]["C10"] == ("0.2000", "0.0050", "MPa", "1.00e-06 to inf")
    assert rows["Law yeoh"]["C20"][-1].endswith("(at bound)")
    fitted = rows["Fitted to 3 coupon tests, relative weighting"]
    assert fitted["planar"] == ("planar", "20 %", "stretch 1.00 to 3.00", "all")
    assert fitted["second"][-1] == "0.50 to 2.50"


def test_names_in_brackets_are_no_markup(direct, channel):
    text = printed(direct(channel("axial", 100.0, 100.0, name="[red]rig[/red] 2")), terminal=True)
    assert "[red]rig[/red] 2" in text


def test_without_recordings_the_simulated_stiffness_is_shown(direct, channel):
    rows = rows_of(direct(channel("axial", 100.0), channel("uniaxial", 2.0)))
    assert rows["Simulated stiffness"].keys() == {"axial", "uniaxial"}


def test_a_case_is_summed_up(case):
    used = case("my [bushing]")
    curves = [read_recording(source) for source in used.recordings]
    rows = rows_of(check_document(CheckResult(used, curves, [], protocol(used, curves, []), (), [None])))
    seen = rows["my [bushing]"]
    assert seen["geometry"] == ("plain: inner radius 9 mm, outer radius 18 mm, length 34 mm",)
    assert seen["law"] == ("yeoh: C10 = 0.5, C20 = -0.05, C30 = 0.01",)
    assert seen["bulk modulus"] == ("infinite: incompressible",)
    assert rows["Recordings"] == {"measured": ("axial", "6", "1", "0", "5.00", "mm", "0", "500", "N")}


def test_meshes_are_listed(case):
    mesh = Meshed("section", ("axial", "torsional"), 2, 66, 299, {"inner": 11}, {"rubber": 66})
    rows = rows_of(mesh_document(MeshResult(case(), [mesh])))
    assert rows["Meshes"] == {"section": ("axial, torsional", "inner", "66", "299")}


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
    document = check_document(CheckResult(used, [], [], protocol(used, [], []), (), [None, read, None]))
    rows = rows_of(document)["Load cases"]
    assert rows["torsional"] == (
        "torsional",
        "3 segments, up to 6 steps each, 2.00 deg/s",
        "-5.00",
        "10.0",
        "deg",
    )
    assert rows["axial"] == ("axial", "4 points of program.csv", "-2.00", "1.50", "mm")
    assert rows["path"][1] == "3 poses: ux, uz moved; ry free"
