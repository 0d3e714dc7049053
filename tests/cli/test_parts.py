"""A CAD file, a drawing and a section on the command line: meshed, shown, computed, or refused with exit code 2."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

REAL = Path(__file__).parents[1] / "verification" / "data" / "real"
Cli = Callable[..., subprocess.CompletedProcess[str]]

CASE = """
[geometry]
shape = "section"
file = "part.dxf"
[material]
law = "neo_hookean"
[material.parameters]
C10 = 0.5
[[load_cases]]
mode = "axial"
amplitude = 1.0
steps = 2
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "kidney.step").write_bytes((REAL / "kidney_A.step").read_bytes())
    (tmp_path / "part.dxf").write_bytes((REAL / "contoured_A_halfsection.dxf").read_bytes())
    (tmp_path / "case.toml").write_text(CASE)
    return tmp_path


@pytest.mark.slow
def test_a_part_is_meshed_shown_and_computed_from(command_line: Cli, folder: Path) -> None:
    done = command_line("mesh", "kidney.step", "-o", "part", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (
        "inner bond (found: the large coaxial faces nearest to the axis): 1 face, 2513.3 mm2" in done.stdout
    )
    assert "planes of symmetry through the centre, normal to: x, y, z" in done.stdout
    assert (folder / "part" / "geometry.png").stat().st_size > 10_000
    written = (folder / "part" / "case.toml").read_text()
    assert 'file = "../kidney.step"' in written
    checked = command_line("check", "part/case.toml", cwd=folder)
    assert checked.returncode == 0, checked.stderr
    assert "axis found" in checked.stdout
    # A file that somebody has edited is not overwritten.
    (folder / "part" / "case.toml").write_text(written.replace("C10 = 0.5", "C10 = 0.7"))
    assert command_line("mesh", "kidney.step", "-o", "part", cwd=folder).returncode == 0
    assert "C10 = 0.7" in (folder / "part" / "case.toml").read_text()


@pytest.mark.slow
def test_what_a_bond_rule_does_not_find_is_refused_with_a_picture(command_line: Cli, folder: Path) -> None:
    done = command_line(
        "mesh", "kidney.step", "-o", "part", "--set", "geometry.bonds.outer.radius=21", cwd=folder
    )
    assert done.returncode == 2
    assert "geometry.bonds.outer: the rule (radius = 21.0) selects no face" in done.stderr
    assert (folder / "part" / "geometry.png").exists()
    assert not (folder / "part" / "case.toml").exists()
    # The picture is replaced by that of the next attempt, until there is a result, which keeps its own.
    assert command_line("mesh", "kidney.step", "-o", "part", cwd=folder).returncode == 0
    finished = {file: file.read_bytes() for file in (folder / "part").iterdir()}
    done = command_line(
        "mesh", "kidney.step", "-o", "part", "--set", "geometry.bonds.outer.radius=21", cwd=folder
    )
    assert done.returncode == 2
    assert "see the picture part/refused-mesh/geometry.png" in done.stderr
    assert (folder / "part" / "refused-mesh" / "geometry.png").stat().st_size > 10_000
    assert {file: file.read_bytes() for file in finished} == finished


@pytest.mark.slow
def test_a_drawing_is_computed(command_line: Cli, folder: Path) -> None:
    done = command_line("direct", "case.toml", "-o", "out", "--json", "-q", cwd=folder)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["case"]["geometry"]["file"] == "part.dxf"
    assert result["load_cases"][0]["force"][-1] == pytest.approx(375, rel=0.02)
    assert (folder / "out" / "axial-deformed.png").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("geometry.file=prat.dxf", "no such file"),
        ("geometry.shape=cad", "is not a .step"),
        ("geometry.outline=[{from=[1,2],to=[3,4]}]", "either as [[geometry.outline]] or as file"),
        ('effects=[{name="sleeve_compliance"}]', "only those that are drawn"),
    ],
)
def test_what_is_wrong_is_said(command_line: Cli, folder: Path, change: str, said: str) -> None:
    done = command_line("check", "case.toml", "--set", change, cwd=folder)
    assert done.returncode == 2
    assert said in done.stderr


@pytest.mark.slow
def test_an_empty_or_foreign_file_is_refused(command_line: Cli, folder: Path) -> None:
    for name, content in (
        ("empty.step", ""),
        ("foreign.step", "hello"),
        ("foreign.msh", "hello"),
        ("empty.inp", ""),
    ):
        (folder / name).write_text(content)
        done = command_line("mesh", name, cwd=folder)
        assert done.returncode == 2, (name, done.stderr)
        assert done.stderr.startswith(f"error: {name}: "), done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("check", "kidney.step"), "bushcli mesh kidney.step -o DIR writes DIR/case.toml"),
        (("mesh", "part.stl"), "bushcli mesh also reads .step"),
        (("check", "case.toml", "--set", "geometry.contact=sleeve"), 'must be true, false or "sleeves"'),
        (
            ("check", "case.toml", "--set", "load_cases.0.mode=radial", "--set", "load_cases.0.amplitude=30"),
            "closes the gap between the sleeves",
        ),
        (
            ("check", "case.toml", "--set", "geometry.plates={p={rigid=true, youngs_modulus=1000}}"),
            "has rigid = true and a youngs_modulus",
        ),
    ],
)
def test_the_way_out_is_named(command_line: Cli, folder: Path, command: tuple[str, ...], said: str) -> None:
    (folder / "part.stl").write_text("solid part\nfacet normal 0 0 1\nendsolid part\n")
    done = command_line(*command, cwd=folder)
    assert done.returncode == 2
    assert said in done.stderr
