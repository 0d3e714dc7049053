"""Order of convergence of the force, patch tests, and the limit of incompressibility."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
import ufl
from dolfinx import fem
from scipy.interpolate import RegularGridInterpolator

from cases.march import march
from cases.mode import Mode, Setting, modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.blocks import Interval
from geometry.shape import Blocks, Refinement, Shape, shapes

ANNULUS = shapes()["plain"](inner_radius=10.0, outer_radius=20.0, length=10.0)
MU = 0.8
# Where the boundary prescribes the normal displacement everywhere, exact incompressibility leaves the mean pressure
# undetermined; with this bulk modulus the volume changes by 1e-8.
NEO_HOOKEAN = Rubber(law("neo_hookean"), {"C10": 0.5 * MU}, 1e8)
# Second-order displacement, first-order pressure: the energy, and with it the force, has twice the order of the strain.
SUPERCONVERGENCE = 4.0


def held_ends(name, components):
    mode = modes()[name]
    return replace(mode, held=dict(mode.held) | {"end_top": components, "end_bottom": components})


def force(mode, q, refinement, rubber=NEO_HOOKEAN, shape=ANNULUS):
    return march(prepare(shape, mode, rubber, refinement), Program(np.array([q])), tolerance=1e-11).force[0]


# Modes with ends held so that the exact solution is smooth and known (test_closed_forms.py), q and exact force at q;
# radial: in plane strain, so small that its square (1e-10) does not count.
SMOOTH = {
    "torsional": ((2,), 0.5, 4 * np.pi * MU * 10 * 0.5 / (1 / 100 - 1 / 400)),
    "axial": ((0,), 5.0, 2 * np.pi * MU * 10 * 5.0 / np.log(2)),
    "radial": ((2,), 1e-4, 4 * np.pi * 500 / (500 * np.log(2) - 300) * MU * 10 * 1e-4),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_force_converges_with_the_fourth_power_of_the_element_size(name):
    components, q, exact = SMOOTH[name]
    errors = [
        force(held_ends(name, components), q, Refinement(across=n, along=1, around=6 * n)) / exact - 1
        for n in (2, 4, 8)
    ]
    assert all(error > 0 for error in errors)
    # Over the last halving: the first is not yet in the asymptotic range.
    assert np.log2(errors[1] / errors[2]) > SUPERCONVERGENCE - 0.2, errors


@pytest.mark.parametrize("name", ["axial", "radial", "conical"])
def test_force_falls_toward_its_limit_with_free_ends(name, reference_bushing, rubber):
    """The bond edges are singular: the order is lower there, but finer meshes are softer, and ever closer.

    From the default mesh on; coarser ones, with two elements across, are not yet in order.
    """
    rest = None, None, None
    found = [
        force(modes()[name], 0.01, Refinement(*rest, factor=f), rubber("yeoh"), reference_bushing)
        for f in FACTORS[name]
    ]
    changes = -np.diff(found) / found[-1]
    assert np.all(changes > 0)
    assert len(changes) == 1 or changes[-1] < changes[0]
    # The difference between the default mesh and its refinement is well within the promised one percent.
    assert changes.sum() < 0.003


# Factors on the default mesh, in every direction; the conical model is half the bushing and grows fast.
FACTORS = {"axial": (1.0, 2.0, 4.0), "radial": (1.0, 1.34, 1.67), "conical": (1.0, 1.34)}


class Distorted(Shape):
    """A cube of 3 x 3 x 3 straight-edged elements whose inner vertices are moved at random (fixed seed)."""

    name: ClassVar[str] = "distorted"
    summary: ClassVar[str] = "patch"
    specimen: ClassVar[str] = "coupon"

    def blocks(self, dimension, mirrors, refinement):
        vertices = np.linspace(0, 1, 4)
        shift = np.zeros((4, 4, 4, 3))
        # A quarter of an element's edge.
        shift[1:-1, 1:-1, 1:-1] = np.random.default_rng(1).uniform(-0.08, 0.08, (2, 2, 2, 3))
        moved = RegularGridInterpolator((vertices,) * 3, shift)
        return Blocks(
            ((Interval(0.0, 1.0, 3),),) * 3,
            lambda middle: "rubber",
            lambda axis, middle: f"{'mirror' if middle[axis] < 0.5 else 'face'}_{'xyz'[axis]}",
            lambda p: p + moved(np.clip(p, 0, 1)),
        )


# Displacement gradient at q = 1: stretch, shear and rotation mixed, J = det(1 + H q) = 1.27 at q = 0.4.
GRADIENT = np.array([[0.5, 0.3, -0.2], [0.6, -0.1, 0.4], [-0.3, 0.2, 0.3]])


@pytest.mark.parametrize("name", ["yeoh", "mooney_rivlin"])
def test_patch_of_distorted_elements_deforms_homogeneously(name, rubber):
    """Every boundary point moves with x -> (1 + q H) x; inner nodes must follow, and the stress must be uniform."""
    faces = {f"{kind}_{axis}": None for kind in ("mirror", "face") for axis in "xyz"}
    affine = Setting("cartesian", lambda x, q: q * GRADIENT @ x, lambda x, q: GRADIENT @ x)
    mode = Mode("patch", "homogeneous", "coupon", False, affine, driven=faces, held={})
    chosen = rubber(name, 5.0)
    model = prepare(Distorted(), mode, chosen)
    history = march(model, Program(np.array([0.4])), tolerance=1e-11)
    mesh, (u, p) = model.mesh.mesh, ufl.split(model.state)
    dx = ufl.dx(mesh)
    wrong = u - 0.4 * ufl.as_matrix(GRADIENT.tolist()) * ufl.SpatialCoordinate(mesh)
    assert fem.assemble_scalar(fem.form(ufl.inner(wrong, wrong) * dx)) ** 0.5 < 1e-10
    J = np.linalg.det(np.eye(3) + 0.4 * GRADIENT)
    assert fem.assemble_scalar(fem.form((p - 5.0 * (J - 1)) ** 2 * dx)) ** 0.5 < 1e-9
    # The energy and its derivative on paper.
    F = np.eye(3) + 0.4 * GRADIENT
    C = F.T @ F
    I1 = J ** (-2 / 3) * np.trace(C) - 3
    I2 = J ** (-4 / 3) * (np.trace(C) ** 2 - np.trace(C @ C)) / 2 - 3
    c = chosen.parameters
    W = (
        c["C10"] * I1
        + c.get("C01", 0) * I2
        + c.get("C20", 0) * I1**2
        + c.get("C30", 0) * I1**3
        + 2.5 * (J - 1) ** 2
    )
    assert history.energy[0] == pytest.approx(W, rel=1e-10)


# Paths of six motions (`follow`) are left out: they consist of the modes tested here.
@pytest.mark.parametrize(
    "name", [m.name for m in modes().values() if m.specimen == "bushing" and m.follow is None]
)
def test_a_large_bulk_modulus_is_the_incompressible_limit(name, reference_bushing, rubber):
    q = 0.05 if modes()[name].rotational else 1.0
    coarse = Refinement(across=2, along=6, around=8)
    found = {
        kappa: force(modes()[name], q, coarse, rubber("yeoh", kappa), reference_bushing)
        for kappa in (np.inf, 1e6, 2000.0, 1000.0)
    }
    # Deviation of the order mu / kappa times the square of the shape factor (length over thickness).
    assert found[1e6] == pytest.approx(found[np.inf], rel=2e-5)
    assert found[1000.0] < found[2000.0] < found[1e6] < found[np.inf] * (1 + 1e-9)
    # The radial and conical stiffness comes from confinement, the others' from shear.
    softened = 1 - found[2000.0] / found[np.inf]
    assert 0.001 < softened < 0.01 if name in ("radial", "conical") else softened < 0.0001
    # In proportion to the compressibility.
    assert 1 - found[1000.0] / found[np.inf] == pytest.approx(2 * softened, rel=0.02)


def test_incompressible_rubber_keeps_its_volume():
    """Exactly in the mean; pointwise with the second power of the element size, where the solution is smooth."""
    roots = []
    for across in (4, 8):
        mode = held_ends("axial", (0,))
        model = prepare(
            ANNULUS, mode, replace(NEO_HOOKEAN, bulk_modulus=np.inf), Refinement(across=across, along=2)
        )
        march(model, Program(np.array([5.0])), tolerance=1e-11)
        weight, dx = model.strain.weight, ufl.dx(model.mesh.mesh, metadata={"quadrature_degree": 4})
        volume = fem.assemble_scalar(fem.form(weight * dx))
        change = fem.assemble_scalar(fem.form((model.strain.J - 1) * weight * dx))
        assert abs(change / volume) < 1e-10
        roots.append((fem.assemble_scalar(fem.form((model.strain.J - 1) ** 2 * weight * dx)) / volume) ** 0.5)
    assert np.log2(roots[0] / roots[1]) > 1.8
    # 50 % mean shear.
    assert roots[1] < 1e-3


@pytest.mark.parametrize("name", ["axial", "torsional"])
def test_solid_and_section_give_the_same_curve(name, reference_bushing, rubber):
    """Same elements in the section; the solid adds 24 around the circumference."""
    q = np.array([0.1, 0.3]) if name == "torsional" else np.array([1.0, 4.0])
    mesh = Refinement(across=3, along=8, around=24)
    mode = modes()[name]
    section = march(prepare(reference_bushing, mode, rubber("yeoh"), mesh), Program(q))
    solid = march(prepare(reference_bushing, replace(mode, section=None), rubber("yeoh"), mesh), Program(q))
    # The default meshes are graded differently, which changes the forces more than the circumferential elements do.
    np.testing.assert_allclose(solid.force, section.force, rtol=5e-3)
    np.testing.assert_allclose(solid.energy, section.energy, rtol=5e-3)
