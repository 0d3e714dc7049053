"""What every deformation mode must do; a new file in cases/modes needs no change here to be tested."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes, setting_for
from cases.program import Program
from cases.simulate import prepare
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)
SETTINGS = [
    pytest.param(mode, dimension, id=f"{mode.name}-{dimension}D")
    for mode in modes().values()
    for dimension in (2, 3)
    if dimension == 3 or mode.section is not None
]
BUSHING_SETTINGS = [case for case in SETTINGS if case.values[0].specimen == "bushing"]
# Large enough that a linearised motion would show, small enough for the coarse mesh.
LARGE = 0.3
# Tolerance close to rounding, for tests that compare forces with each other.
SHARP = 1e-11


def points(dimension):
    """Return 20 points of a bushing's size (fixed seed), shape (dimension, 20), mm; radii are positive."""
    x = np.random.default_rng(3).uniform(-20, 20, (dimension, 20))
    if dimension == 2:
        x[0] = np.abs(x[0]) + 1
    return x


def amplitude(mode):
    """Return a moderate q: rad, a quarter of the rubber's thickness in mm, or a strain."""
    return 0.15 if mode.rotational else 2.5 if mode.specimen == "bushing" else 0.3


@pytest.fixture(scope="module")
def model(rubber):
    """Return the coarse model of a mode in two or three dimensions; each is built once."""

    @cache
    def make(name, dimension):
        mode = modes()[name]
        shape = shapes()["plain" if mode.specimen == "bushing" else "coupon"]
        # A mode without a section is solved in three dimensions.
        asked = mode if dimension == 2 else replace(mode, section=None)
        return prepare(shape(**shape.examples[0]), asked, rubber("yeoh", 50.0), COARSE)

    return make


@pytest.mark.parametrize(("mode", "dimension"), SETTINGS)
def test_no_motion_at_rest(mode, dimension):
    motion = setting_for(mode, dimension).motion(points(dimension), 0.0)
    np.testing.assert_array_equal(motion, np.zeros_like(motion))


@pytest.mark.parametrize(
    "mode", [m for m in modes().values() if m.specimen == "bushing"], ids=lambda m: m.name
)
@pytest.mark.parametrize("q", [-LARGE, LARGE, 2.0])
def test_motion_keeps_all_distances(mode, q):
    x = points(3)
    y = x + mode.solid.motion(x, q)
    np.testing.assert_allclose(
        np.linalg.norm(y[:, :, None] - y[:, None, :], axis=0),
        np.linalg.norm(x[:, :, None] - x[:, None, :], axis=0),
        atol=1e-12,
    )


@pytest.mark.parametrize("mode", [m for m in modes().values() if m.section is not None], ids=lambda m: m.name)
def test_section_and_solid_move_alike(mode):
    """The half-plane's displacement (u_r, [angle,] u_z) is the solid's, in cylindrical coordinates."""
    radius, height = points(2)
    x, y, z = np.stack([radius, 0 * radius, height]) + mode.solid.motion(
        np.stack([radius, 0 * radius, height]), LARGE
    )
    section = mode.section.motion(points(2), LARGE)
    np.testing.assert_allclose(section[0], np.hypot(x, y) - radius, atol=1e-12)
    np.testing.assert_allclose(section[-1], z - height, atol=1e-12)
    angle = section[1] if len(section) == 3 else 0 * radius
    np.testing.assert_allclose(angle, np.arctan2(y, x), atol=1e-12)


@pytest.mark.parametrize(("mode", "dimension"), SETTINGS)
@pytest.mark.parametrize("q", [-LARGE, 0.0, LARGE])
def test_rate_is_the_derivative_of_the_motion(mode, dimension, q):
    setting, x, step = setting_for(mode, dimension), points(dimension), 1e-5
    difference = (setting.motion(x, q + step) - setting.motion(x, q - step)) / (2 * step)
    # Truncation: step^2 / 6 times the third derivative, at most 20 mm.
    np.testing.assert_allclose(setting.rate(x, q), difference, atol=1e-8)


@pytest.mark.parametrize(("mode", "dimension"), SETTINGS)
def test_work_of_the_force_is_the_stored_energy(mode, dimension, model):
    """Gauss-Legendre integration of Q dq, exact to degree 13, against the energy at the end of the path."""
    end = amplitude(mode)
    nodes, weights = np.polynomial.legendre.leggauss(7)
    q = np.append(0.5 * end * (nodes + 1), end)
    history = march(model(mode.name, dimension), Program(q), tolerance=SHARP)
    work = 0.5 * end * np.dot(weights, history.force[:-1])
    assert work == pytest.approx(history.energy[-1], rel=1e-7)


