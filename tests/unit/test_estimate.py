"""The number of cells of a free mesh is estimated before the mesher starts, and refused where it is too large."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.cli import main
from geometry.estimate import Fine, tetrahedra, triangles
from geometry.mesh import build
from geometry.shape import Refinement, shapes

DATA = Path(__file__).parents[1] / "verification" / "data" / "real"
SECTION, CAD = shapes()["section"], shapes()["cad"]


def test_the_integrals_are_those_of_the_density() -> None:
    e, h, g = 0.5, 2.0, 1.3
    d = np.linspace(0.0, (h - e) / g, 100_001)
    local = e + g * d
    per_angle = np.trapezoid(d / local**2, d), np.trapezoid(d / local**3, d)
    per_measure = np.trapezoid(1 / local**2, d), np.trapezoid(1 / local**3, d)
    base = triangles(1.0, 1.0, g, ()), tetrahedra(1.0, 1.0, g, ())
    assert triangles(0.0, h, g, [Fine(0, 3.0, e)]) == pytest.approx(
        3 * 0.5 * np.pi * per_angle[0] * base[0], rel=1e-6
    )
    assert triangles(0.0, h, g, [Fine(1, 3.0, e)]) == pytest.approx(3 * per_measure[0] * base[0], rel=1e-6)
    assert tetrahedra(0.0, h, g, [Fine(1, 3.0, e)]) == pytest.approx(
        3 * 0.5 * np.pi * per_angle[1] * base[1], rel=1e-6
    )
    assert tetrahedra(0.0, h, g, [Fine(2, 3.0, e)]) == pytest.approx(3 * per_measure[1] * base[1], rel=1e-6)
    # A boundary that is no finer than the inside adds no cells.
    assert tetrahedra(5.0, h, g, [Fine(2, 3.0, 9.0)]) == tetrahedra(5.0, h, g, ())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "dimension", "mirrors", "refinement"),
    [
        (SECTION(**SECTION.examples[1]), 2, "", Refinement()),
        (SECTION(**SECTION.examples[1]), 2, "", Refinement(across=16)),
        (SECTION(**SECTION.examples[2]), 2, "", Refinement(across=16)),
        (SECTION(file=str(DATA / "contoured_A_halfsection.dxf")), 2, "", Refinement(across=12)),
        (CAD(file=str(DATA / "kidney_A.step")), 3, "yz", Refinement()),
        (CAD(file=str(DATA / "kidney_A.step")), 3, "xyz", Refinement(across=4)),
        (CAD(file=str(DATA / "contoured_A.step")), 3, "xy", Refinement()),
    ],
)
def test_meshes_have_about_as_many_cells_as_foreseen(shape, dimension, mirrors, refinement) -> None:
    mesh = build(shape, dimension, frozenset(mirrors), refinement)
    cells = mesh.mesh.topology.index_map(dimension).size_global
    assert 0.5 < shape.cells(dimension, frozenset(mirrors), refinement) / cells < 2.0


def outline(length: float) -> str:
    half = length / 2
    edges = [
        {"from": [10.0, -half], "to": [20.0, -half]},
        {"to": [20.0, half], "name": "outer"},
        {"to": [10.0, half]},
        {"to": [10.0, -half], "name": "inner"},
    ]
    return (
        json.dumps(edges).replace('"from":', "from =").replace('"to":', "to =").replace('"name":', "name =")
    )


HEAD = '[material]\nlaw = "neo_hookean"\nparameters = { C10 = 0.5 }\n[[load_cases]]\nmode = "radial"\namplitude = 0.5\n'


@pytest.mark.parametrize(
    ("geometry", "mesh"),
    [
        # Radii in millimetres, the length in units of 20 micrometres.
        (f'shape = "section"\noutline = {outline(2000.0)}', "elements_across = 12"),
        (f'shape = "section"\noutline = {outline(40.0)}', "elements_across = 90"),
        (f'shape = "cad"\nfile = "{DATA / "kidney_A.step"}"', "elements_across = 40"),
        (f'shape = "section"\nfile = "{DATA / "contoured_A_halfsection.dxf"}"', "elements_across = 150"),
    ],
    ids=["long", "outline", "cad", "drawing"],
)
def test_a_free_mesh_that_would_be_too_large_is_refused_before_it_is_made(
    geometry: str, mesh: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("the mesher was started")

    monkeypatch.setattr("geometry.cad.meshing.part_mesh", never)
    monkeypatch.setattr("geometry.section.meshing.section_mesh", never)
    case = tmp_path / "case.toml"
    case.write_text(f"{HEAD}[geometry]\n{geometry}\n[mesh]\n{mesh}\n")
    for command in ("check", "mesh", "direct"):
        done = CliRunner().invoke(main, [command, str(case)])
        assert done.exit_code == 2, done.output
        assert "the mesh for mode radial would have about" in done.output
        assert "mm" in done.output


def test_a_file_without_a_case_is_refused_too() -> None:
    done = CliRunner().invoke(main, ["mesh", str(DATA / "kidney_A.step"), "--set", "mesh.elements_across=60"])
    assert done.exit_code == 2
    assert "would have about" in done.output


@pytest.mark.parametrize("key", ["elements_along", "elements_around"])
def test_numbers_of_elements_that_a_free_mesh_has_not_are_refused(key: str, tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    case.write_text(
        f'{HEAD}[geometry]\nshape = "cad"\nfile = "{DATA / "kidney_A.step"}"\n[mesh]\n{key} = 12\n'
    )
    done = CliRunner().invoke(main, ["check", str(case)])
    assert done.exit_code == 2
    assert f"mesh.{key} has no meaning for this shape" in done.output
    assert "elements_across refines the mesh" in done.output
