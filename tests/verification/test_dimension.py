"""Other dimensions by moving the stress-free rubber, against bushings that are meshed with these dimensions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from cases.snubber import STIFF
from forms.law import law
from geometry.shape import Refinement, Sleeve, Snubber, shapes

SHARP = 1e-11
COARSE = Refinement(across=2, along=4, around=8)
YEOH = Rubber(law("yeoh"), {"C10": 0.48, "C20": -0.035, "C30": 0.006}, 2000.0)
DRAWN = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 20.0}
CHANGE = {"thickness": 0.7, "length": 1.5}
TRUE = DRAWN | {"outer_radius": 18.7, "length": 21.5}
# Displacements (mm, rad) that a bushing of this size sees.
TRAVEL = {"axial": 4.0, "torsional": 0.3, "radial": 2.0, "conical": 0.15}


def changed(**others):
    values = {"dimension": CHANGE} | others
    return features_of([ActiveEffect(effect(name), given) for name, given in values.items()])


def solved(shape, mode, features=(), q=None, refinement=COARSE, **options):
    kind = modes()[mode] if isinstance(mode, str) else mode
    q = np.array([0.5, 1.0]) * TRAVEL[kind.name] if q is None else np.asarray(q)
    model = prepare(shape, kind, YEOH, refinement, features=features)
    return march(model, Program(q), tolerance=SHARP, **options)


def force(*args, **options):
    return solved(*args, **options).force


@pytest.mark.parametrize("mode", ["axial", "torsional"])
def test_a_section_of_other_dimensions_is_a_mesh_of_them(mode):
    plain = shapes()["plain"]
    found, expected = force(plain(**DRAWN), mode, changed()), force(plain(**TRUE), mode)
    assert abs(force(plain(**DRAWN), mode)[-1] / expected[-1] - 1) > 0.02
    # The same nodes: all that differs is rounding.
    np.testing.assert_allclose(found, expected, rtol=1e-8)


@pytest.mark.parametrize("mode", ["radial", "conical"])
def test_a_body_of_other_dimensions_is_a_mesh_of_them(mode):
    plain = shapes()["plain"]
    found, expected = force(plain(**DRAWN), mode, changed()), force(plain(**TRUE), mode)
    assert abs(force(plain(**DRAWN), mode)[-1] / expected[-1] - 1) > 2e-3
    # With eight elements around, element edges are parabolas in one mesh and moved parabolas in the other.
    np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("mode", ["axial", "radial"])
def test_closed_forms_scale_the_same_way(mode):
    """The stiffness of a long bushing at small strain changes with radii and length as in the formulas."""
    # The free ends, which the formulas neglect, act like a constant length: the longer the bushing, the better they
    # agree.
    whole = 180.0 if mode == "axial" else 90.0
    a, b, length = 9.0, np.array([18.0, 18.5]), whole + np.array([0.0, 1.0])
    if mode == "axial":
        stiffness = length / np.log(b / a)
    else:
        stiffness = length * (a**2 + b**2) / ((a**2 + b**2) * np.log(b / a) - (b**2 - a**2))
    refinement = Refinement(across=3, along=24, around=8)
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=whole)
    larger = changed(dimension={"thickness": 0.5, "length": 1.0})
    before, after = (
        force(shape, mode, features, q=[0.01], refinement=refinement)[0] for features in ((), larger)
    )
    expected = stiffness[1] / stiffness[0] - 1
    assert after / before - 1 == pytest.approx(expected, rel=0.03 if mode == "axial" else 0.1)


def test_a_tapered_bushing_with_sleeves_grows_with_them():
    sleeves = {
        "inner_sleeve": Sleeve(thickness=2.0, youngs_modulus=2000.0, grip="ends"),
        "outer_sleeve": Sleeve(thickness=2.0, youngs_modulus=2000.0, grip="ends"),
    }
    lengths = {"inner_length": 24.0, "outer_length": 20.0}
    radii = {"inner_radius": 9.0, "outer_radius": 18.0}
    tapered = shapes()["tapered"]
    drawn = tapered(**radii, **lengths, **sleeves)
    longer = {name: value * (1 + 1.5 / 24.0) for name, value in lengths.items()}
    true = tapered(**(radii | {"outer_radius": 18.7}), **longer, **sleeves)
    np.testing.assert_allclose(force(drawn, "axial", changed()), force(true, "axial"), rtol=1e-6)


@pytest.mark.parametrize("mode", ["axial", "conical"])
def test_plates_stay_where_they_are(mode, monkeypatch):
    """The gap to a plate is that of the drawn rubber, less the rubber's added length."""
    gap, fixed_to = 1.0, "inner"
    drawn = shapes()["plain"](**DRAWN, snubber=Snubber(gap=gap, fixed_to=fixed_to))
    true = shapes()["plain"](**TRUE, snubber=Snubber(gap=gap - 0.75, fixed_to=fixed_to))
    free = shapes()["plain"](**TRUE)
    q = [0.5 * TRAVEL[mode]]
    expected = force(true, mode, q=q)
    assert expected[-1] > 1.01 * force(free, mode, q=q)[-1]
    # Plates are springs whose stiffness depends on the thickness of the meshed rubber.
    monkeypatch.setattr("cases.snubber.STIFF", STIFF * 9.0 / 9.7)
    found = force(drawn, mode, changed(), q=q)
    np.testing.assert_allclose(found, expected, rtol=1e-6 if mode == "axial" else 1e-3)


