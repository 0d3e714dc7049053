"""Rigid motions of the inner sleeve with all six degrees of freedom, and the path that they follow.

A pose is (ux, uy, uz, rx, ry, rz): the displacement of the sleeve's centre (mm), which rests at the origin, and the
rotation vector (rad), whose direction is the axis of the rotation and whose length is the angle. A rotation about one
axis alone is that of the torsional and conical modes. Reactions (fx, fy, fz, mx, my, mz) are what holds the sleeve: the
force, and the moment about the centre where it is now, in axes that do not turn (N, N mm).

The reactions f do the work f . w on a twist w. The rate of the rotation vector is not that twist: w = T(theta)
d(theta)/dt.

References
----------
Cardona and Geradin (1988), Int. J. Numer. Methods Eng. 26:2403-2438, doi:10.1002/nme.1620261105, section 2: rotation
vector and its tangent T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")
REACTIONS = ("fx", "fy", "fz", "mx", "my", "mz")
# Mode whose displacement and force are of the kind of each motion and its reaction; it also determines their units.
PAIR_MODES = ("radial", "radial", "axial", "conical", "conical", "torsional")
# Motions that a plane of symmetry rules out: x is the plane x = 0.
RULED_OUT = {"x": (0, 4, 5), "y": (1, 3, 5), "z": (2, 3, 4)}


def skew(a: Array) -> Array:
    """The matrix of a cross product: ``skew(a) @ b`` is a x b, shape (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation(theta: Array) -> Array:
    """Rotation matrix of a rotation vector (rad), shape (3, 3), by Rodrigues' formula."""
    angle, W = float(np.linalg.norm(theta)), skew(theta)
    # sinc(x) = sin(pi x) / (pi x)
    linear = np.sinc(angle / np.pi)
    quadratic = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.eye(3) + linear * W + quadratic * W @ W


def tangent(theta: Array) -> Array:
    """T, shape (3, 3): a change of the rotation vector (rad) turns the body by T d(theta), in axes that do not turn."""
    angle, W = float(np.linalg.norm(theta)), skew(theta)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    small = angle < 1e-3
    third = 1.0 / 6.0 - angle**2 / 120.0 if small else float(1.0 - np.sinc(angle / np.pi)) / angle**2
    return np.eye(3) + second * W + third * W @ W


def displacement(x: Array, pose: Array) -> Array:
    """Displacement of points of the sleeve.

    Parameters
    ----------
    x
        Points, shape (3, n), mm.
    pose
        Shape (6,), mm and rad.
    """
    displacements: Array = pose[:3, None] + (rotation(pose[3:]) - np.eye(3)) @ x
    return displacements


def twists(x: Array, pose: Array) -> Array:
    """Displacements of points of the sleeve per unit of each further motion: along, and about, axes that do not turn.

    Parameters
    ----------
    x
        Points at rest, shape (3, n), mm.
    pose
        Where the sleeve is, shape (6,), mm and rad.

    Returns
    -------
    ndarray, shape (6, 3, n)
    """
    motions = np.zeros((6, *x.shape))
    arm = rotation(pose[3:]) @ x
    for k in range(3):
        motions[k, k] = 1.0
        motions[3 + k] = skew(np.eye(3)[k]) @ arm
    return motions


def twist_of(pose: Array) -> Array:
    """Twist per unit of each number of the pose: the identity, and T of the rotation; shape (6, 6)."""
    total = np.eye(6)
    total[3:, 3:] = tangent(pose[3:])
    return total


@dataclass(frozen=True, eq=False)
class SixPath:
    """Six motions along a path, on straight lines between its knots.

    Attributes
    ----------
    time : shape (k,)
        Times of the knots, increasing from rest on: the path's parameter q, s.
    motion : shape (k, 6)
        Poses at the knots, mm and rad; the first is rest, zero. Columns of free motions are ignored.
    free : tuple of int
        Motions that are not prescribed: they follow from equilibrium with the load.
    whole : bool
        Whether all six motions are possible: no plane of symmetry is used.
    load : shape (k, 6), optional
        Reactions at the knots, N and N mm, in axes that do not turn; those of free motions are prescribed, the others
        ignored. None = no load.
    """

    time: Array
    motion: Array
    free: tuple[int, ...] = ()
    whole: bool = False
    load: Array | None = None

    def __post_init__(self) -> None:
        if self.motion.shape != (len(self.time), 6) or len(self.time) < 2:
            raise ValueError("a path needs a time for each of at least two poses")
        if np.any(np.diff(self.time) <= 0.0) or self.motion[0].any():
            raise ValueError("a path needs times that increase, and begins at rest")
        free, prescribed = list(self.free), self.motion.copy()
        prescribed[:, free] = 0.0
        load = np.zeros_like(prescribed)
        if self.load is not None:
            load[:, free] = self.load[:, free]
        if load[0].any():
            raise ValueError("a path begins without load")
        object.__setattr__(self, "motion", prescribed)
        object.__setattr__(self, "load", load)

    @property
    def loaded(self) -> tuple[int, ...]:
        """Free motions that follow from a load other than zero."""
        return tuple(k for k in self.free if self.loads[:, k].any())

    @property
    def loads(self) -> Array:
        """The load at the knots, (k, 6), zero where there is none."""
        return np.zeros_like(self.motion) if self.load is None else self.load

    @property
    def whole_body(self) -> SixPath:
        """The same path where no plane of symmetry is used, so that all six motions are possible."""
        return replace(self, whole=True)

    def _segment(self, q: float, ahead: bool) -> int:
        knots = self.time <= q if ahead else self.time < q
        return int(np.clip(np.count_nonzero(knots) - 1, 0, len(self.time) - 2))

    def pose(self, q: float) -> Array:
        """Prescribed pose, shape (6,), at the path's parameter (s); zero in the free motions."""
        i = self._segment(q, False)
        return np.asarray(self.motion[i] + (q - self.time[i]) * self.rate(q))

    def rate(self, q: float, ahead: bool = False) -> Array:
        """Derivative of `pose` by q, shape (6,): on the way to q, or of what lies ahead.

        Parameters
        ----------
        q
            s.
        ahead
            At a knot: take the derivative along the line after it.
        """
        return self._rate(self.motion, q, ahead)

    def _rate(self, knots: Array, q: float, ahead: bool) -> Array:
        i = self._segment(q, ahead)
        return np.asarray((knots[i + 1] - knots[i]) / (self.time[i + 1] - self.time[i]))

    def load_at(self, q: float) -> Array:
        """Prescribed reactions, shape (6,), N and N mm, at the path's parameter (s); zero in prescribed motions."""
        i = self._segment(q, False)
        return np.asarray(self.loads[i] + (q - self.time[i]) * self.load_rate(q))

    def load_rate(self, q: float, ahead: bool = False) -> Array:
        """Derivative of `load_at` by q, shape (6,).

        Parameters
        ----------
        q, ahead
            As for `rate`; q in s.
        """
        return self._rate(self.loads, q, ahead)

    @property
    def moving(self) -> tuple[int, ...]:
        """Motions that are prescribed other than zero somewhere, or free."""
        return tuple(k for k in range(6) if k in self.free or self.motion[:, k].any())

    @property
    def mirrors(self) -> frozenset[str]:
        """Planes of symmetry that the path does not break."""
        if self.whole:
            return frozenset()
        return frozenset(
            plane for plane, ruled_out in RULED_OUT.items() if not set(ruled_out) & set(self.moving)
        )


def possible(mirrors: frozenset[str]) -> Sequence[int]:
    """Motions that planes of symmetry allow."""
    ruled_out = {k for plane in mirrors for k in RULED_OUT[plane]}
    return [k for k in range(6) if k not in ruled_out]
