"""Sections and CAD parts against curves of other codes, on default meshes.

The references (data/real: NGSolve of third and fourth order) and how they were made: benchmarks/README.md. Radial load
on the kidney closes its voids' tips from about 1.4 mm on, where the references' own error grows; contact is not needed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import laws
from geometry.shape import Refinement, shapes

DATA = Path(__file__).parent / "data" / "real"
YEOH = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
# Allowed error of the mesh, percent at every point, in addition to the reference's own.
ACCURATE = 1.0

SECTION = {"shape": "section", "file": "contoured_A_halfsection.dxf"}
CONTOURED = {"shape": "cad", "file": "contoured_A.step"}
KIDNEY = {"shape": "cad", "file": "kidney_A.step"}
ACROSS = KIDNEY | {"direction": [0.0, 1.0, 0.0]}

REFERENCES = [
    pytest.param(SECTION, "axial", "contoured_A_axial.csv", id="section-axial"),
    pytest.param(SECTION, "axial", "contoured_A_axialneg.csv", id="section-axial-negative"),
    pytest.param(SECTION, "torsional", "contoured_A_torsional.csv", id="section-torsional"),
    pytest.param(SECTION, "radial", "contoured_A_radial.csv", id="section-radial"),
    pytest.param(SECTION, "conical", "contoured_A_conical.csv", id="section-conical"),
    pytest.param(CONTOURED, "axial", "contoured_A_axial.csv", id="step-axial"),
    pytest.param(CONTOURED, "radial", "contoured_A_radial.csv", id="step-radial"),
    pytest.param(CONTOURED, "torsional", "contoured_A_torsional.csv", id="step-torsional"),
    pytest.param(CONTOURED, "conical", "contoured_A_conical.csv", id="step-conical"),
    pytest.param(KIDNEY, "axial", "kidney_A_axial.csv", id="kidney-axial"),
    pytest.param(KIDNEY, "radial", "kidney_A_radial_x.csv", id="kidney-radial-x"),
    pytest.param(ACROSS, "radial", "kidney_A_radial_y.csv", id="kidney-radial-y"),
]


def made(geometry):
    """Return the shape that a [geometry] table describes."""
    rest = {key: value for key, value in geometry.items() if key != "shape"}
    return shapes()[geometry["shape"]].model_validate(rest, context={"folder": str(DATA)})


@pytest.mark.slow
@pytest.mark.parametrize(("geometry", "mode", "file"), REFERENCES)
def test_default_meshes_meet_other_codes(geometry, mode, file):
    q, force, error = np.loadtxt(DATA / file, delimiter=",", skiprows=2).T
    if geometry["shape"] == "cad":
        # Tetrahedra take seconds per point; benchmarks/real.py compares all of them.
        which = slice(2, None, 3) if mode == "torsional" else slice(1, None, 2)
        q, force, error = q[which], force[which], error[which]
    path = np.radians(q) if modes()[mode].rotational else q
    history = march(prepare(made(geometry), modes()[mode], YEOH), Program(path))
    off = 100 * np.abs(history.force / force - 1)
    assert np.all(off < ACCURATE + error), np.round(off, 2)


@pytest.mark.slow
def test_tetrahedra_in_a_plain_ring(tmp_path, capfd):
    """Radially at 3 and 10 % of the thickness; the force is that of third-order elements, graded, of another code."""
    from tests.parts import draw_to, ring

    shape = shapes()["cad"](
        file=str(draw_to(tmp_path / "ring.step", lambda: ring(12.0, 22.0, 40.0) and None))
    )
    history = march(prepare(shape, modes()["radial"], YEOH), Program(np.array([0.3, 1.0])))
    capfd.readouterr()  # discard OpenCASCADE's output about its export
    np.testing.assert_allclose(history.force, [859.98, 2801.0], rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("plates", [{}, {"tube": {"rigid": True}}])
def test_two_layers_of_a_cad_part_twist_in_series(tmp_path, capfd, plates):
    """The shear of bonded rings is 1 / r^2 whatever their length: 1/k = sum of (1/a^2 - 1/b^2) / (4 pi mu L)."""
    from tests.parts import make

    shape = shapes()["cad"](file=str(make("layers", tmp_path)), plates=plates)
    soft = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 2000.0)
    coarse = Refinement(across=1)
    history = march(prepare(shape, modes()["torsional"], soft, coarse), Program(np.radians([1.0])))
    capfd.readouterr()  # discard OpenCASCADE's output about its export
    compliance = (1 / 10**2 - 1 / 15**2 + 1 / 16**2 - 1 / 22**2) / (4 * np.pi * 1.0 * 40)
    assert history.force[0] / np.radians(1.0) == pytest.approx(1 / compliance, rel=3e-3)


@pytest.mark.slow
def test_two_layers_of_a_cad_part_are_those_of_a_section(tmp_path, capfd):
    """Radially at a tenth of a layer's thickness: each layer has its elements, not the rubber as a whole.

    The section's blocks are converged: 5980.0 N/mm initially, 5979.9 with 5 by 12 elements, where tetrahedra with as
    many elements in both layers together as a plain ring has were 1.6 % stiffer (layers of 5 and 5.5 mm).
    """
    from tests.parts import make

    rigid = {"tube": {"rigid": True}}
    part = shapes()["cad"](file=str(make("layers", tmp_path)), plates=rigid)
    section = shapes()["section"](outline=two_rings("tube"), plates=rigid)
    program = Program(np.array([0.6]))
    forces = [march(prepare(shape, modes()["radial"], YEOH), program).force for shape in (part, section)]
    capfd.readouterr()  # discard OpenCASCADE's output about its export
    np.testing.assert_allclose(*forces, rtol=0.01)


def two_rings(plate: str) -> list[dict[str, object]]:
    """Outline of rubber between radii of 10 and 15 mm and of 16 and 22 mm, with a plate between them."""
    return [
        {"from": [10.0, -20.0], "to": [15.0, -20.0]},
        {"to": [15.0, 20.0], "name": plate},
        {"to": [10.0, 20.0]},
        {"to": [10.0, -20.0], "name": "inner"},
        {"from": [16.0, -20.0], "to": [22.0, -20.0]},
        {"to": [22.0, 20.0], "name": "outer"},
        {"to": [16.0, 20.0]},
        {"to": [16.0, -20.0], "name": plate},
    ]


def test_a_section_of_a_ring_is_that_ring():
    """Its forces equal those of the parametric shape in all modes, although the meshes differ."""
    ring = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    outline = [
        {"from": [12.0, -20.0], "to": [22.0, -20.0]},
        {"to": [22.0, 20.0], "name": "outer"},
        {"to": [12.0, 20.0]},
        {"to": [12.0, -20.0], "name": "inner"},
    ]
    section = shapes()["section"](outline=outline)
    assert section.mirror_planes == ring.mirror_planes
    for mode in ("axial", "radial", "torsional", "conical"):
        program = Program(np.array([0.05 if modes()[mode].rotational else 1.0]))
        forces = [march(prepare(shape, modes()[mode], YEOH), program).force[0] for shape in (ring, section)]
        assert forces[1] == pytest.approx(forces[0], rel=2e-3)


def test_a_rigid_plate_stiffens_more_than_a_steel_one():
    def outline(gap):
        return [
            {"from": [10.0, -20.0], "to": [16.0, -20.0]},
            {"to": [16.0, 20.0], "name": "plate"},
            {"to": [10.0, 20.0]},
            {"to": [10.0, -20.0], "name": "inner"},
            {"from": [16.0 + gap, -20.0], "to": [22.0, -20.0]},
            {"to": [22.0, 20.0], "name": "outer"},
            {"to": [16.0 + gap, 20.0]},
            {"to": [16.0 + gap, -20.0], "name": "plate"},
        ]

    section = shapes()["section"]
    program = Program(np.array([1.0]))
    steel, rigid, soft = (
        march(prepare(section(outline=outline(1.0), plates=plates), modes()["axial"], YEOH), program).force[0]
        for plates in ({}, {"plate": {"rigid": True}}, {"plate": {"youngs_modulus": 20.0}})
    )
    assert soft < steel < rigid < 1.001 * steel
