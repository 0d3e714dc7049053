"""Stiffnesses of a bonded annulus on paper, with the end conditions under which each solution is exact.

Annulus a < b, length L, shear modulus mu, incompressible, bonded inside and outside:
axial        Q = 2 pi mu L q / ln(b/a)
torsional    T = 4 pi mu L phi / (1/a^2 - 1/b^2)
radial, long Q = 4 pi mu L q (a^2 + b^2) / [(a^2 + b^2) ln(b/a) - (b^2 - a^2)]
radial, short  Q = 80 pi mu L q (a^2 + b^2) / [25 (a^2 + b^2) ln(b/a) - 9 (b^2 - a^2)]

References
----------
Adkins and Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303. Rivlin (1949), Large elastic deformations of isotropic materials VI, Phil. Trans. R.
Soc. A 242:173-195, doi:10.1098/rsta.1949.0009.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import DEFAULT, Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, shapes

# The numerical example for Adkins and Gent's formulas: 10/20 mm, 40 mm long, 0.8 MPa.
A, B, L, MU = 10.0, 20.0, 40.0, 0.8
RUBBERS = {"neo_hookean": {"C10": 0.4}, "mooney_rivlin": {"C10": 0.3, "C01": 0.1}}
# Where sleeves and ends prescribe the normal displacement everywhere, exact incompressibility leaves the mean pressure
# undetermined; with this bulk modulus (MPa) the volume changes by 1e-8.
CONFINED = 1e8


def annulus(length=L):
    return shapes()["plain"](inner_radius=A, outer_radius=B, length=length)


def with_ends(name, components):
    """Return a mode whose free ends are held in some displacement components."""
    mode = modes()[name]
    return replace(mode, held=dict(mode.held) | {"end_top": components, "end_bottom": components})


def stiffness(mode, rubber, q, refinement=DEFAULT, length=L):
    return (
        march(
            prepare(annulus(length), mode, rubber, refinement), Program(np.array([q])), tolerance=1e-10
        ).force[0]
        / q
    )


def axial():
    return 2 * np.pi * MU * L / np.log(B / A)


def torsional():
    return 4 * np.pi * MU * L / (A**-2 - B**-2)


def radial(length=L):
    """Short and long bush."""
    s, d, log = A**2 + B**2, B**2 - A**2, np.log(B / A)
    return 80 * np.pi * s / (25 * s * log - 9 * d) * MU * length, 4 * np.pi * s / (s * log - d) * MU * length


def test_the_formulas_give_the_published_numbers():
    # N/mm; N m per degree; N/mm.
    assert axial() == pytest.approx(290, abs=0.5)
    assert np.radians(torsional()) / 1000 == pytest.approx(0.94, abs=0.005)
    assert radial() == (pytest.approx(674, abs=0.5), pytest.approx(4317, abs=0.5))


@pytest.mark.parametrize("name", RUBBERS)
@pytest.mark.parametrize("degrees", [1.0, 20.0, 40.0])
def test_torsion_is_exact_at_finite_twist(name, degrees):
    """With ends held plane, the twist is the whole deformation (Rivlin 1949)."""
    found = stiffness(
        with_ends("torsional", (2,)), Rubber(law(name), RUBBERS[name], CONFINED), np.radians(degrees)
    )
    # 6e-5 with the default mesh; that this vanishes under refinement is in test_convergence.py.
    assert found == pytest.approx(torsional(), rel=1e-4)


@pytest.mark.parametrize("name", RUBBERS)
def test_torsion_with_free_ends_hardly_differs(name):
    """Free ends bulge with the square of the twist (Poynting): 0.05 % at 20 degrees, as the other codes found."""
    found = stiffness(modes()["torsional"], Rubber(law(name), RUBBERS[name]), np.radians(20.0))
    assert found == pytest.approx(torsional(), rel=5e-4)


@pytest.mark.parametrize("q", [0.1, 5.0])
def test_axial_simple_shear_is_exact_for_neo_hookean(q):
    """Ends that are held radially but free along the axis satisfy the antiplane solution."""
    rubber = Rubber(law("neo_hookean"), RUBBERS["neo_hookean"])
    assert stiffness(with_ends("axial", (0,)), rubber, q) == pytest.approx(axial(), rel=1e-5)


@pytest.mark.parametrize("name", RUBBERS)
def test_free_ends_matter_less_for_longer_bushings(name):
    """Free ends soften the axial spring by an amount that does not grow with the length."""
    rubber = Rubber(law(name), RUBBERS[name])
    missing = [
        1
        - stiffness(modes()["axial"], rubber, 0.1, Refinement(across=6, along=int(6 * n)), n * L)
        / (n * axial())
        for n in (0.5, 1.0, 2.0, 4.0)
    ]
    assert min(missing) > 0
    assert missing[3] < 0.02
    # In proportion to 1 / length once the two ends no longer interact.
    assert missing[1] / missing[2] == pytest.approx(2.0, rel=0.02)
    assert missing[2] / missing[3] == pytest.approx(2.0, rel=0.02)


def test_radial_of_the_long_bush_is_exact_in_plane_strain():
    rubber = Rubber(law("neo_hookean"), RUBBERS["neo_hookean"], CONFINED)
    # The theory is linear: a finite q adds the square of q / (b - a) = 1e-4.
    found = stiffness(with_ends("radial", (2,)), rubber, 1e-3, Refinement(across=4, along=2, around=16))
    assert found == pytest.approx(radial()[1], rel=1e-3)


def test_radial_lies_between_the_short_and_the_long_bush():
    rubber = Rubber(law("neo_hookean"), RUBBERS["neo_hookean"])
    lengths = np.array([0.1, 0.5, 1.0, 2.0, 4.0]) * L
    found = np.array([stiffness(modes()["radial"], rubber, 1e-3, length=length) for length in lengths])
    short, long = np.array([radial(length) for length in lengths]).T
    assert np.all(short < found)
    assert np.all(found < long)
    share = found / long
    assert np.all(np.diff(share) > 0)
    assert share[-1] > 0.8
    # A piece added in the middle has the long bush's stiffness: the ends have no effect beyond some radii.
    added = (found[-1] - found[-2]) / (lengths[-1] - lengths[-2])
    assert added == pytest.approx(long[0] / lengths[0], rel=0.01)
