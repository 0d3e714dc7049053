"""Power traces of the principal stretches: values and two derivatives, especially where stretches coincide.

The reference is the spectral representation of an isotropic tensor function, with the divided differences of
Daleckii and Krein for its second derivative: accurate at any multiplicity, and sharing no formula with the
invariants used in forms/spectral.py.
"""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cases import jit
from forms.kinematics import axisymmetric, cartesian
from forms.spectral import PAIR, SPHERE
from tests.variations import first_variation, second_variation

ALPHAS = (-25.0, -4.0, -2.0, 1.3, 2.0, 5.0, 11.0, 25.0)
TINY = (
    0.0,
    1e-12,
    1e-9,
    1e-6,
    1e-5,
    1e-4,
    1e-3,
    0.3 * SPHERE,
    0.9 * SPHERE,
    1.1 * SPHERE,
    0.9 * PAIR,
    1.1 * PAIR,
)


def principal_states() -> np.ndarray:
    """Return principal stretches: named states, each perturbed by TINY in two independent ways."""
    named = [
        (1, 1, 1),  # undeformed
        (2, 2**-0.5, 2**-0.5),  # uniaxial tension: the smaller two coincide
        (0.4, 0.4**-0.5, 0.4**-0.5),  # uniaxial compression: the larger two coincide
        (1.7, 1.7, 1.7**-2),  # equibiaxial
        (1.5, 1, 1 / 1.5),  # planar
        (1.0001, 1, 1 / 1.0001),  # planar, small
        (1.3, 1.1, 0.7),  # compressible
        (3.0, 0.9, 0.4),
        (1.2, 1.2, 1.2),  # swollen
        (np.sqrt(2.1), np.sqrt(1.4), np.sqrt(0.7)),  # C equally spaced: where largest and smallest swap roles
    ]
    states = [np.array(s, dtype=float) for s in named]
    return np.array(
        [s * np.exp(t * np.array(d)) for s in states for t in TINY for d in ((1, -0.3, -0.7), (0, 1, -1))]
    )


def rotations(n: int, seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, 3, 3)))
    return q


def reference(F: np.ndarray, H: np.ndarray, K: np.ndarray, alpha: float) -> tuple[np.ndarray, ...]:
    """Return f = J^(-alpha/3) tr((F^T F)^(alpha/2)), Df[H], D2f[H, K], and the size of the terms they sum."""
    beta, T = alpha / 2, np.swapaxes
    _, s, right = np.linalg.svd(F)
    C, W = s**2, T(right, 1, 2)

    def turned(A: np.ndarray) -> np.ndarray:
        return T(W, 1, 2) @ A @ W

    dH, dK = turned(T(H, 1, 2) @ F + T(F, 1, 2) @ H), turned(T(K, 1, 2) @ F + T(F, 1, 2) @ K)
    d2 = turned(T(H, 1, 2) @ K + T(K, 1, 2) @ H)
    b = beta - 1
    x, y = C[:, :, None], C[:, None, :]
    ratio = (x - y) / y
    with np.errstate(divide="ignore", invalid="ignore"):
        divided = np.where(x == y, b * y ** (b - 1), y**b * np.expm1(b * np.log1p(ratio)) / (x - y))
    g = (C**beta).sum(1)
    gH = beta * np.einsum("ni,nii->n", C**b, dH)
    gK = beta * np.einsum("ni,nii->n", C**b, dK)
    gHK = beta * (np.einsum("nij,nij,nij->n", divided, dH, dK) + np.einsum("ni,nii->n", C**b, d2))
    inverse = np.linalg.inv(F)
    lH, lK = np.trace(inverse @ H, axis1=1, axis2=2), np.trace(inverse @ K, axis1=1, axis2=2)
    lHK = -np.trace(inverse @ K @ inverse @ H, axis1=1, axis2=2)
    factor, a = np.linalg.det(F) ** (-alpha / 3), -alpha / 3
    f = factor * g
    fH = factor * (gH + a * lH * g)
    fHK = factor * (gHK + a * (lH * gK + lK * gH) + (a * a * lH * lK + a * lHK) * g)
    size = np.abs(factor) * np.abs(beta) * (C**b).max(1) * np.linalg.norm(dH, axis=(1, 2))
    size2 = np.abs(factor) * np.abs(divided).max((1, 2)) * np.abs(beta) * np.linalg.norm(dH, axis=(1, 2))
    return f, fH, fHK, size + f * np.abs(a * lH), size2 * np.linalg.norm(dK, axis=(1, 2)) + size + f


