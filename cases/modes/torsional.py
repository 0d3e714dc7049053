"""Torsional: the inner sleeve turns about the axis; q in rad, Q in N mm. Exact for finite angles."""

import numpy as np

from cases import annulus
from cases.mode import Array, Mode, Setting


def motion(x: Array, q: float) -> Array:
    """Rotation by q about z.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Angle of the sleeve, rad.
    """
    c, s = np.cos(q) - 1.0, np.sin(q)
    return np.stack([c * x[0] - s * x[1], s * x[0] + c * x[1], np.zeros(x.shape[1])])


def rate(x: Array, q: float) -> Array:
    """Derivative of `motion` with respect to q.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Angle of the sleeve, rad.
    """
    c, s = np.cos(q), np.sin(q)
    return np.stack([-s * x[0] - c * x[1], c * x[0] - s * x[1], np.zeros(x.shape[1])])


def twist(x: Array, q: float) -> Array:
    """The same rotation where the angle itself is the unknown.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Angle of the sleeve, rad.
    """
    u = np.zeros((3, x.shape[1]))
    u[1] = q
    return u


def twist_rate(x: Array, q: float) -> Array:
    """Derivative of `twist` with respect to q.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Angle of the sleeve, rad.
    """
    return twist(x, 1.0)


MODE = Mode(
    name="torsional",
    summary="inner sleeve turns about the axis",
    specimen="bushing",
    rotational=True,
    section=Setting("axisymmetric_twist", twist, twist_rate, mirrors=frozenset({"z"})),
    solid=Setting("cartesian", motion, rate, mirrors=frozenset({"z"})),
    unit_stiffness=annulus.torsional,
    reversed_by="y",
    words=("torsional", "torsion", "tors", "tor", "verdreh", "drehung"),
    is_usual=True,
    proposed_travel=0.2,
    directions=("TZ",),
)
