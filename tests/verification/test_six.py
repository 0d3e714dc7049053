"""Paths of six motions and the 6 x 6 stiffness: closed forms, another code, differences, symmetry, free motions."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bushcli.effects.effect import effect
from cases.equilibrium import Equilibrium
from cases.feature import Feature, Installed
from cases.local import LocalStiffness
from cases.march import NotConverged, march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.recorder import Recorder
from cases.rigid import tangent
from cases.simulate import prepare
from cases.six import SixPath, rotation, skew, twist_of
from cases.six import tangent as tangent_of
from forms.branch import branches
from forms.potential import Attached
from geometry.mesh import build
from geometry.shape import Refinement, shapes

DATA = Path(__file__).parent / "data"
REFERENCE = json.loads((DATA / "six.json").read_text())
COARSE = Refinement(across=2, along=4, around=8)
DEGREE = np.pi / 180.0
# All six motions at once.
MIXED = np.array([0.8, 0.3, 2.0, 2 * DEGREE, 1 * DEGREE, 6 * DEGREE])
SHARP = 1e-11


def path_of(*poses, free=(), whole=False):
    motion = np.array([np.zeros(6), *poses])
    return SixPath(np.arange(float(len(motion))), motion, tuple(free), whole)


def model_of(six, rubber, refinement=COARSE, shape=None, features=()):
    plain = shape or shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    return prepare(plain, modes()["path"].follow(six), rubber, refinement, features=features)


def matrices(six, rubber, targets, **options):
    """Return the tangent at every target, and the history."""
    model, found = model_of(six, rubber, **options), []

    def observe(solver):
        solver.factorise()
        found.append(tangent(model, solver.factor, solver.q))

    return found, march(model, Program(np.array(targets)), tolerance=SHARP, observer=observe)


@pytest.mark.parametrize("theta", [np.zeros(3), [1e-5, -2e-5, 1e-5], [0.3, -0.2, 0.5], [2.0, 1.0, -1.5]])
def test_rotation_and_its_tangent(theta):
    theta, step = np.array(theta), 1e-6
    R = rotation(theta)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(R @ theta, theta, atol=1e-14)
    for k, axis in enumerate(np.eye(3)):
        spin = (rotation(theta + step * axis) - rotation(theta - step * axis)) / (2 * step) @ R.T
        np.testing.assert_allclose(spin, skew(tangent_of(theta)[:, k]), atol=1e-9)


def test_planes_of_symmetry_are_those_that_the_motions_leave():
    assert path_of([1.0, 0, 0, 0, 0, 0]).mirrors == {"y", "z"}
    assert path_of([1.0, 0, 1.0, 0, 0, 0]).mirrors == {"y"}
    assert path_of([0, 0, 0, 0, 0, 0.1]).mirrors == {"z"}
    assert path_of([1.0, 0, 0, 0, 0, 0], free=(1,)).mirrors == {"z"}
    assert path_of([1.0, 0, 0, 0, 0, 0], whole=True).mirrors == frozenset()


@pytest.mark.parametrize(
    ("mode", "k", "end"),
    [("axial", 2, 3.0), ("radial", 0, 1.5), ("torsional", 5, 10 * DEGREE), ("conical", 4, 2 * DEGREE)],
)
def test_one_motion_alone_is_its_mode(mode, k, end, rubber):
    pose = np.zeros(6)
    pose[k] = end
    history = march(model_of(path_of(pose), rubber()), Program(np.array([0.5, 1.0])), tolerance=SHARP)
    # In three dimensions and on the same mesh.
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    alone = prepare(shape, replace(modes()[mode], section=None), rubber(), COARSE)
    expected = march(alone, Program(end * np.array([0.5, 1.0])), tolerance=SHARP).force
    np.testing.assert_allclose(history.reactions[:, k], expected, rtol=1e-6)
    assert np.abs(np.delete(history.reactions, k, axis=1)).max() < 1e-6 * np.abs(expected).max()


def test_a_path_along_y_is_that_along_x(rubber):
    """A round bushing; the planes of symmetry that are left, x = 0 and y = 0, are not the same."""
    forces = []
    for across, tilt in ((0, 4), (1, 3)):
        pose = np.zeros(6)
        pose[across], pose[tilt] = 1.0, (1.0 if across == 0 else -1.0) * np.radians(2.0)
        history = march(model_of(path_of(pose), rubber()), Program(np.array([0.5, 1.0])), tolerance=SHARP)
        forces.append(history.reactions[-1])
    along_x, along_y = forces
    np.testing.assert_allclose(along_y[[1, 3]], along_x[[0, 4]] * [1.0, -1.0], rtol=1e-4)


def test_long_bonded_bushing_has_the_stiffness_of_the_closed_forms(rubber):
    """Axial shear 2 pi mu L / ln(b/a) and torsion 4 pi mu L / (a^-2 - b^-2), per length far from the ends.

    The difference to a bushing of twice the length has no ends. Eight second-order elements around are 0.1 % off.
    """
    a, b, mu = 10.0, 20.0, 1.0
    found = []
    for length in (60.0, 120.0):
        shape = shapes()["plain"](inner_radius=a, outer_radius=b, length=length)
        refinement = Refinement(across=3, along=int(length / 10), around=8)
        six = path_of([0, 0, 1.0, 0, 0, 0], whole=True)
        model = prepare(shape, modes()["path"].follow(six), rubber("neo_hookean", C10=mu / 2), refinement)
        at_rest = []

        def observe(solver, model=model, at_rest=at_rest):
            solver.factorise()
            at_rest.append(tangent(model, solver.factor, solver.q).symmetric)

        march(model, Program(np.array([0.0])), observer=observe)
        found.append(at_rest[0])
    grown = found[1] - found[0]
    assert grown[2, 2] == pytest.approx(2 * np.pi * mu * 60.0 / np.log(b / a), rel=2e-3)
    assert grown[5, 5] == pytest.approx(4 * np.pi * mu * 60.0 / (a**-2 - b**-2), rel=2e-3)
    # The twist is exact at every length.
    assert found[0][5, 5] == pytest.approx(4 * np.pi * mu * 60.0 / (a**-2 - b**-2), rel=2e-3)


def test_stiffness_matrix_is_that_of_another_code(rubber):
    found, history = matrices(
        path_of([1.0, 0, 0, 0, 0, 0], whole=True), rubber(), [0.0, 1.0], refinement=Refinement()
    )
    for state, name in zip(found, ("K0", "K1"), strict=True):
        theirs, ours = np.array(REFERENCE["plain"][name]), state.symmetric
        np.testing.assert_allclose(np.diag(ours), np.diag(theirs), rtol=0.01)
        scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
        coupled = (np.abs(theirs) > 1e-4 * scale) & ~np.eye(6, dtype=bool)
        np.testing.assert_allclose(ours[coupled], theirs[coupled], rtol=0.05)
        assert np.abs(ours[~coupled & ~np.eye(6, dtype=bool)]).max() < 1e-6 * scale.max()
    # A radial force turns with the direction of the load: K_yy is the secant stiffness.
    assert found[1].symmetric[1, 1] == pytest.approx(history.reactions[-1, 0] / 1.0, rel=1e-6)


def test_combined_path_is_that_of_another_code(rubber):
    rows = REFERENCE["plain"]["path"]
    six = path_of(rows[1]["q"], rows[-1]["q"])
    times = np.array([0.5, 1.0, 1.25, 1.5, 1.75, 2.0])
    model = model_of(six, rubber(), Refinement())
    history = march(model, Program(times, None, frozenset({1})))
    np.testing.assert_allclose(history.motion, [row["q"] for row in rows], atol=1e-12)
    theirs = np.array([row["f"] for row in rows])
    for k, tolerance in ((0, 0.01), (2, 0.01), (5, 0.01), (4, 0.05)):
        np.testing.assert_allclose(history.reactions[:, k], theirs[:, k], rtol=tolerance, atol=1e-3)


@pytest.mark.slow
def test_stiffness_matrix_is_the_derivative_of_the_reactions_and_symmetric(rubber):
    """At a state with moments, which are reported about fixed axes, so that their derivative is not symmetric."""
    (state,), history = matrices(path_of(MIXED, whole=True), rubber(), [1.0])
    step, columns = 1e-4, []
    for k in range(6):
        ends = []
        for sign in (1.0, -1.0):
            moved = MIXED.copy()
            moved[k] += sign * step
            model = model_of(path_of(MIXED, moved, whole=True), rubber())
            ends.append(march(model, Program(np.array([1.0, 2.0])), tolerance=SHARP).reactions[-1])
        columns.append((ends[0] - ends[1]) / (2 * step))
    differences = np.array(columns).T
    exact = state.stiffness @ twist_of(MIXED)
    assert np.all(np.abs(exact - differences) < 1e-5 * np.abs(differences).max(axis=0))
    K = state.symmetric
    np.testing.assert_allclose(K, K.T, atol=1e-9 * np.abs(K).max())
    # dM = K w + w x M / 2
    M = history.reactions[-1, 3:]
    np.testing.assert_allclose(state.stiffness[3:, 3:], K[3:, 3:] - 0.5 * skew(M), rtol=1e-9)
    assert np.abs(state.stiffness - state.stiffness.T).max() > 1e-3 * np.abs(M).max()


def test_round_bushings_that_are_symmetric_about_z_have_no_couplings(rubber):
    """Round bushings that are symmetric about z = 0 have no couplings at rest, and equal stiffnesses along x and y."""
    kinds = [
        shapes()["tapered"](inner_radius=12.0, outer_radius=22.0, inner_length=50.0, outer_length=30.0),
        shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0),
    ]
    for shape in kinds:
        (state,), _ = matrices(path_of([1.0, 0, 0, 0, 0, 0], whole=True), rubber(), [0.0], shape=shape)
        K = state.symmetric
        # In both shapes the two directions across the axis are alike.
        np.testing.assert_allclose(K[0, 0], K[1, 1], rtol=1e-6)
        np.testing.assert_allclose(K[3, 3], K[4, 4], rtol=1e-6)
        assert np.abs(K - np.diag(np.diag(K))).max() < 1e-6 * K.max()


@cache
def mixed_history(free):
    from cases.simulate import Rubber
    from forms.law import law

    rubber = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 200.0)
    model = model_of(path_of([1.0, 0, 0, 0, 0, 0], MIXED, free=free), rubber)
    return march(model, Program(np.array([0.5, 1.0, 1.5, 2.0]), None, frozenset({1})), tolerance=SHARP)


@pytest.mark.parametrize("free", [(4,), (1, 3, 4), (0, 1, 3)])
def test_free_motions_have_no_reaction_and_prescribing_them_changes_nothing(free):
    history = mixed_history(free)
    scale = np.abs(history.reactions).max(axis=0)
    scale = np.maximum(scale, [scale[:3].max()] * 3 + [scale[3:].max()] * 3)
    assert np.all(np.abs(history.reactions[:, free]) < 1e-8 * scale[list(free)])
    assert np.abs(history.motion[-1, list(free)]).max() > 1e-4
    # The same path with all motions prescribed: the same reactions.
    from cases.simulate import Rubber
    from forms.law import law

    rubber = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 200.0)
    model = model_of(path_of(*history.motion), rubber)
    again = march(model, Program(np.arange(1.0, 5.0), None, frozenset({0, 1, 2})), tolerance=SHARP)
    np.testing.assert_allclose(again.reactions, history.reactions, atol=1e-6 * scale.max())
    np.testing.assert_allclose(again.energy, history.energy, rtol=1e-9)


@pytest.mark.parametrize("free", [(0, 4), (2, 4, 5), (0, 1, 2, 3, 4, 5)])
def test_prescribed_forces_give_the_motions_that_have_them_as_reactions(free, rubber):
    held = path_of([1.0, 0, 0, 0, 0, 0], MIXED)
    program = Program(np.array([0.5, 1.0, 1.5, 2.0]), None, frozenset({1}))
    moved = march(model_of(held, rubber("yeoh", 200.0)), program, tolerance=SHARP)
    # Between the corners the forces are not those of the straight motions; at the corners they are.
    load = np.array([np.zeros(6), moved.reactions[1], moved.reactions[3]])
    six = SixPath(held.time, held.motion, free, load=load)
    assert six.loaded == free
    found = march(model_of(six, rubber("yeoh", 200.0)), program, tolerance=SHARP)
    for corner in (1, 3):
        scale = np.abs(moved.reactions[corner]).max()
        np.testing.assert_allclose(found.motion[corner], moved.motion[corner], atol=1e-8)
        np.testing.assert_allclose(found.reactions[corner], moved.reactions[corner], atol=1e-8 * scale)
    assert found.energy[3] == pytest.approx(moved.energy[3], rel=1e-8)


def test_work_of_the_reactions_is_the_stored_energy(rubber):
    """Gauss-Legendre integration of the power, with a free motion whose force does no work."""
    nodes, weights = np.polynomial.legendre.leggauss(7)
    model = model_of(path_of(MIXED, free=(1,)), rubber("yeoh", 200.0))
    history = march(model, Program(np.append(0.5 * (nodes + 1), 1.0)), tolerance=SHARP)
    work = 0.5 * weights @ history.force[:-1]
    assert work == pytest.approx(history.energy[-1], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["maxwell", "ogden_roxburgh", "payne"])
def test_sensitivities_with_memory_and_a_free_motion(name, rubber):
    """With the tangent of a clock, which is not symmetric, too."""
    if name == "payne":
        typical = {"g": 0.2, "tau": 20.0, "decades": 4.0, "slope": -0.1, "path": 300.0, "exponent": 1.3}
        feature = Installed("memory", effect("payne").feature(), typical)
    else:
        branch, typical = branches()[name], branches()[name].typical
        feature = Installed("memory", Feature(branches=lambda values: [Attached(branch, values)]), typical)
    chosen = rubber("yeoh", 200.0)
    names = ("C10", *(f"memory.{p}" for p in typical))
    back = 0.3 * MIXED
    model = model_of(path_of(MIXED, back, free=(1, 4)), chosen, features=[feature])
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    steps = Program(times, times, frozenset({2}))
    exact = march(model, steps, tolerance=1e-12, sensitivity=names)
    given = {"C10": chosen.parameters["C10"]} | {f"memory.{p}": v for p, v in typical.items()}
    for column, parameter in enumerate(names):
        step, ends = 1e-4 * given[parameter], []
        for sign in (1.0, -1.0):
            model.set_parameters({parameter: given[parameter] + sign * step})
            ends.append(march(model, steps, tolerance=1e-12).reactions[-1])
        model.set_parameters({parameter: given[parameter]})
        difference = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            exact.reaction_sensitivity[-1, :, column], difference, atol=1e-5 * np.abs(difference).max()
        )


@pytest.mark.parametrize("free", [(), (1, 4)])
def test_sensitivities_of_all_reactions(free, rubber):
    chosen = rubber("yeoh", 200.0)
    names = ("C10", "C20", "C30", "compliance")
    model = model_of(path_of([1.0, 0, 0, 0, 0, 0], MIXED, free=free), chosen)
    steps = Program(np.array([0.5, 1.0, 1.5, 2.0]), None, frozenset({1}))
    exact = march(model, steps, tolerance=1e-12, sensitivity=names)
    assert exact.reaction_sensitivity.shape == (4, 6, 4)
    given = dict(chosen.parameters) | {"compliance": 1 / 200.0}
    for column, name in enumerate(names):
        step = 1e-4 * abs(given[name])
        ends = []
        for sign in (1.0, -1.0):
            values = given | {name: given[name] + sign * step}
            model.set_parameters({n: values[n] for n in chosen.parameters}, 1 / values["compliance"])
            ends.append(march(model, steps, tolerance=1e-12))
        model.set_parameters(chosen.parameters, 200.0)
        difference = (ends[0].reactions - ends[1].reactions) / (2 * step)
        scale = np.abs(difference).max(axis=0) + 1e-3 * np.abs(difference).max()
        np.testing.assert_array_less(
            np.abs(exact.reaction_sensitivity[..., column] - difference).max(axis=0), 2e-5 * scale + 1e-6
        )
        power = (ends[0].force - ends[1].force) / (2 * step)
        np.testing.assert_allclose(exact.sensitivity[:, column], power, atol=2e-5 * np.abs(power).max())


def test_local_map_adds_up_to_the_derivative_by_a_factor_on_all_rubber(rubber):
    """The derivative of a reaction by a common factor on Yeoh's parameters is the sum over the cells."""
    chosen = rubber("yeoh", 200.0)
    model, sums = model_of(path_of(MIXED, free=(4,)), chosen), []
    local = LocalStiffness(model, reaction=2)
    history = march(
        model,
        Program(np.array([1.0])),
        tolerance=1e-12,
        sensitivity=tuple(chosen.parameters),
        observer=lambda solver: sums.append(local(solver).sum()),
    )
    expected = history.reaction_sensitivity[0, 2] @ np.array(list(chosen.parameters.values()))
    assert sums[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_kidney_from_cad_has_the_stiffness_matrix_of_another_code(rubber):
    shape = shapes()["cad"](file=str(DATA / "real" / "kidney_A.step"))
    found, _ = matrices(
        path_of([1.0, 0, 0, 0, 0, 0], whole=True), rubber(), [0.0, 1.0], shape=shape, refinement=Refinement()
    )
    for state, name in zip(found, ("K0", "K1"), strict=True):
        theirs, ours = np.array(REFERENCE["kidney_A"][name]), state.symmetric
        np.testing.assert_allclose(np.diag(ours), np.diag(theirs), rtol=0.01)


def test_a_sleeve_off_centre_in_any_direction_is_one_that_is_turned(rubber):
    """A ring has no direction of its own: offset and motion turned together give the turned force."""
    chosen, step = rubber("yeoh", 200.0), 1e-4
    fine = Refinement(across=2, along=4, around=16)

    def end(angle, offset=0.8, sensitivity=()):
        cos, sin = np.cos(angle), np.sin(angle)
        values = {"offset": offset * cos, "offset_across": offset * sin}
        place = Installed("misalignment", effect("misalignment").feature(), values)
        six = path_of([cos, sin, 0, 0, 0, 0])
        model = model_of(six, chosen, fine, features=[place])
        return march(model, Program(np.array([1.0])), tolerance=SHARP, sensitivity=sensitivity)

    towards = end(0.0).reactions[0]
    assert towards[0] > 1.03 * end(0.0, -0.8).reactions[0, 0]
    across = end(np.pi / 2, sensitivity=("misalignment.offset_across",))
    np.testing.assert_allclose(across.reactions[0, :2], [0.0, towards[0]], rtol=1e-8, atol=1e-6)
    # A mesh of 16 elements around is the same after an eighth of a turn.
    np.testing.assert_allclose(end(np.pi / 4).reactions[0, :2], towards[0] * np.sqrt([0.5, 0.5]), rtol=1e-8)
    ends = [end(np.pi / 2, 0.8 + d).reactions[0, 1] for d in (step, -step)]
    slope = across.reaction_sensitivity[0, 1, 0]
    assert slope == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-5)


