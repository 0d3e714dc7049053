"""A model that was moved to another shape is the model that is built for it; shape derivatives are those of marches."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from bushcli.effects.library.mullins import feature as mullins
from bushcli.effects.library.swaging import feature as swaging
from bushcli.effects.library.viscoelasticity import feature as viscoelasticity
from bushcli.simulate.bodies import PreparedModels
from bushcli.study.rates import NUDGE, rates
from bushcli.study.target import target
from bushcli.study.task import DesignCache, StudyTask
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import path
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)
YEOH = {"C10": 0.5, "C20": -0.05, "C30": 0.01}
FIRST = {"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0}
OTHER = {"inner_radius": 11.7, "outer_radius": 22.4, "length": 38.5}
VOID = {"void_inner_radius": 14.5, "void_outer_radius": 19.5, "void_angle": 50.0}


def rubber(c10=0.5):
    return Rubber(law("yeoh"), YEOH | {"C10": c10}, 2000.0)


@pytest.mark.parametrize(
    ("shape", "mode", "q", "first", "other"),
    [
        ("plain", "axial", 4.0, FIRST, OTHER),
        ("plain", "radial", 1.0, FIRST, OTHER),
        ("plain", "torsional", 0.2, FIRST, OTHER),
        ("plain", "conical", 0.05, FIRST, OTHER),
        (
            "plain",
            "axial",
            2.0,
            FIRST | {"inner_sleeve": {"thickness": 3.0}},
            OTHER | {"inner_sleeve": {"thickness": 2.5}},
        ),
        ("voided", "radial", 1.0, FIRST | VOID, OTHER | VOID | {"void_angle": 55.0}),
        (
            "tapered",
            "axial",
            2.0,
            {"inner_radius": 12.0, "outer_radius": 22.0, "inner_length": 44.0, "outer_length": 36.0},
            {"inner_radius": 12.5, "outer_radius": 21.0, "inner_length": 45.0, "outer_length": 35.0},
        ),
    ],
)
def test_a_moved_model_is_the_one_that_is_built(shape, mode, q, first, other):
    bodies = PreparedModels()
    one, two = (shapes()[shape](**dimensions) for dimensions in (first, other))
    bodies(one, modes()[mode], rubber(), COARSE, MPI.COMM_SELF)
    moved = bodies(two, modes()[mode], rubber(0.7), COARSE, MPI.COMM_SELF)
    assert (bodies.made, bodies.moved) == (1, 1)
    built = prepare(two, modes()[mode], rubber(0.7), COARSE, MPI.COMM_SELF)
    force = [march(model, path((0.0, q), 2)).force for model in (moved, built)]
    # Sleeves are so stiff that the difference by rounding is larger.
    assert force[0] == pytest.approx(force[1], rel=1e-9)
    assert moved.volume == pytest.approx(built.volume, rel=1e-12)


def test_a_moved_model_remembers_what_its_rubber_does_there_alone():
    """With effects in the rubber: the moved model has the new values, and no memory of the march in the first shape."""
    bodies = PreparedModels()
    histories = []
    for dimensions, g in ((FIRST, 0.4), (OTHER, 0.2)):
        features = [Installed("viscoelasticity", viscoelasticity(), {"g1": g, "tau1": 2.0})]
        features.append(Installed("mullins", mullins(), {"inverse_r": 0.4, "m": 0.1, "beta": 0.1}))
        shape = shapes()["plain"](**dimensions)
        moved = bodies(shape, modes()["axial"], rubber(), COARSE, MPI.COMM_SELF, features)
        histories.append(march(moved, path((0.0, 4.0, 0.0), 3, 1.0)).force)
    assert (bodies.made, bodies.moved) == (1, 1)
    built = prepare(shape, modes()["axial"], rubber(), COARSE, MPI.COMM_SELF, features)
    force = march(built, path((0.0, 4.0, 0.0), 3, 1.0)).force
    assert histories[1] == pytest.approx(force, rel=1e-9)
    assert histories[0][-1] < 0.0 > force[-1]  # the branches have relaxed: the return to rest takes a push


def test_effects_of_the_assembly_make_another_model():
    bodies = PreparedModels()
    features = [Installed("swaging", swaging(), {"reduction": 0.2})]
    for dimensions in (FIRST, OTHER):
        shape = shapes()["plain"](**dimensions)
        bodies(shape, modes()["axial"], rubber(), COARSE, MPI.COMM_SELF, features)
    assert (bodies.made, bodies.moved) == (2, 0)


def test_other_elements_are_another_model():
    bodies = PreparedModels()
    for length in (40.0, 80.0, 40.5):
        shape = shapes()["plain"](**FIRST | {"length": length})
        bodies(shape, modes()["axial"], rubber(), Refinement(), MPI.COMM_SELF)
    assert (bodies.made, bodies.moved) == (2, 1)


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(
        """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 4
elements_around = 8
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
"""
    )
    return Path(file)


RATES = (
    *("axial=1", "radial=1", "axial.secant@5=1", "radial.force@2=1"),
    *("axial.secant@1500N=1", "radial.travel@2000N=1"),
)


def test_derivatives_of_rates_are_differences_of_marches(case):
    keys = ("geometry.outer_radius", "geometry.length", "geometry.inner_radius", "material.parameters.C10")
    values = [22.0, 40.0, 12.0, 0.5]
    targets = [target(text) for text in RATES]
    cache, task = DesignCache(), StudyTask(case, (), keys, ())
    found = rates(cache, task, targets, values, keys)
    for j, value in enumerate(values):
        sides = [[*values[:j], value * (1.0 + side * NUDGE), *values[j + 1 :]] for side in (-1.0, 1.0)]
        low, high = (rates(cache, task, targets, side).value for side in sides)
        # Central differences of step 1e-3 are off by some 1e-5 themselves.
        assert found.slope[:, j] == pytest.approx((high - low) / (2.0 * NUDGE * value), rel=5e-5)


def test_scaling_all_lengths_scales_stiffnesses_of_translation(case):
    # Of a nearly incompressible body of one material k ~ mu L: Euler's theorem for the sum over all lengths.
    keys = ("geometry.outer_radius", "geometry.length", "geometry.inner_radius")
    values = [22.0, 40.0, 12.0]
    targets = [target("axial=1"), target("radial=1")]
    found = rates(DesignCache(), StudyTask(case, (), keys, ()), targets, values, keys)
    assert found.slope @ np.array(values) == pytest.approx(found.value, rel=1e-6)
