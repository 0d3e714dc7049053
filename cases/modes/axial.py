"""Axial: the inner sleeve moves along the axis; q in mm, Q in N."""

import numpy as np

from cases.mode import Array, Mode, Setting


def _along_last(components: int):
    def motion(x: Array, q: float) -> Array:
        u = np.zeros((components, x.shape[1]))
        u[-1] = q
        return u

    def rate(x: Array, q: float) -> Array:
        return motion(x, 1.0)

    return motion, rate


MODE = Mode(
    name="axial",
    summary="inner sleeve along the axis",
    specimen="bushing",
    rotational=False,
    section=Setting("axisymmetric", *_along_last(2)),
    solid=Setting("cartesian", *_along_last(3), mirrors=frozenset({"x", "y"})),
)