def test_a_tilted_sleeve_is_one_that_the_mesh_has(rubber):
    """Offset along the axis and tilts, against a mesh whose points are where the stress-free body's are."""
    chosen, fine = rubber("yeoh", 200.0), Refinement(across=2, along=6, around=12)
    values = {"offset": 0.0, "offset_along": 0.9, "tilt": 0.06, "tilt_across": -0.03}
    six = path_of([0.0, 0.0, 2.0, 0.0, 0.05, 0.0])
    place = Installed("misalignment", effect("misalignment").feature(), values)
    found = march(model_of(six, chosen, fine, features=[place]), Program(np.array([1.0])), tolerance=SHARP)
    mesh = build(shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0), 3, frozenset(), fine)
    x = mesh.mesh.geometry.x
    share = (22.0 - np.hypot(x[:, 0], x[:, 1])) / 10.0
    # The rotation with these Cayley parameters, by its axis and angle.
    half = np.array([-0.03, 0.06, 0.0]) / 2
    turned = rotation(2 * np.arctan(np.linalg.norm(half)) * half / np.linalg.norm(half)) @ x.T - x.T
    x += share[:, None] * (turned + np.array([[0.0], [0.0], [0.9]])).T
    # The sleeve turns about its own centre, a mesh of that form about the origin.
    centre, pose = np.array([0.0, 0.0, 0.9]), six.motion[-1].copy()
    pose[:3] += centre - rotation(pose[3:]) @ centre
    moved = FiniteElementModel(
        mesh, modes()["path"].follow(path_of(pose)), chosen.law, chosen.parameters, 200.0
    )
    expected = march(moved, Program(np.array([1.0])), tolerance=SHARP).reactions[0]
    aligned = march(model_of(six, chosen, fine), Program(np.array([1.0])), tolerance=SHARP).reactions[0]
    # Curved element edges are parabolas in one mesh and moved parabolas in the other.
    scale = np.array([expected[2]] * 3 + [expected[4]] * 3)
    expected[3:] -= np.cross(rotation(pose[3:]) @ centre, expected[:3])
    np.testing.assert_allclose(found.reactions[0] / scale, expected / scale, atol=5e-4)
    assert np.abs((found.reactions[0] - aligned) / scale).max() > 0.05


