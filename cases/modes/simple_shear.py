"""Simple shear of a coupon, as between the plates of a quad-lap or double-shear specimen: u = q y e_x.

q is the amount of shear, the travel over the thickness that is sheared; Q is the shear stress in MPa, the force over
the area that carries it. All faces normal to x and y follow the motion, and those normal to z are free of stress. The
principal stretches are those of a planar test with lambda - 1/lambda = q.

References
----------
ISO 1827:2022, Rubber, vulcanized or thermoplastic - Determination of shear modulus and adhesion to rigid plates -
Quadruple-shear methods.
"""

import numpy as np

from cases.mode import Array, Mode, Setting


def motion(x: Array, q: float) -> Array:
    """Shear by q along x in planes normal to y.

    Parameters
    ----------
    x : Array
        Coordinates, shape (3, n), of the unit coupon.
    q : float
        Amount of shear, dimensionless.
    """
    u = np.zeros((3, x.shape[1]))
    u[0] = q * x[1]
    return u


def rate(x: Array, q: float) -> Array:
    """Derivative of `motion` with respect to q.

    Parameters
    ----------
    x : Array
        Coordinates, shape (3, n), of the unit coupon.
    q : float
        Amount of shear, dimensionless.
    """
    return motion(x, 1.0)


MODE = Mode(
    name="simple_shear",
    summary="parallel planes slide over each other (quad-lap, double shear)",
    specimen="coupon",
    rotational=False,
    solid=Setting("cartesian", motion, rate),
    driven={f"{side}_{axis}": (0, 1) for side in ("mirror", "face") for axis in "xy"},
    held={"mirror_z": (2,)},
    sheared=True,
    unit_slope=1.0,
    words=(
        *(
            "simpleshear",
            "simple",
            "quad",
            "quadlap",
            "quadshear",
            "lap",
            "doublelap",
            "doubleshear",
            "dualshear",
        ),
        *("sandwich", "doppelschub", "doppelscher", "vierfach", "einfachscher", "einfache"),
        *("shear", "schub", "scher"),
    ),
)
