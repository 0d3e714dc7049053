"""Contact against closed forms, other codes, energy and finite differences.

The references of the slices (CalculiX and NGSolve) and how they were made: benchmarks/README.md.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from bushcli.simulate.bodies import PreparedModels
from bushcli.simulate.contact import surfaces_that_met
from cases.contact import bodies as surfaces
from cases.contact.contact import DEEPEST
from cases.contact.facets import Basis
from cases.contact.search import ContactSearch
from cases.equilibrium import Equilibrium
from cases.march import TOLERANCE, march
from cases.mode import modes
from cases.newton import bends
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import laws
from geometry.shape import Refinement, shapes
from tests.ball import RUBBER, Ball, hertz, johnson
from tests.slices import LAYER, Arches, KidneySlice, Pillow, Roller, slices

DATA = Path(__file__).parent / "data" / "real"
YEOH = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
RADIAL = modes()["radial"]
PLAIN = {"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0}
# A rubber spring between two plates with a slot in its outside, whose mouth closes before its round bottom creases.
SLOT = shapes()["section"](
    contact=True,
    outline=[
        {"from": [10.0, 0.0], "to": [20.0, 0.0], "name": "outer"},
        {"to": [20.0, 4.7]},
        {"to": [15.1619, 4.7]},
        {"to": [15.1619, 5.3], "arc_through": [12.8, 5.0]},
        {"to": [20.0, 5.3]},
        {"to": [20.0, 10.0]},
        {"to": [10.0, 10.0], "name": "inner"},
        {"to": [10.0, 0.0]},
    ],
)
AXIAL = modes()["axial"]


def closed(q, rubber=YEOH, shape=SLOT, **more):
    """Return model and history of the slot's spring."""
    model = prepare(shape, AXIAL, rubber)
    return model, march(model, Program(np.asarray(q)), **more)


@pytest.fixture(scope="module")
def touching():
    """Return model and history to a state in which the slot's walls are pressed against each other."""
    return closed([-0.3, -0.5, -0.6, -0.7], keep_states=True)


@pytest.mark.slow
def test_a_bump_stop_meets_other_codes():
    shape = KidneySlice(bump=True, size=2.2)
    model, history = slices(shape, modes()["radial"], YEOH, np.array([0.4, 0.8, 0.9, 1.0, 1.2, 1.4]))
    q, force = np.loadtxt(DATA / "slice_Abump_contact.csv", delimiter=",", skiprows=1)[:, :2].T
    known = [np.flatnonzero(q == one)[0] for one in (0.4, 0.8, 1.0, 1.2, 1.4)]
    off = 100 * np.abs(history.force[[0, 1, 3, 4, 5]] / force[known] - 1)
    assert np.all(off < 0.5), off
    assert 0.0 < model.surfaces.contact.penetration < DEEPEST


def test_no_force_before_touch(touching):
    """Before touch the force equals, to rounding, that without contact; after touch it is larger in magnitude."""
    _, history = touching
    free = closed([-0.3, -0.5, -0.6, -0.7], shape=SLOT.model_copy(update={"contact": False}))[1]
    np.testing.assert_allclose(history.force[:2], free.force[:2], rtol=1e-12)
    assert history.force[-1] < 1.001 * free.force[-1]


def test_penetration_is_below_a_hundredth_of_a_facet(touching):
    model, history = touching
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    assert 0.0 < contact.penetration < DEEPEST


@pytest.fixture(scope="module")
def squeezed():
    """Return model and history of a plain bushing pressed radially to 80 % of its thickness between long sleeves."""
    shape = shapes()["plain"](**PLAIN, contact="sleeves")
    model = prepare(shape, RADIAL, YEOH, Refinement(across=2, along=5, around=6))
    q = [*np.linspace(1.0, 6.0, 6), 6.999, 7.0, 7.001, 8.0]
    return model, march(model, Program(np.array(q)), keep_states=True)


def test_a_plain_bushing_between_long_sleeves_is_pressed_to_80_percent(squeezed):
    """Beyond 0.6 % the pressure on rigid sleeves grows so fast that 1 % is not reached (`cases.contact.energy`)."""
    model, history = squeezed
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    assert history.displacement[-1] == 8.0
    assert 0.006 < contact.penetration < DEEPEST
    slope = (history.energy[8] - history.energy[6]) / 0.002
    assert history.force[7] == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("case", ["touching", "squeezed"])
