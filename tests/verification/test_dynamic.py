"""Dynamic stiffness against closed forms, against the full system at each frequency, and against the march in time.

Closed forms of a long bonded annulus a < b that is sheared along or about its axis with G* = mu (1 + s), per length: axial
2 pi G* / ln(b/a), torsional 4 pi G* / (1/a^2 - 1/b^2). With inertia, axially, k^2 = rho omega^2 / G* and u(r) = [J0(kr)
Y0(kb) - Y0(kr) J0(kb)] / [J0(ka) Y0(kb) - Y0(ka) J0(kb)] (shear waves in cylindrical coordinates). The free ends do not
shear as in a long annulus: the difference of two lengths is without them.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv, yv

from cases.dynamic.model import DynamicModel, sweep
from cases.dynamic.pencil import Pencil
from cases.dynamic.reduction import reduced
from cases.equilibrium import Equilibrium
from cases.march import march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Shape, shapes

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
                (DynamicModel(reduced(pencil, sweep(frequencies, branches), density, tolerance)), pencil)
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
    """Stiffness of a mm of a long annulus, on default meshes: (f, 2, 2)."""
    found = []
    for length in (LENGTH, 2 * LENGTH):
        model = prepare(annulus(length), modes()[mode], neo_hookean())
        reduced, _ = vibrating(model, 0.0, frequencies, density=density)
        found.append(reduced.reduced.stiffness(sweep(frequencies, BRANCHES)))
    return (found[1] - found[0]) / LENGTH


@pytest.mark.parametrize(
    ("mode", "factor"),
    [("axial", 2 * np.pi / np.log(B / A)), ("torsional", 4 * np.pi / (A**-2 - B**-2))],
)
def test_stiffness_without_inertia(mode: str, factor: float) -> None:
    found = per_length(mode, FREQUENCIES, 0.0)
    exact = factor * complex_modulus(FREQUENCIES)
    agree(found[:, 0, 0], exact, 0.3, 0.1)
    agree(-found[:, 1, 0], exact, 0.3, 0.1)


def test_axial_waves() -> None:
    # The highest frequency lies above the first resonance of the clamped annulus, 1.5 kHz.
    frequencies = np.array([10.0, 100.0, 500.0, 1000.0, 2000.0])
    found = per_length("axial", frequencies, DENSITY)
    G = complex_modulus(frequencies)
    k = 2 * np.pi * frequencies * np.sqrt(DENSITY / G)

    def slope(r: float) -> np.ndarray:
        numerator = jv(1, k * r) * yv(0, k * B) - yv(1, k * r) * jv(0, k * B)
        return -k * numerator / (jv(0, k * A) * yv(0, k * B) - yv(0, k * A) * jv(0, k * B))

    agree(found[:, 0, 0], -2 * np.pi * A * G * slope(A), 0.3, 0.1)
    agree(-found[:, 1, 0], -2 * np.pi * B * G * slope(B), 0.3, 0.1)