def test_derivatives_by_tilts_are_differences(rubber):
    chosen, step = rubber("yeoh", 200.0), 1e-4
    names = ("offset_along", "tilt", "tilt_across")
    six = path_of([0.3, 0.0, 1.0, 0.02, 0.03, 0.0])

    def end(sensitivity=(), **change):
        values = {"offset": 0.2, "offset_along": 0.5, "tilt": 0.03, "tilt_across": 0.02}
        values |= {name: values[name] + by for name, by in change.items()}
        place = Installed("misalignment", effect("misalignment").feature(), values)
        model = model_of(six, chosen, features=[place])
        return march(model, Program(np.array([1.0])), tolerance=SHARP, sensitivity=sensitivity)

    exact = end(tuple(f"misalignment.{name}" for name in names)).reaction_sensitivity[0]
    for i, name in enumerate(names):
        ends = [end(**{name: d}).reactions[0] for d in (step, -step)]
        slope = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(exact[:, i], slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())


def test_a_tangent_that_cannot_be_factorised_ends_the_march_and_not_the_program(monkeypatch, rubber):
    """As at constants far from all rubber, which an identification may try: the tangent of the derivatives is zero."""
    model = model_of(path_of([1.0, 0, 0, 0, 0, 0]), rubber())
    factorise, assemble, derivatives = Equilibrium.factorise, type(model.system).tangent, []

    def factorised(solver, stiffened=False):
        derivatives.append(solver)
        factorise(solver, stiffened)

    def singular(system, matrix, *options):
        assemble(system, matrix, *options)
        if derivatives:
            matrix.scale(0.0)

    monkeypatch.setattr(Equilibrium, "factorise", factorised)
    monkeypatch.setattr(type(model.system), "tangent", singular)
    with pytest.raises(NotConverged) as failed:
        march(model, Program(np.array([0.5, 1.0])), sensitivity=("C10",))
    assert derivatives
    assert failed.value.reason == "DIVERGED_LINEAR_SOLVE"


def test_the_last_point_of_a_path_that_ends_early_has_its_motions_and_reactions():
    recorder = Recorder(Program(np.array([1.0, 2.0])), False, False, False)
    recorder.point(0.5, 1.0, 1.0, 3, np.zeros(1))
    recorder.six(np.full(6, 0.5), np.full(6, 5.0))
    recorder.last_reached(0.7, 1.0, 1.0, 3, np.zeros(1), np.full(6, 0.7), np.full(6, 7.0))
    history = recorder.history()
    np.testing.assert_array_equal(history.motion[:, 0], history.displacement)
    np.testing.assert_array_equal(history.reactions[:, 5], 10.0 * history.displacement)