def test_a_bond_comes_off_a_longer_bushing_as_it_does_from_a_mesh_of_it():
    loose = {"length": 3.0, "bond": 2.0}
    plain = shapes()["plain"]
    true = features_of([ActiveEffect(effect("debonding"), loose)])
    whole = force(plain(**TRUE), "axial")
    found = force(plain(**DRAWN), "axial", changed(debonding=loose))
    expected = force(plain(**TRUE), "axial", true)
    assert expected[-1] < 0.99 * whole[-1]
    # The width of the bond's edge depends on the drawn thickness.
    np.testing.assert_allclose(found, expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("mode", "solid", "more"),
    [
        ("axial", False, {}),
        ("torsional", False, {}),
        ("torsional", True, {}),
        ("radial", True, {}),
        ("conical", True, {}),
        ("axial", False, {"friction": {"g": 0.3, "slip": 0.1}}),
        pytest.param("conical", True, {"viscoelasticity": {"g1": 0.3, "tau1": 3.0}}),
        pytest.param("conical", True, {"debonding": {"length": 2.0, "bond": 2.0}}),
    ],
)
def test_slopes_by_dimensions_are_exact(mode, solid, more):
    kind = replace(modes()[mode], section=None) if solid else modes()[mode]
    features = changed(**more)
    model = prepare(shapes()["plain"](**DRAWN), kind, YEOH, COARSE, features=features)
    q = np.array([0.5, 1.0, 0.3]) * 0.7 * TRAVEL[mode]
    program = Program(q, np.array([1.0, 2.0, 4.0]))
    names = ["dimension.thickness", "dimension.length"]
    given = {f"dimension.{key}": value for key, value in CHANGE.items()}
    exact = march(model, program, tolerance=SHARP, sensitivity=names).sensitivity
    for column, name in enumerate(names):
        step = 1e-3

        def at(value, name=name):
            model.set_parameters(given | {name: value})
            return march(model, program, tolerance=SHARP).force

        found = (at(given[name] + step) - at(given[name] - step)) / (2 * step)
        model.set_parameters(given)
        # The difference errs with the second order of the step.
        scale = np.abs(exact[:, column]).max()
        np.testing.assert_allclose(found, exact[:, column], atol=2e-5 * scale, rtol=0, err_msg=name)