def test_forces_and_stiffness_are_the_energy_s_derivatives(case, request):
    model, history = request.getfixturevalue(case)
    contact, x = model.surfaces.contact, history.states[-1]
    step = 1e-8 * np.random.default_rng(1).standard_normal(len(x))

    def energy(at):
        contact.look(at)
        return contact.energy()

    def forces(at):
        contact.look(at)
        found = np.zeros_like(at)
        contact.add_forces(found)
        return found

    assert energy(x + step) - energy(x - step) == pytest.approx(2 * forces(x) @ step, rel=1e-4)
    action = np.zeros_like(x)
    contact.look(x)
    contact.add_action(step, action)
    change = 0.5 * (forces(x + step) - forces(x - step))
    np.testing.assert_allclose(change, action, atol=1e-4 * np.abs(action).max())


@pytest.mark.parametrize("case", ["touching", "squeezed"])
def test_a_part_of_the_stiffness_has_no_negative_eigenvalues(case, request):
    """It is the whole without those of each point's, which come from the change of the pressure's direction."""
    model, history = request.getfixturevalue(case)
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    whole, part = contact.pressed_points.stiffness(), contact.pressed_points.positive_stiffness()
    scale = np.abs(whole).max()
    assert np.linalg.eigvalsh(part).min() > -1e-12 * scale
    added = np.linalg.eigvalsh(part - whole)
    assert added.min() > -1e-12 * scale
    assert added.max() > 1e-6 * scale


def test_negative_curvatures_of_the_contact_are_found_in_a_factorisation(touching):
    """Behind a surface by a quarter of the slot; at an equilibrium there are none, and the tangent is whole."""
    model, history = touching
    solver = Equilibrium(model, TOLERANCE)
    try:
        model.surfaces.apart = False
        for state, wanted in ((history.states[-1], False), (1.4 * history.states[-1], True)):
            model.state.x.array[:] = state
            model.system.tangent(solver.matrix)
            assert bends(model, solver.ksp, solver.matrix) is wanted
            model.system.tangent(solver.matrix, positive=True)
            assert not bends(model, solver.ksp, solver.matrix)
    finally:
        solver.destroy()


def test_action_is_reaction(touching):
    model, history = touching
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    forces = contact.pressed_points.forces()
    assert np.abs(forces).sum() > 0.0
    np.testing.assert_allclose(forces.sum(axis=(0, 1)), 0.0, atol=1e-12 * np.abs(forces).sum())


def test_force_is_the_energy_s_derivative_along_the_path():
    h = 1e-3
    _, history = closed([-0.5, -0.6, -0.7 + h, -0.7, -0.7 - h])
    slope = (history.energy[4] - history.energy[2]) / (-2 * h)
    assert history.force[3] == pytest.approx(slope, rel=1e-4)


def test_sensitivities_are_those_of_differences(touching):
    q = [-0.5, -0.6, -0.7]
    _, history = closed(q, sensitivity=("C10", "C20"), tolerance=1e-11)
    for i, name in enumerate(("C10", "C20")):
        step = 1e-4

        def force(by, name=name):
            values = YEOH.parameters | {name: YEOH.parameters[name] + by}
            return closed(q, Rubber(YEOH.law, values, YEOH.bulk_modulus), tolerance=1e-11)[1].force[-1]

        assert history.sensitivity[-1, i] == pytest.approx(
            (force(step) - force(-step)) / (2 * step), rel=1e-3
        )


@pytest.fixture(scope="module")
def arched():
    """Return model and march of one of two arches that are pressed against each other, and that of both arches."""
    q = np.array([0.4, 0.8, 1.199, 1.2, 1.201])
    return *slices(Arches(), RADIAL, YEOH, q, keep_states=True), slices(Arches(both=True), RADIAL, YEOH, q)[1]


def test_a_part_that_meets_its_mirror_image_is_the_whole_part(arched):
    """The plane of symmetry is a wall: nothing is beyond it, and the force is that of both arches."""
    model, history, both = arched
    np.testing.assert_allclose(history.force, both.force, rtol=2e-3)
    free = slices(Arches(contact=False), RADIAL, YEOH, history.displacement)[1]
    assert history.force[0] == pytest.approx(free.force[0], rel=1e-12)
    assert history.force[-1] > 1.1 * free.force[-1]
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    assert 0.0 < contact.penetration < DEEPEST
    assert contact._x[:, 1].min() > -0.02
    (met,) = surfaces_that_met(model, history)
    assert met.surfaces == ("void", "void")


def test_the_force_of_a_part_that_meets_its_mirror_image_is_the_energy_s_derivative(arched):
    _, history, _ = arched
    slope = (history.energy[4] - history.energy[2]) / 0.002
    # The energy is that of both sides of the plane, the force of a slice that per length.
    assert slope / (2 * LAYER) == pytest.approx(history.force[3], rel=1e-4)