@pytest.mark.parametrize(("mode", "dimension"), SETTINGS)
def test_force_works_against_the_motion(mode, dimension, model):
    end = amplitude(mode) / 3
    there, back = (
        march(model(mode.name, dimension), Program(np.array([q])), tolerance=SHARP) for q in (end, -end)
    )
    assert there.force[0] > 0 > back.force[0]
    if mode.reversed_by is not None:
        # The plain bushing is symmetric about all planes: forces in opposite directions are equal.
        assert back.force[0] == pytest.approx(-there.force[0], rel=1e-8)


@pytest.mark.parametrize(("mode", "dimension"), BUSHING_SETTINGS)
def test_both_sleeves_together_meet_no_resistance(mode, dimension, model, rubber):
    """The whole bushing moves rigidly; rotations are finite."""
    both = replace(mode, driven=dict(mode.driven) | dict(mode.held), held={})
    if dimension == 3:
        both = replace(both, section=None)
    shape = shapes()["plain"]
    free = prepare(shape(**shape.examples[0]), both, rubber("yeoh", 50.0), COARSE)
    end = amplitude(mode)
    history = march(free, Program(np.linspace(0, end, 4)))
    against = march(model(mode.name, dimension), Program(np.array([end])))
    np.testing.assert_allclose(history.force, 0, atol=1e-9 * against.force[0])
    np.testing.assert_allclose(history.energy, 0, atol=1e-9 * against.energy[0])


@pytest.mark.parametrize(("mode", "dimension"), SETTINGS)
def test_force_is_the_derivative_of_the_energy(mode, dimension, model):
    q = amplitude(mode) * (0.8 + 1e-3 * np.array([-2, -1, 1, 2, 0]))
    history = march(model(mode.name, dimension), Program(q), tolerance=SHARP)
    E, step = history.energy, 1e-3 * amplitude(mode)
    slope = (8 * (E[2] - E[1]) - (E[3] - E[0])) / (12 * step)
    # Some tens of times the rounding of the energy over the step, about 1e-16 / 1e-3.
    assert slope == pytest.approx(history.force[4], rel=1e-8)


@pytest.mark.parametrize(
    "mode",
    [mode for mode in modes().values() if mode.unit_stiffness or mode.unit_slope],
    ids=lambda m: m.name,
)
def test_the_closed_form_of_a_mode_holds_what_is_solved(mode, model):
    """Incompressible Yeoh rubber at a small displacement; stiffness is compared per unit of the law's shear modulus."""
    solved = model(mode.name, 3 if mode.section is None else 2)
    if mode.specimen == "coupon":
        low = high = mode.unit_slope
    else:
        ring = solved.mesh.shape.annulus
        low = mode.unit_stiffness(ring.inner_radius, ring.outer_radius, ring.shortest)[0]
        high = mode.unit_stiffness(ring.inner_radius, ring.outer_radius, ring.longest)[1]
    q = 1e-3 * amplitude(mode)
    stiffness = march(solved, Program(np.array([q]))).force[0] / q
    shear = solved.law.shear_modulus(
        **{name: float(solved.constants[name].value) for name in solved.parameters.law_names}
    )
    # A tenth is allowed, because the rubber of these models is compressible (50 MPa) and the mesh is coarse.
    assert 0.9 * low <= stiffness / shear <= 1.1 * high


@pytest.mark.parametrize(
    "mode", [mode for mode in modes().values() if mode.specimen == "bushing"], ids=lambda m: m.name
)
def test_a_mode_says_how_far_it_moves_the_sleeve_sideways(mode):
    """`sideways`, which keeps the sleeves from meeting, is the displacement of a point of the axis per unit of q."""
    centre = np.zeros((3, 1))
    moved = np.linalg.norm((mode.solid.motion(centre, 0.5) - mode.solid.motion(centre, 0.0))[:2])
    assert mode.sideways == pytest.approx(0.0 if mode.rotational else moved / 0.5)
    # Of a bar 40 mm long whose end a tilt of 30 degrees moves by 10 mm.
    expected = 10.0 if mode.name == "conical" else mode.sideways * math.radians(30.0)
    assert mode.moves_across(math.radians(30.0), 20.0) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("name", "motion"), [("axial", "uz"), ("radial", "ux"), ("torsional", "rz"), ("conical", "ry")]
)
def test_a_mode_drives_one_motion_of_the_sleeve(name, motion):
    assert modes()[name].motions == {motion}
