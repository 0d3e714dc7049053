"""What every hyperelastic law must do; a new file in forms/laws needs no change here to be tested."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from cases import jit
from cases.stability import stable
from forms.kinematics import cartesian
from forms.law import UnknownName, law, laws
from tests.variations import first_variation, second_variation

NAMES = tuple(laws())
RNG_SEED = 11


class Probe:
    """A law in homogeneous deformations, one per cell of a small mesh."""

    def __init__(self, name: str) -> None:
        self.law = law(name)
        self.mesh = mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, mesh.CellType.tetrahedron)
        self.cells = np.arange(6, dtype=np.int32)
        self.space = fem.functionspace(self.mesh, ("DG", 1, (3,)))
        self.u, self.h = fem.Function(self.space), fem.Function(self.space)
        self.start = {p.name: p.start for p in self.law.parameters}
        self.constants = {name: fem.Constant(self.mesh, value) for name, value in self.start.items()}
        marked = {name: ufl.variable(constant) for name, constant in self.constants.items()}
        state = cartesian(self.u)
        W = self.law.energy(state, **marked)
        values = [
            W,
            first_variation(W, state.measures, self.u, self.h),
            second_variation(W, state.measures, self.u, self.h, self.h),
            ufl.derivative(W, self.u, self.h),
            *(ufl.diff(W, variable) for variable in marked.values()),
        ]
        point = np.full((1, 3), 0.25)
        self.expression = fem.Expression(ufl.as_vector(values), point, jit_options=jit.options(light=True))
        self.gradient(self.h, np.random.default_rng(RNG_SEED).standard_normal((6, 3, 3)))

    def gradient(self, function: fem.Function, gradients: np.ndarray) -> None:
        x = self.space.tabulate_dof_coordinates().reshape(6, 4, 3)
        function.x.array[:] = np.einsum("cij,cpj->cpi", gradients, x).ravel()

    def __call__(self, F: np.ndarray, **changed: float) -> np.ndarray:
        """Return W, dW[H], d2W[H, H], dW[H] by UFL alone and dW/dparameter; F of shape (6, 3, 3)."""
        self.gradient(self.u, F - np.eye(3))
        for name, value in (self.start | changed).items():
            self.constants[name].value = value
        return np.asarray(self.expression.eval(self.mesh, self.cells)).reshape(6, -1).T


@cache
def probe(name: str) -> Probe:
    return Probe(name)


def deformations(size: float = 0.3) -> np.ndarray:
    """Return six random deformation gradients (fixed seed) with positive determinant."""
    return np.eye(3) + size * np.random.default_rng(5).uniform(-1, 1, (6, 3, 3))


def rotations() -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(7).standard_normal((6, 3, 3)))
    return q * np.linalg.det(q)[:, None, None]


@pytest.mark.parametrize("name", NAMES)
def test_no_energy_and_no_stress_undeformed(name):
    W, dW, *_ = probe(name)(np.tile(np.eye(3), (6, 1, 1)))
    mu = probe(name).law.shear_modulus(**probe(name).start)
    np.testing.assert_allclose(W, 0, atol=1e-14 * mu)
    np.testing.assert_allclose(dW, 0, atol=1e-13 * mu)


@pytest.mark.parametrize("name", NAMES)
def test_energy_is_positive_when_deformed(name):
    assert np.all(probe(name)(deformations())[0] > 0)


@pytest.mark.parametrize("name", NAMES)
def test_objective_and_isotropic(name):
    W = probe(name)(deformations())[0]
    np.testing.assert_allclose(probe(name)(rotations() @ deformations())[0], W, rtol=1e-12)
    np.testing.assert_allclose(probe(name)(deformations() @ rotations())[0], W, rtol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_rotation_gives_no_force(name):
    mu = probe(name).law.shear_modulus(**probe(name).start)
    np.testing.assert_allclose(probe(name)(rotations())[1], 0, atol=1e-13 * mu)


@pytest.mark.parametrize("name", NAMES)
def test_a_change_of_volume_alone_costs_nothing(name):
    np.testing.assert_allclose(
        probe(name)(1.3 * deformations())[0], probe(name)(deformations())[0], rtol=1e-12
    )


@pytest.mark.parametrize("name", NAMES)
def test_declared_shear_modulus_is_that_of_the_energy(name):
    curvature = probe(name)(np.tile(np.eye(3), (6, 1, 1)))[2]
    H = np.random.default_rng(RNG_SEED).standard_normal((6, 3, 3))
    strain = (H + np.swapaxes(H, 1, 2)) / 2
    deviator = strain - np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
    mu = probe(name).law.shear_modulus(**probe(name).start)
    np.testing.assert_allclose(curvature, 2 * mu * (deviator**2).sum(axis=(1, 2)), rtol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_declared_shear_modulus_can_be_differentiated_by_a_complex_step(name):
    """Branches and bonds scale with it, so that their derivatives by the law's parameters contain its derivative."""
    one, start = probe(name).law, probe(name).start
    for parameter, value in start.items():
        h = 1e-6 * max(abs(value), 1.0)
        ends = [one.shear_modulus(**start | {parameter: value + step}) for step in (h, -h)]
        slope = complex(one.shear_modulus(**start | {parameter: value + 1e-30j})).imag / 1e-30
        assert slope == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_first_derivative_matches_differences_of_the_energy_and_ufl(name):
    F, H, step = deformations(), np.random.default_rng(RNG_SEED).standard_normal((6, 3, 3)), 1e-3
    # Fourth-order difference: error step^4 = 1e-12 times the fifth derivative, and rounding 1e-16 / step.
    W = {k: probe(name)(F + k * step * H)[0] for k in (-2, -1, 1, 2)}
    expected = (8 * (W[1] - W[-1]) - (W[2] - W[-2])) / (12 * step)
    _, dW, _, by_ufl, *_ = probe(name)(F)
    np.testing.assert_allclose(dW, expected, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(dW, by_ufl, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_second_derivative_matches_differences_of_the_first(name):
    F, H, step = deformations(), np.random.default_rng(RNG_SEED).standard_normal((6, 3, 3)), 1e-3
    dW = {k: probe(name)(F + k * step * H)[1] for k in (-2, -1, 1, 2)}
    expected = (8 * (dW[1] - dW[-1]) - (dW[2] - dW[-2])) / (12 * step)
    np.testing.assert_allclose(probe(name)(F)[2], expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_parameter_derivatives_match_differences(name):
    F = deformations()
    derivatives = probe(name)(F)[4:]
    for parameter, found in zip(probe(name).law.parameters, derivatives, strict=True):
        step = 1e-4 * max(abs(parameter.start), 1e-2)
        up, down = (probe(name)(F, **{parameter.name: parameter.start + s * step})[0] for s in (1, -1))
        np.testing.assert_allclose(
            found, (up - down) / (2 * step), rtol=1e-6, atol=1e-9, err_msg=parameter.name
        )


@pytest.mark.parametrize("name", NAMES)
def test_linear_parameters_are_exactly_those_declared(name):
    F, at = deformations(), probe(name)
    linear = at.law.linear
    assert set(linear) <= {p.name for p in at.law.parameters}
    other = {n: at.start[n] * f for n, f in zip(linear, np.linspace(0.5, 2.0, len(linear)), strict=True)}
    added = {n: at.start[n] + 3 * other[n] for n in linear}
    np.testing.assert_allclose(at(F, **added)[0], at(F)[0] + 3 * at(F, **other)[0], rtol=1e-12)
    for name_ in set(at.start) - set(linear):
        doubled = at(F, **{name_: 2 * at.start[name_]})[0] - at(F)[0]
        assert not np.allclose(
            doubled, 2 * (at(F, **{name_: 1.5 * at.start[name_]})[0] - at(F)[0]), rtol=1e-3
        )


@pytest.mark.parametrize("name", NAMES)
def test_parameters_are_described_and_bounded(name):
    one = law(name)
    assert len({p.name for p in one.parameters}) == len(one.parameters)
    for p in one.parameters:
        assert p.unit in ("MPa", "1")
        assert p.meaning
        assert p.lower < p.start < p.upper
        assert p.admits(p.start)
        assert not p.admits(p.upper + 1)
        assert not p.admits(np.nan)
        assert one.parameter(p.name) is p
    with pytest.raises(UnknownName):
        one.parameter("C99")


@pytest.mark.parametrize("name", NAMES)
def test_start_is_a_stable_rubber(name):
    one = law(name)
    assert one.shear_modulus(**one.start) > 0
    x = np.linspace(0.5, 2.0, 31)
    assert stable(one, one.start, np.column_stack((x, x**-0.5, x**-0.5))).all()


@pytest.mark.parametrize("name", NAMES)
def test_formula_and_source_are_given(name):
    one = law(name)
    assert one.summary.startswith("W = ")
    assert "doi:10." in one.source
    assert one.energy.__doc__
    assert "doi:10." in one.energy.__doc__
    assert "W = " in one.energy.__doc__
    assert one.basis in ("I1", "I1,I2", "stretches")
    assert one.energy.__module__ == f"forms.laws.{name}"


def test_unknown_law_names_the_nearest():
    with pytest.raises(UnknownName, match='"yeho" is not a law; did you mean "yeoh"'):
        law("yeho")
    with pytest.raises(ValueError, match=r"is not a law; known: \(arruda_boyce"):
        law("xxxxxxxx")


def test_registry_does_not_load_the_finite_element_stack():
    code = "import sys; from forms.law import laws; laws(); print('ufl' in sys.modules)"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "False"


@pytest.mark.parametrize("given", [{"mu1": 1.0}, {"mu1": 1.0, "alpha1": 2.0, "alpha3": 1.0}, {}])
def test_half_an_ogden_term_is_refused(given):
    with pytest.raises(ValueError, match="is missing"):
        law("ogden").shear_modulus(**given)


def test_ogden_exponent_may_pass_through_zero():
    """mu/alpha (sum l^alpha - 3) tends to mu alpha/2 sum ln^2 l; a fit may hit alpha = 0."""
    at, F = probe("ogden"), deformations()
    single = {"mu2": 0.0, "mu3": 0.0, "mu1": 1.0}
    near, there = (at(F, **single, alpha1=a) for a in (1e-4, 0.0))
    assert np.isfinite(there).all()
    slope = at.law.parameters.index(at.law.parameter("alpha1")) + 4
    np.testing.assert_allclose(near[0], 1e-4 * near[slope], rtol=1e-3)
    C = np.swapaxes(F, 1, 2) @ F
    logs = np.log(np.linalg.eigvalsh(C) * np.linalg.det(C)[:, None] ** (-1 / 3)) / 2
    np.testing.assert_allclose(near[0], 1e-4 / 2 * (logs**2).sum(1), rtol=1e-3)
    np.testing.assert_allclose(there[0], 0, atol=1e-6)