def test_a_uniform_pressure_passes_through_an_interface():
    """Two blocks, one beside the other, whose meshes do not match: a patch test; the stress is that of one block."""
    soft = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 20.0)
    forces, spread = [], []
    for split in (False, True):
        model, history = slices(
            Pillow(split=split), modes()["radial"], soft, np.array([0.05, 0.2]), keep_states=True
        )
        forces.append(history.force)
        part = model.body.rubber
        part.look(history.states[-1])
        stress = part.answer()[:, 0]
        spread.append(np.ptp(stress) / np.abs(stress).mean())
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-2)
    assert spread[0] < 1e-6
    assert spread[1] < 0.02


@pytest.mark.parametrize(("mode", "q"), [("axial", [4.0, 8.0]), ("radial", [2.0, 4.0])])
def test_surfaces_that_stay_apart_are_not_searched(mode, q, monkeypatch):
    """Contact is on by default; for a plain bushing no pair of points is searched, and the tangent gets no entries."""
    shape = shapes()["plain"](**PLAIN)
    assert shape.contact is True
    free = prepare(shape.model_copy(update={"contact": False}), modes()[mode], YEOH)
    known = march(free, Program(np.array(q))).force

    def never(*_, **__):
        raise AssertionError("searched")

    for name in ("points_inside", "near"):
        monkeypatch.setattr(ContactSearch, name, never)
    model = prepare(shape, modes()[mode], YEOH)
    np.testing.assert_allclose(march(model, Program(np.array(q))).force, known, rtol=1e-12)
    assert model.surfaces.contact is not None
    assert model.surfaces.apart


def test_surfaces_that_come_near_are_looked_at_once_for_each_equilibrium(monkeypatch):
    """Until the surfaces meet, the states that Newton's method tries between equilibria are not searched."""
    calls = []
    usual = ContactSearch.points_inside
    monkeypatch.setattr(
        ContactSearch, "points_inside", lambda self, *more: calls.append(1) or usual(self, *more)
    )
    _, history = closed([-0.1, -0.2, -0.3])
    assert len(calls) <= 2 * len(history.attempts)


