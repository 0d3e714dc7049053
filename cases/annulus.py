"""Bounds of the stiffness of a bonded annulus with a shear modulus of 1 MPa, from closed forms.

Inner radius a, outer radius b, length L (mm); incompressible, small displacement.

References
----------
Adkins, Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303.
"""

from __future__ import annotations

import math

Bounds = tuple[float, float]

# The axial formula neglects the free ends, which reduce the stiffness of a short bushing by up to a fifth.
_FREE_ENDS = 0.8


def axial(a: float, b: float, length: float) -> Bounds:
    """Return bounds of the axial stiffness, the upper one 2 pi L / ln(b/a), N/mm per MPa.

    Parameters
    ----------
    a, b, length : float
        Inner radius, outer radius and length of the rubber, mm.
    """
    most = 2.0 * math.pi * length / math.log(b / a)
    return _FREE_ENDS * most, most


def radial(a: float, b: float, length: float) -> Bounds:
    """Return the stiffness of the short bush, whose rubber escapes through its free ends, and of the long one.

    80 pi s L / (25 s ln(b/a) - 9 d) and 4 pi s L / (s ln(b/a) - d), with s = a^2 + b^2, d = b^2 - a^2, N/mm per MPa.

    Parameters
    ----------
    a, b, length : float
        Inner radius, outer radius and length of the rubber, mm.
    """
    log, s, d = math.log(b / a), a**2 + b**2, b**2 - a**2
    short = 80.0 * math.pi * s / (25.0 * s * log - 9.0 * d) * length
    return short, 4.0 * math.pi * s / (s * log - d) * length


def torsional(a: float, b: float, length: float) -> Bounds:
    """Return 4 pi L / (1/a^2 - 1/b^2), N mm/rad per MPa, as both bounds.

    Parameters
    ----------
    a, b, length : float
        Inner radius, outer radius and length of the rubber, mm.
    """
    exact = 4.0 * math.pi * length / (a**-2 - b**-2)
    return exact, exact


def conical(a: float, b: float, length: float) -> Bounds:
    """Return bounds of the tilting stiffness, N mm/rad per MPa.

    Each slice moves radially by its height times the angle, which contributes L^2/12 times the radial stiffness, and
    axially by its radius times the angle, which contributes between a^2/2 and b^2/2 times the axial stiffness.

    Parameters
    ----------
    a, b, length : float
        Inner radius, outer radius and length of the rubber, mm.
    """
    axially, radially, share = axial(a, b, length), radial(a, b, length), length**2 / 12.0
    return axially[0] * a**2 / 2.0 + radially[0] * share, axially[1] * b**2 / 2.0 + radially[1] * share
