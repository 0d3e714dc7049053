"""Derivatives by local stiffness: their exact sum, marches with a spot, and where in the body they lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ufl

from cases.feature import Installed
from cases.local import marched, swept
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)
MODES = ("axial", "torsional", "radial", "conical")
SHARP = 1e-11


def reach(mode):
    return 0.1 if modes()[mode].rotational else 2.0


@pytest.mark.parametrize("mode", MODES)
def test_incompressible_rubber_carries_the_whole_force_in_its_cells(mode, reference_bushing, rubber):
    """Incompressible rubber with s times the law has s times the force: the sum over the cells is the force itself."""
    model = prepare(reference_bushing, modes()[mode], rubber("yeoh", np.inf), COARSE)
    local = swept(model, np.array([0.5, 1.0]) * reach(mode))
    assert local.slope.shape == (3, len(local.cells.volume))
    np.testing.assert_allclose(local.slope.sum(axis=1), local.history.force, rtol=1e-6, atol=1e-6)
    # Chords of the cells' faces are not their arcs, so that the solid's own quadrature sets the last digits.
    assert local.cells.volume.sum() == pytest.approx(reference_bushing.measures()["rubber"], rel=2e-3)


@pytest.mark.parametrize("mode", ["axial", "radial"])
def test_cells_of_compressible_rubber_add_up_to_the_derivative_by_the_whole_law(
    mode, reference_bushing, rubber
):
    """All terms of Yeoh are linear: a factor on all of them changes the force by sum c dQ/dc, kappa kept."""
    chosen = rubber("yeoh", 200.0)
    model = prepare(reference_bushing, modes()[mode], chosen, COARSE)
    local = swept(model, np.array([reach(mode)]))
    program = Program(np.array([reach(mode)]))
    exact = march(model, program, sensitivity=tuple(chosen.parameters)).sensitivity[-1]
    assert local.slope[-1].sum() == pytest.approx(exact @ list(chosen.parameters.values()), rel=1e-6)
    assert abs(local.slope[-1].sum() / local.history.force[-1] - 1) > 1e-4


def spotted(rubber, place):
    """Rubber whose law has one more parameter, the change of stiffness where `place(x)` holds."""

    def energy(strain, *, spot, **parameters):
        x = ufl.SpatialCoordinate(ufl.domain.extract_unique_domain(strain.J))
        return rubber.law.energy(strain, **parameters) * (1 + ufl.conditional(place(x), spot, 0.0))

    law = replace(
        rubber.law,
        energy=energy,
        shear_modulus=lambda *, spot, **parameters: rubber.law.shear_modulus(**parameters),
    )
    return Rubber(law, dict(rubber.parameters) | {"spot": 0.0}, rubber.bulk_modulus)


@pytest.mark.parametrize("mode", ["axial", "radial", "conical"])
def test_cells_of_a_spot_add_up_to_the_difference_that_it_makes(mode, reference_bushing, rubber):
    """The quarter of the cells nearest the inner sleeve and the upper end, against a central difference."""
    model = prepare(reference_bushing, modes()[mode], spotted(rubber("yeoh", 200.0), upper_inner), COARSE)
    q = reach(mode)
    local = swept(model, np.array([q]))
    centres = local.cells.centres
    inside = (np.hypot(*centres.T[:-1]) if centres.shape[1] == 3 else centres[:, 0]) < 17.0
    inside &= centres[:, -1] > 0.0
    h = 1e-3
    forces = []
    for spot in (h, -h):
        model.set_parameters({"spot": spot})
        forces.append(march(model, Program(np.array([q])), tolerance=SHARP).force[-1])
    # The march errs by 1e-11 of the force, the difference by h^2 and what rounding makes of 1 / h.
    assert local.slope[-1][inside].sum() == pytest.approx((forces[0] - forces[1]) / (2 * h), rel=1e-5)
    assert 0 < local.slope[-1][inside].sum() < local.slope[-1].sum()


def upper_inner(x):
    """Within 17 mm of the axis, the middle of the rubber, and above mid-length."""
    radius = ufl.sqrt(x[0] ** 2 + x[1] ** 2) if len(x) == 3 else x[0]
    return ufl.And(radius < 17.0, x[len(x) - 1] > 0.0)


def test_a_march_with_memory_carries_its_force_in_the_cells(reference_bushing, rubber):
    """Branches included: incompressible, the isochoric stresses do all the work, whatever the rubber remembers."""
    from bushcli.catalogue import effects

    feature = effects()["viscoelasticity"].feature()
    values = {"g1": 0.3, "tau1": 2.0}
    model = prepare(
        reference_bushing,
        modes()["axial"],
        rubber("yeoh", np.inf),
        COARSE,
        features=[Installed("viscoelasticity", feature, values)],
    )
    q, time = np.array([0.0, 1.0, 2.0, 2.0, 0.5]), np.array([0.0, 1.0, 2.0, 6.0, 7.0])
    local = marched(model, Program(q, time))
    assert local.history.force[3] < 0.97 * local.history.force[2]
    np.testing.assert_allclose(local.slope.sum(axis=1), local.history.force, rtol=1e-6, atol=1e-6)


def test_axial_shear_is_carried_where_it_is_large(rubber):
    """A long bush in simple shear, tau = Q / (2 pi r L): energy per volume goes as 1 / r^2, and so does the slope."""
    shape = shapes()["plain"](inner_radius=10.0, outer_radius=20.0, length=200.0)
    refinement = Refinement(across=6, along=24)
    model = prepare(shape, modes()["axial"], rubber("neo_hookean", np.inf, C10=0.5), refinement)
    local = swept(model, np.array([0.1]))
    r, z = local.cells.centres.T
    middle = np.abs(z) < 50.0
    density = (local.slope[-1] / local.cells.volume * r**2)[middle]
    # Of the midpoint's r^2 in a cell a tenth as wide as the radius: (0.1)^2 / 12 and a little more.
    np.testing.assert_allclose(density, density.mean(), rtol=5e-3)
