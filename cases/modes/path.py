"""Path: any of the six motions of the inner sleeve together, prescribed, or moved by a force; q is the path's time.

The mode listed by name moves along a line in all six motions at once; `follow` returns the mode of any other path. Q is
the power, N mm/s; the reactions are in the history.
"""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from cases.mode import Array, Mode, Setting
from cases.six import SixPath, displacement, twist_of, twists
from geometry.shape import Mirrors

# mm/s and rad/s: all six motions, no two alike.
LINE = SixPath(np.array([0.0, 1.0]), np.array([np.zeros(6), [0.4, -0.2, 0.5, 0.01, -0.015, 0.03]]))


def setting(six: SixPath) -> Setting:
    """The setting of a path; where motions are free, `motion` gives only the prescribed ones."""

    def motion(x: Array, q: float) -> Array:
        return displacement(x, six.pose(q))

    def rate(x: Array, q: float) -> Array:
        pose = six.pose(q)
        return np.asarray(np.einsum("k,kcn->cn", twist_of(pose) @ six.rate(q), twists(x, pose)))

    return Setting("cartesian", motion, rate, mirrors=cast(Mirrors, six.mirrors), six=six)


def follow(six: SixPath) -> Mode:
    """The mode of a path."""
    return replace(MODE, solid=setting(six))


MODE = Mode(
    name="path",
    summary="six motions of the inner sleeve, each prescribed in time, moved by a prescribed force, or free of force",
    specimen="bushing",
    rotational=False,
    solid=setting(LINE),
    follow=follow,
)
