"""The type of a mode: which boundaries move, how the generalised displacement q moves them, what stays symmetric.

A mode is data and two small functions, one file each in `cases/modes`. The motion of the driven sleeve is rigid and
exact for finite rotations; its derivative with respect to q makes the generalised force by virtual work
(`cases.reaction`).
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cases.six import MOTIONS, SixPath
from geometry.wall import Wall

Array = NDArray[np.float64]
Motion = Callable[[Array, float], Array]
"""Coordinates (d, n) in mm and q -> displacement (c, n), one row per unknown displacement component."""
Constraints = Mapping[str, tuple[int, ...] | None]
"""Boundary name -> constrained displacement components (None = all)."""


@dataclass(frozen=True)
class Setting:
    """How a mode acts in one kinematic description.

    Attributes
    ----------
    kinematics
        "axisymmetric" (unknowns u_r, u_z), "axisymmetric_twist" (u_r, angle, u_z) or "cartesian" (u_x, u_y, u_z).
    motion, rate
        Displacement of the driven boundaries at q, and its derivative with respect to q.
    mirrors
        Planes of symmetry of the loaded bushing; the model is cut there and the force multiplied.
    six
        The path of all six motions that `motion` follows; it may leave some free. None where q alone moves the sleeve.
    """

    kinematics: Literal["axisymmetric", "axisymmetric_twist", "cartesian"]
    motion: Motion
    rate: Motion
    mirrors: frozenset[Literal["x", "y", "z"]] = frozenset()
    six: SixPath | None = None


@dataclass(frozen=True)
class Mode:
    """A deformation mode.

    Attributes
    ----------
    specimen
        "bushing" or "coupon": the shapes that it can load.
    rotational
        q is an angle (rad inside, degrees in files and reports) and Q a moment (N mm).
    solid
        The setting in three dimensions, for every shape.
    section
        The setting in the half-plane, for shapes of revolution; None where the mode is not axisymmetric.
    driven, held
        Boundary name -> displacement components that follow the motion, or stay at zero (None = all).
    reversed_by
        A plane whose mirror image turns the motion q into -q: where the shape is symmetric about it, the curve is odd.
    sheared
        Whether q of a coupon is an amount of shear and Q a shear stress (MPa), not stretch - 1 and nominal stress.
    follow
        Path of six motions -> its mode; None where q alone moves the sleeve.
    shares
        Number of equal faces that work on q: the force is divided by it (equibiaxial 2, volumetric 3).
    unit_stiffness
        Inner radius, outer radius and length (mm) of a bonded annulus -> bounds of its stiffness at rest over the shear
        modulus; None where no formula is known. It shows whether a recording can have the stiffness of rubber at all.
    unit_slope
        The same of a coupon: slope of the nominal stress at rest over the shear modulus, dimensionless.
    words
        Words, in lower case, by which the name of a file says that it has a recording of this mode. Where several modes
        share a word, only a word that one of them does not share tells which it is.
    is_usual
        Whether a file that does not name its mode is taken as one of this mode, among those of its specimen and of its
        kind of displacement (a length, an angle, a strain).
    directions
        Of the forces (FX to FZ) and moments (TX to TZ) of a bushing about z for which the curve stands in a vehicle
        model; a bushing is taken to be alike in x and y.
    proposed_travel
        Travel of a test that is proposed if the mode has not been recorded: a share of the rubber's thickness, or rad;
        None where none is proposed. Engineering judgement: far enough to show the shape of the curve.
    """

    name: str
    summary: str
    specimen: Literal["bushing", "coupon"]
    rotational: bool
    solid: Setting
    section: Setting | None = None
    driven: Constraints = field(default_factory=lambda: {"inner": None})
    held: Constraints = field(default_factory=lambda: {"outer": None})
    shares: int = 1
    reversed_by: Literal["x", "y", "z"] | None = None
    needs_compressibility: bool = False
    sheared: bool = False
    follow: Callable[[SixPath], Mode] | None = None
    unit_stiffness: Callable[[float, float, float], tuple[float, float]] | None = None
    unit_slope: float | None = None
    words: tuple[str, ...] = ()
    is_usual: bool = False
    directions: tuple[str, ...] = ()
    proposed_travel: float | None = None

    def stretch(self, q: Array) -> Array:
        """Return the stretch of a coupon at q, shape (n,): along the load, or the largest principal one in shear."""
        return np.hypot(1.0, 0.5 * q) + 0.5 * np.abs(q) if self.sheared else 1.0 + q

    @property
    def sideways(self) -> float:
        """How far a unit of q moves the inner sleeve towards the outer one, mm; 0 where q is an angle or a strain."""
        if self.rotational or self.specimen != "bushing":
            return 0.0
        return float(np.linalg.norm(self.solid.rate(np.zeros((3, 1)), 0.0)[:2]))

    def moves_across(self, q: float, lever: float) -> float:
        """Return how far q moves the inner sleeve towards the outer one, mm: of its axis the point that goes furthest.

        Parameters
        ----------
        q : float
            Largest displacement, mm or rad.
        lever : float
            From the centre to the ends of the part of the sleeve that is looked at, mm.
        """
        if not self.rotational:
            return self.sideways * abs(q)
        ends = np.array([[0.0, 0.0], [0.0, 0.0], [-lever, lever]])
        # Beyond a right angle it comes back.
        return float(np.linalg.norm(self.solid.motion(ends, min(abs(q), 0.5 * np.pi))[:2], axis=0).max())

    def per_shear(self, wall: Wall) -> float:
        """Return the displacement of the inner sleeve that shears the rubber at it by about 1, mm or rad.

        Of an angle the surface moves by its lever: about the axis that is the radius, about a line across it the
        distance of the ends, or the radius where that is longer.

        Parameters
        ----------
        wall : Wall
        """
        if not self.rotational:
            return wall.thickness
        tilts = not self.motions <= {"rz"}
        return wall.thickness / (max(wall.facing, wall.inner_radius) if tilts else wall.inner_radius)

    @property
    def motions(self) -> frozenset[str]:
        """Motions of the inner sleeve (`cases.six.MOTIONS`) that q drives; empty for a mode of coupons, and a path."""
        if self.specimen != "bushing" or self.solid.six is not None:
            return frozenset()
        corners = self.solid.rate(np.column_stack([np.zeros(3), np.eye(3)]), 0.0)
        turning = corners[:, 1:] - corners[:, :1]
        twist = [*corners[:, 0], turning[2, 1], turning[0, 2], turning[1, 0]]
        return frozenset(name for name, share in zip(MOTIONS, twist, strict=True) if share)

    def is_symmetric_end_to_end(self, planes: frozenset[Literal["x", "y", "z"]]) -> bool:
        """Whether the motion is symmetric about z = 0, alone or combined with a reflection in another of these planes.

        Where it is, something at the upper end of a body with these planes of symmetry gives the same curve as at the
        lower end.
        """
        if "z" not in planes:
            return False
        # The motion is affine in the coordinates: four points determine it.
        x = np.column_stack([np.zeros(3), np.eye(3)])
        q = 0.3
        motion = self.solid.motion(x, q)
        for plane in (None, *sorted(planes - {"z"})):
            sign = np.ones((3, 1))
            sign[[2] if plane is None else [2, "xyz".index(plane)]] = -1.0
            if np.allclose(sign * self.solid.motion(sign * x, q), motion, atol=1e-12):
                return True
        return False


def mode_of(name: str, six: SixPath | None) -> Mode:
    """Return a mode by name or, of a path of six motions, the mode along that path.

    Parameters
    ----------
    name : str
        Name of the mode.
    six : SixPath or None
        The path.
    """
    follow = modes()["path"].follow
    return modes()[name] if six is None or follow is None else follow(six)


def setting_for(mode: Mode, dimension: int) -> Setting:
    """Return the mode's setting in the half-plane or in three dimensions.

    Parameters
    ----------
    mode : Mode
        The mode.
    dimension : int
        2 for the half-plane, 3 for space.

    Raises
    ------
    ValueError
        The mode has no half-plane model.
    """
    setting = mode.section if dimension == 2 else mode.solid
    if setting is None:
        raise ValueError(f"mode {mode.name} has no half-plane model")
    return setting


@cache
def modes() -> Mapping[str, Mode]:
    """All modes by name, discovered in `cases/modes`."""
    package = importlib.import_module("cases.modes")

    members = (
        importlib.import_module(f"{package.__name__}.{m.name}").MODE
        for m in pkgutil.iter_modules(package.__path__)
    )
    return {mode.name: mode for mode in sorted(members, key=lambda mode: (mode.specimen, mode.name))}