@pytest.mark.parametrize("case", ["touching", "squeezed"])
def test_points_inside_are_at_the_nearest_point_of_the_facet(case, request):
    """Against all places of a fine grid on each facet: none is nearer, and the vector leads there."""
    model, history = request.getfixturevalue(case)
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    bodies, found = contact.bodies, contact.pressed_points.found
    x = contact._x
    steps = np.linspace(0.0, 1.0, 41)
    grid = np.stack(np.meshgrid(*[steps] * found.xi.shape[1]), axis=-1).reshape(-1, found.xi.shape[1])
    if bodies.basis.kind == "triangle":
        grid = grid[grid.sum(axis=1) <= 1.0]
    values, own = bodies.basis.values(grid), bodies.basis.values(bodies.points[0])
    assert len(found) > 10
    for i in range(0, len(found), max(1, len(found) // 60)):
        nodes = x[bodies.facets[found.other[i]]]
        point = own[found.point[i]] @ x[bodies.facets[found.facet[i]]]
        at = (bodies.basis.values(found.xi[i : i + 1]) @ nodes)[0]
        assert np.allclose(point - at, found.r[i], rtol=0.0, atol=1e-12)
        # The error is of the order of the square of the last step of Newton's method (`nearest.h`).
        assert np.linalg.norm(point - values @ nodes, axis=1).min() > found.depth[i] * (1.0 - 1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_facets_are_compared_with_all_that_are_near(dimension):
    """Facets are sorted along an axis, and only near ones are compared: as if each were compared with all.

    A rigid facet that is as large as all the others are apart makes the program compare all pairs.
    """
    rng = np.random.default_rng(5)
    kind = {2: "interval", 3: "triangle"}[dimension]
    basis, soft = Basis.of(kind, 2), 300
    middle = rng.uniform(0.0, [12.0, 9.0, 6.0][:dimension], (soft, 1, dimension))
    corners = rng.normal(0.0, 1.0, (soft, dimension, dimension)) + middle
    flat = np.concatenate([1.0 - basis.nodes.sum(axis=1, keepdims=True), basis.nodes], axis=1)
    X = (flat @ corners).reshape(-1, dimension)
    large = 1e3 * flat @ np.eye(dimension) + 1e5
    x = X + rng.normal(0.0, 0.05, X.shape)
    found = []
    for more in (np.empty((0, dimension)), large):
        nodes = np.arange(len(X) + len(more)).reshape(-1, len(basis.nodes))
        sign, names = np.ones(len(nodes)), np.repeat("free", len(nodes))
        places = np.concatenate([X, more])
        search = ContactSearch(surfaces.Bodies(basis, nodes, sign, places, soft, nodes, None, False, names))
        assert search.facets_meet(np.concatenate([x, more]), 0.5)
        found.append(search.points_inside(np.concatenate([x, more])))
    alone, all_pairs = found
    assert len(alone) > 30
    for name in ("facet", "point", "other", "xi", "free", "r"):
        assert np.array_equal(getattr(alone, name), getattr(all_pairs, name)), name


def test_a_model_moved_to_another_shape_has_its_surfaces_there():
    prepared, rubber = PreparedModels(), YEOH
    made = [
        prepared(shapes()["plain"](**PLAIN | {"length": length}), AXIAL, rubber, Refinement(), MPI.COMM_SELF)
        for length in (40.0, 40.5)
    ]
    assert made[0] is made[1]
    assert prepared.moved == 1
    fresh = prepare(shapes()["plain"](**PLAIN | {"length": 40.5}), AXIAL, rubber).surfaces.contact.bodies
    moved = made[1].surfaces.contact.bodies
    np.testing.assert_allclose(moved.X, fresh.X, atol=1e-9)
    np.testing.assert_allclose(moved.size, fresh.size, rtol=1e-9)


def test_a_cylinder_between_hard_plates_is_johnson_s():
    """Hertz's contact, with the approach of a plate to the axis of a cylinder that is pressed from both sides."""
    middle = replace(RADIAL, held={"outer": (0,)}, reversed_by=None)
    _, history = slices(Roller(size=2.5, near=0.15), middle, RUBBER, np.array([-0.01, -0.03]))
    for q, force in zip(history.displacement, history.force, strict=True):
        assert -force == pytest.approx(johnson(-q), rel=5e-3)


def test_a_ball_between_hard_plates_is_hertz_s():
    """In the half-plane, up to a contact of 1.4 % of the radius, because the theory assumes an unbounded body."""
    equator = replace(AXIAL, held={"outer": (1,)}, reversed_by=None)
    history = march(prepare(Ball(), equator, RUBBER), Program(np.array([-0.001, -0.002])))
    for q, force in zip(history.displacement, history.force, strict=True):
        assert -force == pytest.approx(hertz(-q), rel=5e-3)


@pytest.mark.slow
def test_a_plain_bushing_is_pressed_to_64_percent_of_its_thickness():
    """Radially by 6.4 mm of 10, with the Yeoh set of the references; the free ends fold on the way."""
    model = prepare(shapes()["plain"](**PLAIN), RADIAL, YEOH)
    history = march(model, Program(np.linspace(0.4, 6.4, 16)))
    assert history.displacement[-1] == pytest.approx(6.4)
    assert np.all(np.diff(history.force) > 0.0)
    assert model.surfaces.contact.penetration < DEEPEST


def test_what_met_is_told_with_its_force(touching):
    """The pair of walls is reported with first touch, place and a positive force."""
    model, history = touching
    (found,) = surfaces_that_met(model, history)
    assert found.surfaces == ("free", "free")
    assert found.first == pytest.approx(-0.6)
    assert found.at == pytest.approx(-0.7)
    assert 15.16 < found.radius < 20.1
    # The section's origin is at the bond of its lower end; its centre is at z = 10.
    assert found.height == pytest.approx(-5.35, abs=0.5)
    assert found.force > 0.0


def test_sleeves_beyond_the_bond_hold_what_bulges_over_them():
    """Pulled along the axis by 8 mm of 40, an end bulges over the edge of its bond."""
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0, contact="sleeves")
    model = prepare(shape, AXIAL, YEOH)
    march(model, Program(np.linspace(2.0, 8.0, 4)))
    contact = model.surfaces.contact
    contact.look(model.state.x.array)
    assert contact.is_touching
    assert contact.penetration < DEEPEST


@pytest.mark.slow
def test_a_narrow_slot_is_pressed_to_one_and_a_half_times_its_closing_travel():
    """It stopped at 74 % of this, where Newton's method failed, until contact was soft at first and then stiffer."""
    low, high, depth, mean = 5.08683, 6.13318, 15.56130, 14.81384
    outline = [
        {"from": [10.0, 0.0], "to": [20.0, 0.0], "name": "outer"},
        {"to": [20.0, low]},
        {"to": [depth, low]},
        {"to": [depth, high], "arc_through": [mean, 0.5 * (low + high)]},
        {"to": [20.0, high]},
        {"to": [20.0, 10.0]},
        {"to": [10.0, 10.0], "name": "inner"},
        {"to": [10.0, 0.0]},
    ]
    rubber = Rubber(laws()["yeoh"], {"C10": 0.32697, "C20": -0.05, "C30": 0.01075}, 2000.0)
    end = -1.5 * (high - low)
    model, history = closed(np.linspace(end / 10, end, 10), rubber, shapes()["section"](outline=outline))
    assert history.displacement[-1] == end
    contact = model.surfaces.contact
    assert contact.is_touching
    assert contact.share == 1.0
    assert contact.penetration < DEEPEST
