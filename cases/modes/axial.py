"""Axial: the inner sleeve moves along the axis; q in mm, Q in N."""

import numpy as np

from cases import annulus
from cases.mode import Array, Mode, Setting


def motion(x: Array, q: float) -> Array:
    """Translation by q along the axis, the last coordinate of the half-plane and of space.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Displacement of the sleeve, mm.
    """
    u = np.zeros_like(x)
    u[-1] = q
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
    name="axial",
    summary="inner sleeve moves along the axis",
    specimen="bushing",
    rotational=False,
    section=Setting("axisymmetric", motion, rate),
    solid=Setting("cartesian", motion, rate, mirrors=frozenset({"x", "y"})),
    unit_stiffness=annulus.axial,
    reversed_by="z",
    words=("axial", "ax", "längs", "laengs", "longitudinal"),
    is_usual=True,
    directions=("FZ",),
    proposed_travel=0.6,
)
