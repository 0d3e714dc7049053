"""Contact against closed forms, other codes, energy and finite differences.

The references of the slices (CalculiX and NGSolve) and how they were made: benchmarks/README.md.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cases.contact.contact import DEEPEST
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import laws
from geometry.shape import Refinement, shapes
from tests.slices import KidneySlice, Pillow, slices

DATA = Path(__file__).parent / "data" / "real"
YEOH = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
RADIAL = modes()["radial"]
BUMP = KidneySlice(bump=True, size=2.2)


@pytest.fixture(scope="module")
def bumped():
    """Return model, history and states of the bump stop's way to 1.0 mm."""
    return slices(BUMP, RADIAL, YEOH, np.array([0.4, 0.8, 0.9, 1.0]), keep_states=True)


def test_a_bump_stop_meets_other_codes(bumped):
    model, history = bumped
    q, force, error = np.loadtxt(DATA / "slice_Abump_contact.csv", delimiter=",", skiprows=1)[:, :3].T
    known = [np.flatnonzero(q == one)[0] for one in (0.4, 0.8, 1.0)]
    off = 100 * np.abs(history.force[[0, 1, 3]] / force[known] - 1)
    assert np.all(off < 0.5 + error[known]), off
    assert model.surfaces.contact.touching
    assert 0.0 < model.surfaces.contact.penetration < DEEPEST


def test_no_force_before_touch(bumped):
    """To rounding the force of a bushing whose surfaces would pass through each other."""
    _, history = bumped
    free = slices(BUMP.model_copy(update={"contact": False}), RADIAL, YEOH, np.array([0.4, 0.78]))[1]
    with_contact = slices(BUMP, RADIAL, YEOH, np.array([0.4, 0.78]))[1]
    np.testing.assert_array_equal(with_contact.force, free.force)
    assert history.force[0] == pytest.approx(free.force[0], rel=1e-8)


def test_forces_and_stiffness_are_the_energy_s_derivatives(bumped):
    model, history = bumped
    contact, x = model.surfaces.contact, history.states[-1]
    step = 1e-7 * np.random.default_rng(1).standard_normal(len(x))

    def energy(at):
        contact.look(at)
        return contact.energy()

    def forces(at):
        contact.look(at)
        found = np.zeros_like(at)
        contact.add_forces(found)
        return found

    assert len(contact.pressed.found) > 20
    assert energy(x + step) - energy(x - step) == pytest.approx(2 * forces(x) @ step, rel=1e-5)
    action = np.zeros_like(x)
    contact.look(x)
    contact.add_action(step, action)
    np.testing.assert_allclose(
        0.5 * (forces(x + step) - forces(x - step)), action, atol=2e-3 * np.abs(action).max()
    )


def test_forces_balance(bumped):
    """Action and reaction: contact has no resultant."""
    model, history = bumped
    contact = model.surfaces.contact
    contact.look(history.states[-1])
    forces = contact.pressed.forces()
    assert np.abs(forces).sum() > 1.0
    np.testing.assert_allclose(forces.sum(axis=(0, 1)), 0.0, atol=1e-12 * np.abs(forces).sum())


def test_force_is_the_energy_s_derivative_along_the_path():
    model = prepare(BUMP, RADIAL, YEOH)
    h = 1e-3
    history = march(model, Program(np.array([0.5, 0.9, 0.95 - h, 0.95, 0.95 + h])))
    slope = (history.energy[4] - history.energy[2]) / (2 * h)
    assert history.force[3] == pytest.approx(slope, rel=1e-5)


def test_sensitivities_are_those_of_differences():
    names = ("C10", "C20", "compliance")
    q = np.array([0.5, 0.9, 1.0])

    def force(**changed):
        rubber = Rubber(laws()["yeoh"], YEOH.parameters | changed, YEOH.bulk_modulus)
        return march(prepare(BUMP, RADIAL, rubber), Program(q), tolerance=1e-11).force[-1]

    found = march(prepare(BUMP, RADIAL, YEOH), Program(q), sensitivity=names, tolerance=1e-11).sensitivity[-1]
    for i, name in enumerate(names[:2]):
        value, step = YEOH.parameters[name], 1e-4
        change = (force(**{name: value + step}) - force(**{name: value - step})) / (2 * step)
        assert found[i] == pytest.approx(change, rel=1e-4)


def test_a_uniform_pressure_passes_through_an_interface():
    """Two blocks, one beside the other, with meshes that do not match: a patch test. The stress is that of one block."""
    soft = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 20.0)
    forces, spread = [], []
    for split in (False, True):
        model, history = slices(Pillow(split=split), RADIAL, soft, np.array([0.05, 0.2]), keep_states=True)
        forces.append(history.force)
        part = model.body.rubber
        part.look(history.states[-1])
        stress = part.answer()[:, 0]
        spread.append(np.ptp(stress) / np.abs(stress).mean())
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-2)
    assert spread[0] < 1e-6
    assert spread[1] < 0.02


@pytest.mark.parametrize("mode", ["axial", "torsional"])
def test_surfaces_that_cannot_meet_cost_and_change_nothing(mode):
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    q = np.array([0.1, 0.2])
    coarse = Refinement(across=3, along=8)
    free, touching = (
        march(prepare(one, modes()[mode], YEOH, coarse), Program(q))
        for one in (shape.model_copy(update={"contact": False}), shape)
    )
    np.testing.assert_array_equal(touching.force, free.force)


def test_sleeves_beyond_the_bond_hold_what_bulges_over_them():
    """Radially at half of the thickness no node of the free end is inside of the sleeves."""
    shape = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0, contact="sleeves")
    model = prepare(shape, RADIAL, YEOH, Refinement(across=3, along=8, around=8))
    contact = model.surfaces.contact
    history = march(model, Program(np.linspace(0.5, 4.0, 8)), keep_states=True)
    contact.look(history.states[-1])
    assert contact.touching
    assert contact.penetration < DEEPEST
