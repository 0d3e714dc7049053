"""Bounds of the stiffness of a bushing or a coupon with a shear modulus of 1 MPa, from closed forms.

Bonded annulus a < b, length L, incompressible, small displacement, shear modulus mu:

- axial 2 pi mu L / ln(b/a), torsional 4 pi mu L / (1/a^2 - 1/b^2);
- radial between the short bush, whose rubber escapes through its free ends, 80 pi s mu L / (25 s ln(b/a) - 9 d),
  and the long one, whose rubber cannot, 4 pi s mu L / (s ln(b/a) - d), with s = a^2 + b^2, d = b^2 - a^2;
- conical: each slice moves radially by its height times the angle, which makes L^2/12 of the radial stiffness, and
  axially by its radius times the angle, which makes between a^2/2 and b^2/2 of the axial one.

References
----------
Adkins, Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303.
"""

from __future__ import annotations

import math

import numpy as np

from cases.mode import modes
from geometry.ring import Ring
from geometry.shape import Shape

# Free ends, which the axial formula leaves out, take up to a fifth of a short bushing's stiffness.
_FREE_ENDS = 0.8
# Voids may take most of the rubber out of the way of the load.
_VOIDED = 0.2
# Slope at rest of the nominal stress of an incompressible coupon, over the shear modulus.
_COUPON = {"uniaxial": 3.0, "equibiaxial": 6.0, "planar": 4.0}


def unit_stiffness(shape: Shape, mode: str) -> tuple[float, float] | None:
    """Return bounds of the stiffness over the shear modulus.

    Parameters
    ----------
    shape : Shape
        Shape of the bushing; it is not used for the modes of a coupon.
    mode : str

    Returns
    -------
    (float, float) or None
        mm (axial, radial), mm^3 per rad (torsional, conical) or 1 (coupon); None where no formula applies.
    """
    if modes()[mode].specimen == "coupon":
        factor = _COUPON.get(mode)
        return None if factor is None else (factor, factor)
    if not isinstance(shape, Ring):
        return None
    lengths = 2.0 * shape.half_length(np.linspace(0.0, 1.0, 21, dtype=np.float64))
    low = _annulus(shape.inner_radius, shape.outer_radius, float(lengths.min()), mode)
    high = _annulus(shape.inner_radius, shape.outer_radius, float(lengths.max()), mode)
    if low is None or high is None:
        return None
    return low[0] * (_VOIDED if shape.voids() else 1.0), high[1]


def _annulus(a: float, b: float, length: float, mode: str) -> tuple[float, float] | None:
    log, s, d = math.log(b / a), a**2 + b**2, b**2 - a**2
    axial = 2.0 * math.pi * length / log
    short = 80.0 * math.pi * s / (25.0 * s * log - 9.0 * d) * length
    long = 4.0 * math.pi * s / (s * log - d) * length
    if mode == "axial":
        return _FREE_ENDS * axial, axial
    if mode == "radial":
        return short, long
    if mode == "torsional":
        return (4.0 * math.pi * length / (a**-2 - b**-2),) * 2
    if mode == "conical":
        share = length**2 / 12.0
        return _FREE_ENDS * axial * a**2 / 2.0 + short * share, axial * b**2 / 2.0 + long * share
    return None
