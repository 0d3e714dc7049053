"""Conical (cardanic): the inner sleeve tilts about y through the bushing's centre; q in rad, Q in N mm."""

import numpy as np

from cases import annulus
from cases.mode import Array, Mode, Setting


def motion(x: Array, q: float) -> Array:
    """Rotation by q about y, exact for finite angles.

    Parameters
    ----------
    x : Array
        Coordinates, shape (d, n), mm.
    q : float
        Angle of the sleeve, rad.
    """
    c, s = np.cos(q) - 1.0, np.sin(q)
    return np.stack([c * x[0] + s * x[2], np.zeros(x.shape[1]), -s * x[0] + c * x[2]])


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
    return np.stack([-s * x[0] + c * x[2], np.zeros(x.shape[1]), -c * x[0] - s * x[2]])


MODE = Mode(
    name="conical",
    summary="inner sleeve tilts about an axis normal to its own",
    specimen="bushing",
    rotational=True,
    solid=Setting("cartesian", motion, rate, mirrors=frozenset({"y"})),
    unit_stiffness=annulus.conical,
    reversed_by="x",
    words=("conical", "cardanic", "cardan", "kardan", "kard", "konisch", "coni"),
    directions=("TX", "TY"),
)