class Pointwise:
    """Homogeneous deformations, one per cell, in a discontinuous linear space."""

    def __init__(self, cells: mesh.Mesh, n: int, radius: bool) -> None:
        self.mesh, self.n = cells, n
        self.space = fem.functionspace(cells, ("DG", 1, (n,)))
        self.u, self.h, self.k = (fem.Function(self.space) for _ in range(3))
        self.alpha = fem.Constant(cells, 2.0)
        X = ufl.SpatialCoordinate(cells)
        kinematics = axisymmetric(self.u, X[0]) if radius else cartesian(self.u)
        energy, m = kinematics.power_trace(self.alpha), kinematics.measures
        u, h, k = self.u, self.h, self.k
        plain = ufl.derivative(energy, u, h)
        terms = [
            energy,
            plain,
            first_variation(energy, m, u, h),
            second_variation(energy, m, u, h, k),
        ]
        point = np.full((1, cells.topology.dim), 0.25)
        self.expression = fem.Expression(ufl.as_vector(terms), point, jit_options=jit.options(light=True))
        self.count = cells.topology.index_map(cells.topology.dim).size_local

    def set(self, function: fem.Function, gradients: np.ndarray) -> None:
        """Set ``function`` on cell i to gradients[i] x."""
        x = self.space.tabulate_dof_coordinates().reshape(self.count, -1, 3)[:, :, : self.n]
        function.x.array[:] = np.einsum("cij,cpj->cpi", gradients, x).ravel()

    def evaluate(self, alpha: float) -> np.ndarray:
        """Return energy, its first derivative (by UFL and by the chain) and its second, shape (4, cells)."""
        self.alpha.value = alpha
        values = self.expression.eval(self.mesh, np.arange(self.count, dtype=np.int32))
        return np.asarray(values).reshape(self.count, -1).T


@pytest.fixture(scope="module")
def solid() -> tuple[Pointwise, np.ndarray, np.ndarray, np.ndarray]:
    stretches = principal_states()
    blocks = int(np.ceil(len(stretches) / 6))
    cells = mesh.create_box(MPI.COMM_SELF, [(0, 0, 0), (1, 1, 1)], (blocks, 1, 1), mesh.CellType.tetrahedron)
    stretches = np.resize(stretches, (6 * blocks, 3))
    n = len(stretches)
    F = rotations(n, 1) @ (stretches[:, :, None] * rotations(n, 2))
    F[:, 0] *= np.sign(np.linalg.det(F))[:, None]
    H, K = np.random.default_rng(3).standard_normal((2, n, 3, 3))
    points = Pointwise(cells, 3, radius=False)
    for function, gradient in ((points.u, F - np.eye(3)), (points.h, H), (points.k, K)):
        points.set(function, gradient)
    return points, F, H, K


@pytest.mark.parametrize("alpha", ALPHAS)
def test_three_dimensional_power_trace_and_derivatives(solid, alpha):
    points, F, H, K = solid
    compare(points.evaluate(alpha), reference(F, H, K, alpha))


@pytest.fixture(scope="module")
def half_plane() -> tuple[Pointwise, np.ndarray, np.ndarray, np.ndarray]:
    stretches = principal_states()
    n = len(stretches)
    cells = mesh.create_rectangle(MPI.COMM_SELF, [(1, 0), (2, 1)], (n // 2, 1), mesh.CellType.triangle)
    points = Pointwise(cells, 2, radius=True)
    rng = np.random.default_rng(4)
    # The hoop takes each principal stretch in turn; it follows from u_r / R at the point of evaluation.
    hoop = np.arange(n) % 3
    others = np.array(
        [[s for j, s in enumerate(row) if j != i] for row, i in zip(stretches, hoop, strict=True)]
    )
    t1, t2 = rng.uniform(0, np.pi, (2, n))

    def turn(t: np.ndarray) -> np.ndarray:
        return np.moveaxis(np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]), 2, 0)

    plane = turn(t1) @ (others[:, :, None] * turn(t2))
    x = points.space.tabulate_dof_coordinates().reshape(n, 3, 3)[:, :, :2]
    centre = x[:, 0] + 0.25 * (x[:, 1] - x[:, 0]) + 0.25 * (x[:, 2] - x[:, 0])
    full = []
    for function, gradient, value in (
        (points.u, plane - np.eye(2), stretches[np.arange(n), hoop] - 1),
        (points.h, rng.standard_normal((n, 2, 2)), rng.standard_normal(n)),
        (points.k, rng.standard_normal((n, 2, 2)), rng.standard_normal(n)),
    ):
        nodal = np.einsum("cij,cpj->cpi", gradient, x - centre[:, None])
        nodal[:, :, 0] += (value * centre[:, 0])[:, None]
        function.x.array[:] = nodal.ravel()
        G = np.zeros((n, 3, 3))
        G[:, 0, 0], G[:, 0, 2], G[:, 2, 0], G[:, 2, 2] = (gradient[:, i, j] for i in (0, 1) for j in (0, 1))
        G[:, 1, 1] = value
        full.append(G)
    return points, full[0] + np.eye(3), full[1], full[2]


@pytest.mark.parametrize("alpha", ALPHAS)
def test_axisymmetric_power_trace_and_derivatives(half_plane, alpha):
    points, F, H, K = half_plane
    compare(points.evaluate(alpha), reference(F, H, K, alpha))


def compare(found: np.ndarray, expected: tuple[np.ndarray, ...]) -> None:
    f, fH, fHK, size, size2 = expected
    # Rounding, amplified by the exponent and by the extent of the deformation (C from 0.16 to 9), relative to
    # the largest term of each sum; the second derivative also loses what spectral.py says at its switches.
    np.testing.assert_array_less(np.abs(found[0] - f), 1e-11 * f)
    np.testing.assert_array_less(np.abs(found[1] - fH), 1e-11 * size)
    np.testing.assert_array_less(np.abs(found[2] - fH), 1e-11 * size)
    np.testing.assert_array_less(np.abs(found[3] - fHK), 1e-9 * size2)
