"""Deformation measures against their definitions, and against differences of the map itself."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cases import jit
from forms import kinematics
from forms.law import law
from forms.volumetric import mixed_energy
from tests.variations import first_variation, second_variation

POINTS = np.array([(0.2, 0.3), (0.6, 0.1), (0.3, 0.7)])


def half_plane(displacement):
    """Return a function interpolating ``displacement`` (of degree at most 2) on 1 < R < 2, and the radius."""
    n = len(displacement(np.zeros((2, 1))))
    domain = mesh.create_rectangle(MPI.COMM_SELF, [(1, 0), (2, 1)], (1, 1), mesh.CellType.triangle)
    u = fem.Function(fem.functionspace(domain, ("P", 2, (n,))))
    u.interpolate(lambda x: np.array(displacement(x)))
    return u, ufl.SpatialCoordinate(domain)[0]


def values(expression, domain, points):
    """Return the UFL ``expression`` at reference ``points`` of all cells, and these points, one row each."""
    shape = expression.ufl_shape
    cells = np.arange(domain.topology.index_map(domain.topology.dim).size_local, dtype=np.int32)

    def at(e, size):
        return np.asarray(
            fem.Expression(e, points, jit_options=jit.options(light=True)).eval(domain, cells)
        ).reshape(-1, size)

    x = at(ufl.SpatialCoordinate(domain), domain.geometry.dim)
    return at(expression, int(np.prod(shape))).reshape(-1, *shape), x


def measures(strain):
    return ufl.as_vector([strain.J, strain.I1, strain.I2, strain.power_trace(2.0), strain.power_trace(-2.0)])


def expected_measures(F):
    J = np.linalg.det(F)
    C = np.swapaxes(F, 1, 2) @ F * J[:, None, None] ** (-2 / 3)
    I1 = np.trace(C, axis1=1, axis2=2)
    I2 = (I1**2 - np.trace(C @ C, axis1=1, axis2=2)) / 2
    return np.column_stack((J, I1, I2, I1, I2))  # power traces of 2 and -2 are the invariants


def plain(x):
    return [0.1 * x[0] * x[1] - 0.05 * x[1], 0.2 * x[0] ** 2 - 0.1 * x[1]]


def twisted(x):
    return [0.1 * x[0] * x[1], 0.7 * x[1] + 0.3 * x[0] ** 2, 0.2 * x[0] ** 2 - 0.1 * x[1]]


def bent(x):
    return [0.2 * x[1] * x[2], 0.3 * x[0] - 0.1 * x[2] ** 2, 0.1 * x[0] * x[1] + 0.2 * x[2]]


def solid():
    domain = mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, mesh.CellType.tetrahedron)
    u = fem.Function(fem.functionspace(domain, ("P", 2, (3,))))
    u.interpolate(lambda x: np.array(bent(x)))
    return u, kinematics.cartesian(u)


def states():
    """Return name, unknown and kinematics in each of the three settings."""
    u, R = half_plane(plain)
    v, S = half_plane(twisted)
    return [
        ("axisymmetric", u, kinematics.axisymmetric(u, R)),
        ("twist", v, kinematics.axisymmetric_twist(v, S)),
        ("cartesian", *solid()),
    ]


def points_of(domain):
    return POINTS if domain.geometry.dim == 2 else np.column_stack((POINTS * 0.7, [0.1, 0.2, 0.05]))


@pytest.mark.parametrize(("name", "u", "strain"), states(), ids=lambda x: x if isinstance(x, str) else "")
def test_measures_are_those_of_the_deformation_gradient(name, u, strain):
    domain = u.function_space.mesh
    F, _ = values(strain.F, domain, points_of(domain))
    found, _ = values(measures(strain), domain, points_of(domain))
    # The trace of C^-1 is computed from eigenvalues, whose ratio is up to 170 here: rounding grows by its square.
    np.testing.assert_allclose(found, expected_measures(F), rtol=1e-11)
    C, _ = values(strain.C, domain, points_of(domain))
    np.testing.assert_allclose(C, np.swapaxes(F, 1, 2) @ F, rtol=1e-12, atol=1e-15)


def place(R, theta, Z, displacement):
    """Return the current Cartesian position of the material point (R, Theta, Z)."""
    u = displacement(np.array([[R], [Z]]))
    ur, phi, uz = (float(c[0]) for c in (u if len(u) == 3 else [u[0], np.zeros(1), u[1]]))
    return np.array([(R + ur) * np.cos(theta + phi), (R + ur) * np.sin(theta + phi), Z + uz])


@pytest.mark.parametrize("displacement", [plain, twisted])
def test_cylindrical_deformation_gradient_is_that_of_the_map(displacement):
    u, R = half_plane(displacement)
    make = kinematics.axisymmetric if displacement is plain else kinematics.axisymmetric_twist
    C, x = values(make(u, R).C, u.function_space.mesh, POINTS)
    theta, h = 0.4, 1e-5
    for found, (r, z) in zip(C, x, strict=True):
        # Columns: derivatives along the unit vectors of the reference cylinder; central differences, error
        # h^2.
        columns = [
            (place(r + h, theta, z, displacement) - place(r - h, theta, z, displacement)) / (2 * h),
            (place(r, theta + h, z, displacement) - place(r, theta - h, z, displacement)) / (2 * h * r),
            (place(r, theta, z + h, displacement) - place(r, theta, z - h, displacement)) / (2 * h),
        ]
        F = np.column_stack(columns)
        np.testing.assert_allclose(found, F.T @ F, rtol=1e-8, atol=1e-9)


def test_weights_integrate_to_the_volume():
    (_, u, strain), (_, v, twist), (_, w, box) = states()
    for function, one, volume in ((u, strain, 3 * np.pi), (v, twist, 3 * np.pi), (w, box, 1.0)):
        form = fem.form(one.weight * ufl.dx(function.function_space.mesh))
        assert fem.assemble_scalar(form) == pytest.approx(volume, rel=1e-12)


def test_principal_is_the_diagonal_deformation():
    domain = mesh.create_unit_interval(MPI.COMM_SELF, 1)
    e = [fem.Constant(domain, v) for v in (0.3, -0.7)]
    strain = kinematics.principal(*e)
    found, _ = values(measures(strain), domain, np.array([[0.5]]))
    F = np.diag(np.exp([0.3, -0.7, 0.4]))[None]
    np.testing.assert_allclose(found, expected_measures(F), rtol=1e-13)


@pytest.mark.parametrize(("name", "u", "strain"), states(), ids=lambda x: x if isinstance(x, str) else "")
def test_variations_by_measures_are_those_of_ufl(name, u, strain):
    V = u.function_space
    rng = np.random.default_rng(2)
    h, k = fem.Function(V), fem.Function(V)
    for f in (h, k):
        f.x.array[:] = rng.standard_normal(f.x.array.size)
    W = law("mooney_rivlin").energy(strain, C10=0.4, C01=0.1) + mixed_energy(strain.J, 0.3, 0.01)
    W = (W + 0.1 * strain.power_trace(3.0)) * strain.weight
    plain_first = ufl.derivative(W, u, h)
    both = ufl.as_vector(
        [
            first_variation(W, strain.measures, u, h),
            plain_first,
            second_variation(W, strain.measures, u, h, k),
            second_variation(W, strain.measures, u, k, h),
            ufl.derivative(plain_first, u, k),
        ]
    )
    found, _ = values(both, V.mesh, points_of(V.mesh))
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-11)
    np.testing.assert_allclose(found[:, 2], found[:, 3], rtol=1e-9)
    np.testing.assert_allclose(found[:, 2], found[:, 4], rtol=1e-9)


def test_a_density_with_other_dependence_is_refused():
    u, strain = solid()
    with pytest.raises(ValueError, match="other than through the measures"):
        first_variation(strain.J + u[0], strain.measures, u, ufl.TestFunction(u.function_space))


def test_nested_measures_are_refused():
    u, strain = solid()
    nested = ufl.variable(strain.J**2)
    with pytest.raises(ValueError, match="made of another"):
        first_variation(nested, (strain.J, nested), u, ufl.TestFunction(u.function_space))


def test_mixed_energy_is_the_penalty_at_its_stationary_point():
    kappa, J = 50.0, 1.03
    assert mixed_energy(J, kappa * (J - 1), 1 / kappa) == pytest.approx(kappa / 2 * (J - 1) ** 2, rel=1e-13)
    assert mixed_energy(J, 2.0, 0.0) == pytest.approx(2.0 * (J - 1))
