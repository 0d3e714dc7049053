"""Radial: the inner sleeve moves normal to the axis, along x; q in mm, Q in N."""

import numpy as np

from cases import annulus
from cases.mode import Array, Mode, Setting


def motion(x: Array, q: float) -> Array:
    """Translation by q along x.

    Parameters
    ----------
    x : Array
        Coordinates, shape (3, n), mm.
    q : float
        Displacement of the sleeve, mm.
    """
    u = np.zeros((3, x.shape[1]))
    u[0] = q
    return u


def rate(x: Array, q: float) -> Array:
    """Derivative of `motion` with respect to q.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Displacement of the sleeve, mm.
    """
    return motion(x, 1.0)


MODE = Mode(
    name="radial",
    summary="inner sleeve moves normal to the axis",
    specimen="bushing",
    rotational=False,
    solid=Setting("cartesian", motion, rate, mirrors=frozenset({"y", "z"})),
    unit_stiffness=annulus.radial,
    reversed_by="x",
    words=("radial", "rad", "quer", "lateral"),
    directions=("FX", "FY"),
    proposed_travel=0.3,
)
