"""The rubber between two coaxial sleeves: all that effects of assembly need to know of a bushing's shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from geometry.blocks import Array

Span = tuple[float, float]


@dataclass(frozen=True)
class Wall:
    """The rubber between two coaxial bonds.

    Attributes
    ----------
    inner_radius, outer_radius : float
        Largest radius of the inner bond and smallest one of the outer bond, mm.
    inner, outer : (float, float)
        Least and largest z of each bond, mm.
    straight : bool
        Whether all rubber lies between these two radii.
    reach : float or None
        From the least radius of the inner bond to the largest one of the outer bond, mm: no radial motion is larger
        between rigid sleeves, whatever their form. None where the bonds do not face each other.
    """

    inner_radius: float
    outer_radius: float
    inner: Span
    outer: Span
    straight: bool = False
    reach: float | None = None

    @property
    def thickness(self) -> float:
        """Difference of the radii, mm."""
        return self.outer_radius - self.inner_radius

    @property
    def extent(self) -> float:
        """Distance from the lowest to the highest point of the bonds along the axis, mm."""
        return max(self.inner[1], self.outer[1]) - min(self.inner[0], self.outer[0])

    @property
    def bond_length(self) -> float:
        """Length of the shorter bond along the axis, mm."""
        return min(self.inner[1] - self.inner[0], self.outer[1] - self.outer[0])

    @property
    def facing(self) -> float:
        """Largest distance from the centre, z = 0, at which the bonds face each other, mm; 0 where they do not."""
        return max(0.0, min(self.inner[1], self.outer[1]), -max(self.inner[0], self.outer[0]))

    def size(self, name: Literal["thickness", "length", "thickness/length"]) -> float:
        """Return the thickness, the length of the shorter bond (both mm), or their quotient."""
        sizes = {"thickness": self.thickness, "length": self.bond_length}
        return sizes[name] if name in sizes else self.thickness / self.bond_length

    def span(self, bond: str) -> Span:
        """Least and largest z of the bond "inner" or "outer", mm."""
        return self.inner if bond == "inner" else self.outer


@dataclass(frozen=True)
class Annulus:
    """The bonded ring of rubber by which closed forms approximate a bushing.

    Attributes
    ----------
    inner_radius, outer_radius : float
        Radii of the bonds, mm.
    shortest, longest : float
        Length of the rubber where it is least and most, mm.
    bonded : float
        Length of the shorter bond, mm.
    whole : bool
        Whether the rubber has no voids.
    """

    inner_radius: float
    outer_radius: float
    shortest: float
    longest: float
    bonded: float
    whole: bool = True

    @property
    def thickness(self) -> float:
        """Radial thickness of the rubber, mm."""
        return self.outer_radius - self.inner_radius


def wall_of(bonds: Mapping[str, Array], spans: Mapping[str, Span] | None = None) -> Wall | None:
    """Return the wall between bonds of any form; None where no cylinder about the axis lies between them.

    Parameters
    ----------
    bonds : mapping of str to (n, 2) array
        Points (r, z) of "inner" and "outer", mm.
    spans : mapping of str to (float, float) or None
        Least and largest z of each bond, where they are known more accurately than from the points.
    """
    inner, outer = bonds["inner"], bonds["outer"]
    ends = {name: (float(points[:, 1].min()), float(points[:, 1].max())) for name, points in bonds.items()}
    ends |= spans or {}
    low, high = float(inner[:, 0].max()), float(outer[:, 0].min())
    # A bond that is a plane across the axis has no length along it.
    lengths = [ends[name][1] - ends[name][0] for name in ("inner", "outer")]
    if high - low <= 1e-3 * high or min(lengths) <= 1e-3 * high:
        return None
    (bottom, top), (below, above) = ends["inner"], ends["outer"]
    facing = min(top, above) > max(bottom, below)
    reach = float(outer[:, 0].max() - inner[:, 0].min()) if facing else None
    return Wall(low, high, ends["inner"], ends["outer"], reach=reach)


def cylindrical(points: Array) -> Array:
    """Radius and height (n, 2) of points (n, 3) about the axis z, mm."""
    return np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
