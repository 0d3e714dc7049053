"""Dynamic stiffness against closed forms, against the full system at each frequency, and against the march in time.

Closed forms of a long bonded annulus a < b that is sheared along or about its axis with G* = mu (1 + s), per length:
axial 2 pi G* / ln(b/a), torsional 4 pi G* / (1/a^2 - 1/b^2). With inertia, axially, k^2 = rho omega^2 / G* and u(r) =
[J0(kr) Y0(kb) - Y0(kr) J0(kb)] / [J0(ka) Y0(kb) - Y0(ka) J0(kb)] (shear waves in cylindrical coordinates). The free
ends do not shear as in a long annulus: the difference of two lengths is without them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import jv, yv

from bushcli.simulate.stiffness import matrices_along
from cases.dynamic.model import DynamicModel, sweep
from cases.dynamic.pencil import Pencil
from cases.dynamic.reduction import basis_for
from cases.equilibrium import Equilibrium
from cases.feature import Feature, Installed
from cases.march import march
from cases.mode import mode_of, modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.simulate import Rubber, prepare
from cases.six import SixPath
from forms.branches.maxwell import BRANCH
from forms.law import law
from forms.potential import Attached
from geometry.shape import Refinement, Shape, shapes

A, B, LENGTH, C10 = 12.0, 22.0, 100.0, 0.5
MU, DENSITY = 2 * C10, 1.1e-9
BRANCHES = ((0.3, 0.01), (0.15, 3e-4))
FREQUENCIES = np.array([1.0, 10.0, 30.0, 100.0, 300.0])


def annulus(length: float = LENGTH) -> Shape:
    return shapes()["plain"].model_validate({"inner_radius": A, "outer_radius": B, "length": length})


def neo_hookean(bulk_modulus: float = np.inf) -> Rubber:
    return Rubber(law("neo_hookean"), {"C10": C10}, bulk_modulus)


def vibrating(
    model: FiniteElementModel,
    q: float,
    frequencies: np.ndarray = FREQUENCIES,
    branches: tuple[tuple[float, float], ...] = BRANCHES,
    density: float = DENSITY,
    tolerance: float = 1e-6,
    steps: int = 4,
    metal: dict[str, float] | None = None,
) -> tuple[DynamicModel, Pencil]:
    found: list[tuple[DynamicModel, Pencil]] = []
    path = np.linspace(0.0, q, steps + 1) if q else np.zeros(1)

    def observe(solver: Equilibrium) -> None:
        if solver.q == q and not found:
            pencil = Pencil(model, solver, metal or {})
            found.append(
                (
                    DynamicModel(
                        basis_for(pencil, sweep(frequencies, branches), density, tolerance).reduced_pencil()
                    ),
                    pencil,
                )
            )

    march(model, Program(path), observer=observe)
    return found[0]


def complex_modulus(frequencies: np.ndarray) -> np.ndarray:
    iw = 2j * np.pi * frequencies
    return MU * (1 + sum(g * iw * tau / (1 + iw * tau) for g, tau in BRANCHES))


def agree(found: np.ndarray, exact: np.ndarray, percent: float, degrees: float) -> None:
    assert np.abs(np.abs(found) / np.abs(exact) - 1).max() < percent / 100
    assert np.abs(np.degrees(np.angle(found / exact))).max() < degrees


def per_length(mode: str, frequencies: np.ndarray, density: float) -> np.ndarray:
    """Stiffness of a mm of a long annulus, on default meshes: driving point and transfer, (2, f)."""
    found = []
    for length in (LENGTH, 2 * LENGTH):
        model = prepare(annulus(length), modes()[mode], neo_hookean())
        reduced, _ = vibrating(model, 0.0, frequencies, density=density)
        found.append(np.array(reduced.reduced.stiffness(sweep(frequencies, BRANCHES))))
    return (found[1] - found[0])[:, :, 0, 0] / LENGTH


@pytest.mark.parametrize(
    ("mode", "factor"),
    [("axial", 2 * np.pi / np.log(B / A)), ("torsional", 4 * np.pi / (A**-2 - B**-2))],
)
def test_stiffness_without_inertia(mode: str, factor: float) -> None:
    found = per_length(mode, FREQUENCIES, 0.0)
    exact = factor * complex_modulus(FREQUENCIES)
    agree(found[0], exact, 0.3, 0.1)
    agree(found[1], exact, 0.3, 0.1)


def test_axial_waves() -> None:
    # The highest frequency lies above the first resonance of the clamped annulus, 1.5 kHz.
    frequencies = np.array([10.0, 100.0, 500.0, 1000.0, 2000.0])
    found = per_length("axial", frequencies, DENSITY)
    G = complex_modulus(frequencies)
    k = 2 * np.pi * frequencies * np.sqrt(DENSITY / G)

    def slope(r: float) -> np.ndarray:
        numerator = jv(1, k * r) * yv(0, k * B) - yv(1, k * r) * jv(0, k * B)
        return -k * numerator / (jv(0, k * A) * yv(0, k * B) - yv(0, k * A) * jv(0, k * B))

    agree(found[0], -2 * np.pi * A * G * slope(A), 0.3, 0.1)
    agree(found[1], -2 * np.pi * B * G * slope(B), 0.3, 0.1)


def coarse(length: float = 30.0, **other: object) -> Shape:
    return shapes()["plain"].model_validate({"inner_radius": A, "outer_radius": B, "length": length, **other})


SLEEVES = {"inner_sleeve": {"thickness": 2.0}, "outer_sleeve": {"thickness": 2.0}}
COARSE = Refinement(across=2, along=3, around=6)
METAL = {"inner_sleeve": 2.7e-9, "outer_sleeve": 2.7e-9}


@pytest.mark.parametrize(
    ("mode", "q", "shape"),
    [
        ("axial", 3.0, coarse()),
        ("axial", 0.0, coarse(**SLEEVES)),
        ("torsional", 0.3, coarse()),
        ("radial", 2.0, coarse()),
        ("radial", 1.0, coarse(**SLEEVES)),
        ("conical", 0.1, coarse()),
    ],
)
def test_reduction_against_full_system(mode: str, q: float, shape: Shape) -> None:
    """Every frequency by the complex system itself; the bound is above the error, and keeps what was asked."""
    frequencies = np.array([1.0, 59.0, 249.0, 500.0, 1000.0])
    model = prepare(shape, modes()[mode], neo_hookean(200.0), COARSE)
    metal = {name: METAL[name] for name in model.mesh.sleeves}
    found, pencil = vibrating(model, q, frequencies, tolerance=1e-4, metal=metal)
    exact = full(model, pencil, frequencies)
    reduced_ones = np.array(found.reduced.stiffness(sweep(frequencies, BRANCHES)))[:, :, 0, 0]
    errors = np.abs(reduced_ones / exact - 1).max(axis=0)
    bound = found.reduced.errors(sweep(frequencies, BRANCHES))
    assert bound.max() < 1e-4
    # Elimination with metal beside rubber is exact to 1e-9.
    assert np.all(errors <= bound + 1e-9)


def full(model: FiniteElementModel, pencil: Pencil, frequencies: np.ndarray) -> np.ndarray:
    """Force on the driven sleeve and on the held one, (2, f), by dense elimination of all free unknowns."""
    n, motion = pencil.motions.shape[1], model.motion
    K, N, M, metal = (part * model.multiplicity for part in vars(pencil.act(np.eye(n))).values())
    fixed = motion.constrained.dofs
    held = np.zeros(n)
    outer = fixed[motion.constrained.boundary == "outer"]
    held[outer] = pencil.rigid[0, outer]
    free = np.setdiff1d(np.arange(n), fixed)
    found = []
    for at, s in zip(frequencies, sweep(frequencies, BRANCHES).s, strict=True):
        P = K + s * N - (2 * np.pi * at) ** 2 * (DENSITY * M + metal)
        x = pencil.motions[0].astype(complex)
        x[free] = -np.linalg.solve(P[np.ix_(free, free)], P[np.ix_(free, fixed)] @ x[fixed])
        force = P @ x
        found.append([pencil.static[0, 0] + pencil.motions[0] @ force, -held @ force])
    return np.array(found).T


@pytest.mark.parametrize("stretch", [0.7, 1.5, 2.5])
def test_uniaxial_about_a_stretch(stretch: float) -> None:
    """An incompressible bar: dP/dlambda of neo-Hookean rubber is mu (1 + 2/lambda^3), a branch adds s 3 mu/lambda^2."""
    model = prepare(shapes()["coupon"].model_validate({}), modes()["uniaxial"], neo_hookean())
    found, _ = vibrating(model, stretch - 1.0)
    s = complex_modulus(FREQUENCIES) / MU - 1
    exact = MU * (1 + 2 / stretch**3) + 3 * MU * s / stretch**2
    agree(found.stiffness(FREQUENCIES, BRANCHES), exact, 0.01, 0.01)


PERIODS, POINTS = 3, 40


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "preloads"), [("axial", (0.0, 4.0)), ("radial", (0.0, 2.5))])
def test_march_in_time(mode: str, preloads: tuple[float, float]) -> None:
    """The branch itself, marched along sines of 0.01 mm about a preload at which it has relaxed."""
    frequencies, amplitude, branch = np.array([2.0, 5.0, 10.0, 16.0, 30.0]), 0.01, (0.3, 0.01)
    for preload in preloads:
        elastic = prepare(coarse(), modes()[mode], neo_hookean(), COARSE)
        expected, _ = vibrating(elastic, preload, frequencies, (branch,), density=0.0)
        memory = Installed(
            "viscoelasticity",
            Feature(branches=lambda values: [Attached(BRANCH, values)]),
            {"g": branch[0], "tau": branch[1]},
        )
        model = prepare(coarse(), modes()[mode], neo_hookean(), COARSE, features=[memory])
        time, q = [0.0, 0.1, 1.0, 10.0], [preload] * 4
        periods = []
        for frequency in frequencies:
            periods.append(len(time) + (PERIODS - 1) * POINTS + np.arange(POINTS))
            phase = np.arange(1, PERIODS * POINTS + 1) / POINTS
            time += list(time[-1] + phase / frequency)
            q += list(preload + amplitude * np.sin(2 * np.pi * phase))
            time.append(time[-1] + 1.0)
            q.append(preload)
        force = march(model, Program(np.array(q), np.array(time))).force
        phase = np.exp(-2j * np.pi * np.arange(1, POINTS + 1) / POINTS)
        # sin(x) is the real part of -i exp(i x).
        found = np.array([2j / POINTS * np.sum(force[period] * phase) / amplitude for period in periods])
        agree(expected.stiffness(frequencies, (branch,)), found, 0.5, 0.2)


def test_pose() -> None:
    """At rest both sleeves feel the static matrix, which is symmetric; with waves in the rubber they differ."""
    pose = np.array([1.5, 0.5, 2.0, 0.05, -0.1, 0.15])
    six = SixPath(np.array([0.0, 1.0]), np.array([np.zeros(6), pose]), whole=True)
    model = prepare(coarse(), mode_of("path", six), neo_hookean(200.0), COARSE)
    found, _ = vibrating(model, 1.0, steps=2)
    across = replace(found, transfer=True)
    steps = Program(np.array([0.5, 1.0]))
    static = matrices_along(model, steps, (1.0,))[1.0]
    size = np.abs(static).max()
    for one in (found, across):
        assert_allclose(one.matrix(np.array([1e-3]), ())[0], static, atol=1e-6 * size)
    driving, transfer = (one.matrix(FREQUENCIES, BRANCHES) for one in (found, across))
    assert_allclose(driving, driving.transpose(0, 2, 1), atol=1e-9 * size)
    assert np.abs(transfer[-1] / driving[-1] - 1).max() > 0.01
