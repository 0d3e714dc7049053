"""Mount: a rubber spring of revolution between two parallel end plates, bonded to both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from geometry.blocks import Array, Blocks, Interval
from geometry.shape import Mirrors, Refinement, Shape

# Elements from plate to plate, from bore to flank, and around; all of one size. Compression makes the surface of the
# bore crease (Biot's instability): finer meshes, and meshes graded toward the edges, resolve creases of the size of
# their elements and stop early. Eight even elements give the force up to half the height within 0.5 % of thirty
# (test_mount.py).
SECTION = (8, 8)
SOLID = (8, 6, 12)


class Mount(Shape):
    """Hollow rubber cylinder, its outside hollowed by a circular arc; "inner" is the upper plate, "outer" the lower.

    The bushing's modes act on it with the upper plate in the place of the inner sleeve: a negative axial displacement
    compresses. Its parameters are (s, theta, t): s = 0 in the bore, 1 on the flank; t = -1 and 1 on the plates.
    """

    name: ClassVar[str] = "mount"
    summary: ClassVar[str] = "rubber spring between two end plates; the upper one is driven"
    axisymmetric: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {"inner_radius": 10.0, "outer_radius": 30.0, "height": 40.0},
        {"inner_radius": 10.0, "outer_radius": 30.0, "height": 40.0, "waist_depth": 5.0},
    )

    inner_radius: float = Field(gt=0, description="radius of the bore, mm")
    outer_radius: float = Field(gt=0, description="outer radius of the rubber at the plates, mm")
    height: float = Field(gt=0, description="height of the rubber from plate to plate, mm")
    waist_depth: float = Field(
        default=0.0, ge=0, description="how deep the outside is hollowed at mid-height, by a circular arc, mm"
    )

    @model_validator(mode="after")
    def _possible(self) -> Any:
        if self.inner_radius >= self.outer_radius:
            raise ValueError(
                f"inner_radius = {self.inner_radius:g} must be smaller than outer_radius = {self.outer_radius:g} (mm)"
            )
        if self.waist_depth >= self.outer_radius - self.inner_radius:
            raise ValueError(f"waist_depth = {self.waist_depth:g} mm hollows the rubber through to the bore")
        if self.waist_depth > 0.5 * self.height:
            raise ValueError(
                f"waist_depth = {self.waist_depth:g} must not exceed half the height, {0.5 * self.height:g} (mm): "
                "a half circle is the deepest arc"
            )
        return self

    @property
    @override
    def mirror_planes(self) -> Mirrors:
        # Only one of the plates is driven: the load is not symmetric about the mid-plane.
        return frozenset({"x", "y"})

    def flank(self, z: Array) -> Array:
        """Outer radius (mm) at height z (mm) above the mid-plane."""
        if self.waist_depth == 0:
            return np.full_like(z, self.outer_radius)
        arc = self._arc_radius
        # An arc through both rims, its centre outside at mid-height.
        centre = self.outer_radius - self.waist_depth + arc
        return centre - np.sqrt(arc**2 - z**2)

    @property
    def _arc_radius(self) -> float:
        return (0.25 * self.height**2 + self.waist_depth**2) / (2 * self.waist_depth)

    def measures(self) -> Mapping[str, float]:
        """Volume (mm^3) of the rubber and areas (mm^2) of the bonds, in closed form."""
        a, b, h = self.inner_radius, self.outer_radius, 0.5 * self.height
        plate = math.pi * (b**2 - a**2)
        volume = plate * self.height
        if self.waist_depth > 0:
            r = self._arc_radius
            c = b - self.waist_depth + r
            # Integral of (c - sqrt(r^2 - z^2))^2 - a^2 over the height.
            root = h * math.sqrt(r**2 - h**2) + r**2 * math.asin(h / r)
            volume = math.pi * (2 * h * (c**2 - a**2 + r**2) - 2 * h**3 / 3 - 2 * c * root)
        return {"rubber": volume, "inner_bond": plate, "outer_bond": plate}

    def blocks(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Blocks:
        """Return one block, which the chart bends to the flank.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        default = (*SECTION, 1) if dimension == 2 else SOLID
        # "Across" is from bond to bond, as in a bushing: here along the axis.
        t_axis = (Interval(-1.0, 1.0, refinement.elements(refinement.across, default[0])),)
        s_axis = (Interval(0.0, 1.0, refinement.elements(refinement.along, default[1])),)
        if dimension == 2:
            return Blocks((s_axis, t_axis), lambda middle: "rubber", _face_section, self._chart_section)
        share = 0.25 if {"x", "y"} <= mirrors else 0.5 if mirrors else 1.0
        around = max(2, math.ceil(share * refinement.elements(refinement.around, default[2])))
        start_angle = -0.5 * math.pi if mirrors == {"x"} else 0.0
        theta_axis = (Interval(start_angle, start_angle + share * 2 * math.pi, around),)
        axes = (s_axis, theta_axis, t_axis)
        return Blocks(axes, lambda middle: "rubber", _face_solid, self._chart_solid, closed=not mirrors)

    def _chart_section(self, p: Array) -> Array:
        s, t = p.T
        z = 0.5 * self.height * t
        return np.column_stack([self.inner_radius + s * (self.flank(z) - self.inner_radius), z])

    def _chart_solid(self, p: Array) -> Array:
        r, z = self._chart_section(p[:, [0, 2]]).T
        return np.column_stack([r * np.cos(p[:, 1]), r * np.sin(p[:, 1]), z])


def _face_section(axis: int, middle: Array) -> str:
    if axis == 0:
        return "bore" if middle[0] < 0.5 else "flank"
    return "inner" if middle[1] > 0 else "outer"


def _face_solid(axis: int, middle: Array) -> str:
    if axis == 1:
        return "mirror_y" if abs(math.sin(middle[1])) < 1e-9 else "mirror_x"
    return _face_section(min(axis, 1), middle[[0, 2]])
