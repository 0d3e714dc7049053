"""Common base of the catalogue's bushings: a meridian section swept about the axis, with sleeves and voids."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import override

from geometry.blocks import Array, Blocks, Interval
from geometry.metal import Metal
from geometry.shape import Meets, Mirrors, Refinement, Shape, Sleeve, Snubber, Stops
from geometry.wall import Annulus, Wall

# Defaults with which the force of bushings that are bonded to their ends stays within 1 % of the converged one
# (measured: benchmarks/README.md).
SECTION = Refinement(across=6)
SOLID = Refinement(across=3, along=8, around=12)
# Longest over shortest element, across and along. The bond edges at the free ends carry a singularity, and under radial
# load the free end folds there: grading along the axis is worth more than elements (radial Yeoh at 21 % of the
# thickness: 1.6 % too stiff with grading 3 and 2,023 unknowns, 0.6 % with grading 6 and 2,597).
SECTION_GRADING = (2.0, 2.0)
SOLID_GRADING = (2.0, 6.0)
# A bond that ends between the free ends carries the singularity with it. With half the grading, half as many elements
# again are as short at the free ends, and shorter between: the radial stiffness at rest with the outer bond off over
# 0.1 to 1.7 thicknesses errs by 1.2 % in place of 7 % (8.48/18.4/35.1 mm), by 2.9 in place of 4.5 % (12/22/60 mm), in
# 2.3 to 2.6 times the time. Twice the elements leave 0.4 % and take 1.5 times as long again (`benchmarks/crack.py`).
# With a whole bond both meshes have the same radial force within 0.05 %, up to 21 % of the thickness.
PARTLY_BONDED = (1.5, 0.5)
# With voids the rubber shears and bends in webs, and in end walls whose edges carry a singularity: an eighth of the
# elements around lie on each side of each end of a void, finer towards it, and at least two along its wall. On 17 parts
# (webs of 5 to 170 degrees, skins of 5 to 45 % of the thickness) the radial stiffness errs by up to 1.3 %, in place of
# up to 9.5 % with 12 elements that are shared by angle and 0.6 times the unknowns; axially, in torsion and conically
# seven of them err by up to 1.6 % (docs/method.md).
AROUND_VOIDS, VOID_GRADING = 16, 6.0
WALL_ELEMENTS = 2
# Elements of a sleeve, through its thickness: it bends little and is stiff, two second-order elements resolve it.
SLEEVE_ELEMENTS = 2


class Void(NamedTuple):
    """A kidney void through the whole length: its range of s and of theta (rad)."""

    s: tuple[float, float]
    theta: tuple[float, float]


class Ring(Meets):
    """A bushing: rubber between two coaxial sleeves, symmetric about its mid-plane; subclasses give the ends."""

    inner_radius: float = Field(gt=0, description="inner radius of the rubber, mm")
    outer_radius: float = Field(gt=0, description="outer radius of the rubber, mm")
    inner_sleeve: Sleeve | None = Field(default=None, description="elastic inner sleeve; absent = rigid")
    outer_sleeve: Sleeve | None = Field(default=None, description="elastic outer sleeve; absent = rigid")
    snubber: Snubber | None = Field(
        default=None, description="plates in front of the free ends; absent = none"
    )

    axisymmetric: ClassVar[bool] = True

    @model_validator(mode="after")
    def _radii(self) -> Any:
        if self.inner_radius >= self.outer_radius:
            raise ValueError(
                f"inner_radius = {self.inner_radius:g} must be smaller than outer_radius = {self.outer_radius:g} (mm)"
            )
        if self.inner_sleeve and self.inner_sleeve.thickness >= self.inner_radius:
            raise ValueError(
                f"inner_sleeve.thickness = {self.inner_sleeve.thickness:g} must be smaller than "
                f"inner_radius = {self.inner_radius:g} (mm)"
            )
        return self

    # -- the section ---------------------------------------------------------------------------------------------

    def half_length(self, s: Array) -> Array:
        """Half the axial length (mm) of the section at s in [0, 1]."""
        raise TypeError(f"shape {type(self).__name__} does not describe its ends")

    def voids(self) -> tuple[Void, ...]:
        """The voids, with theta in [0, 2 pi)."""
        return ()

    @property
    def thickness(self) -> float:
        """Radial thickness of the rubber (mm)."""
        return self.outer_radius - self.inner_radius

    @property
    @override
    def gap(self) -> float:
        return self.thickness

    @property
    @override
    def annulus(self) -> Annulus:
        lengths = 2.0 * self.half_length(np.linspace(0.0, 1.0, 21, dtype=np.float64))
        return Annulus(
            self.inner_radius,
            self.outer_radius,
            float(lengths.min()),
            float(lengths.max()),
            float(min(lengths[0], lengths[-1])),
            not self.voids(),
        )

    @property
    @override
    def wall(self) -> Wall:
        inner, outer = (float(half) for half in self.half_length(np.array([0.0, 1.0])))
        return Wall(self.inner_radius, self.outer_radius, (-inner, inner), (-outer, outer), straight=True)

    @override
    def with_sleeves(self, inner: Sleeve, outer: Sleeve) -> Shape:
        """Return the same shape with these elastic sleeves where it has rigid ones.

        Parameters
        ----------
        inner, outer : Sleeve
            The thickness of the inner one is limited by the room inside the rubber.
        """
        # A solid bar is the thickest inner sleeve.
        thinner = inner.model_copy(update={"thickness": min(inner.thickness, 0.8 * self.inner_radius)})
        sleeves = {"inner_sleeve": self.inner_sleeve or thinner, "outer_sleeve": self.outer_sleeve or outer}
        return type(self)(**(dict(self) | sleeves))

    @property
    @override
    def stops(self) -> Stops | None:
        if self.snubber is None:
            return None
        height = float(self.half_length(np.linspace(0.0, 1.0, 201, dtype=np.float64)).max())
        return Stops(self.snubber, height, self.thickness)

    @property
    @override
    def elastic_sleeves(self) -> Mapping[str, Metal]:
        sleeves = {"inner_sleeve": self.inner_sleeve, "outer_sleeve": self.outer_sleeve}
        return {name: sleeve for name, sleeve in sleeves.items() if sleeve is not None}

    def radius(self, s: Array) -> Array:
        """Radius (mm) at s in [-1, 2]."""
        inner = self.inner_sleeve.thickness if self.inner_sleeve else 0.0
        outer = self.outer_sleeve.thickness if self.outer_sleeve else 0.0
        knots = [self.inner_radius - inner, self.inner_radius, self.outer_radius, self.outer_radius + outer]
        return np.interp(s, [-1.0, 0.0, 1.0, 2.0], knots)

    def measures(self) -> Mapping[str, float]:
        """Volumes (mm^3) of rubber and sleeves and areas (mm^2) of the bonds, exact for ends of up to fourth degree."""
        nodes, weights = np.polynomial.legendre.leggauss(4)
        s = 0.5 * (nodes + 1.0)
        rings = 2 * math.pi * self.radius(s) * 2 * self.half_length(s)
        volume = float(np.sum(0.5 * weights * rings)) * self.thickness
        for void in self.voids():
            low, high = void.s
            s = low + (high - low) * 0.5 * (nodes + 1.0)
            slices = (void.theta[1] - void.theta[0]) * self.radius(s) * 2 * self.half_length(s)
            volume -= float(np.sum(0.5 * weights * slices)) * self.thickness * (high - low)
        lengths = 2 * self.half_length(np.array([0.0, 1.0]))
        result = {
            "rubber": volume,
            "inner_bond": 2 * math.pi * self.inner_radius * float(lengths[0]),
            "outer_bond": 2 * math.pi * self.outer_radius * float(lengths[1]),
        }
        if self.inner_sleeve:
            bore = self.inner_radius - self.inner_sleeve.thickness
            result["inner_sleeve"] = math.pi * (self.inner_radius**2 - bore**2) * float(lengths[0])
        if self.outer_sleeve:
            rim = self.outer_radius + self.outer_sleeve.thickness
            result["outer_sleeve"] = math.pi * (rim**2 - self.outer_radius**2) * float(lengths[1])
        return result

    # -- the blocks ----------------------------------------------------------------------------------------------

    @override
    def blocks(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Blocks:
        """Return the blocks of the half-plane or of the solid cut at the mirrors.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        default, grading = (SECTION, SECTION_GRADING) if dimension == 2 else (SOLID, SOLID_GRADING)
        across = refinement.elements(refinement.across, default.across or 1)
        along = refinement.elements(refinement.along, default.along or self._along(default.across or 1))
        steep = grading[1]
        if refinement.partly_bonded and dimension == 3:
            along, steep = math.ceil(PARTLY_BONDED[0] * along), PARTLY_BONDED[1] * steep
        s_axis = self._across_axis(across, grading[0])
        t_axis: tuple[Interval, ...] = (Interval(-1.0, 1.0, along, steep, "both"),)
        if "z" in mirrors or refinement.doubled:
            t_axis = (Interval(0.0, 1.0, max(1, math.ceil(along / 2)), steep, "stop"),)
        if refinement.doubled and "z" not in mirrors:
            t_axis = (replace(t_axis[0], start=-1.0, stop=0.0, fine="start"), *t_axis)
        if dimension == 2:
            return Blocks((s_axis, t_axis), self._region, self._face_section, self._chart_section)
        around = AROUND_VOIDS if self.voids() else default.around or 1
        theta_axis = self._around_axis(refinement.elements(refinement.around, around), mirrors)
        closed = not mirrors & {"x", "y"}
        return Blocks((s_axis, theta_axis, t_axis), self._region, self._face_solid, self._chart_solid, closed)

    def _along(self, across: int) -> int:
        # Elements twice as long as thick: along the axis the field varies near the ends only, where the grading acts.
        length = 2 * float(self.half_length(np.array([0.0, 1.0])).max())
        return max(6, round(0.5 * across * length / self.thickness))

    def _across_axis(self, across: int, grading: float) -> tuple[Interval, ...]:
        cuts = sorted({0.0, 1.0, *(cut for void in self.voids() for cut in void.s)})
        if len(cuts) == 2:
            rubber = [Interval(0.0, 1.0, across, grading, "both")]
        else:
            rubber = [_share(low, high, across, 1.0) for low, high in itertools.pairwise(cuts)]
            rubber[1::2] = [
                replace(void, elements=max(WALL_ELEMENTS, void.elements)) for void in rubber[1::2]
            ]
        inner = [Interval(-1.0, 0.0, SLEEVE_ELEMENTS)] if self.inner_sleeve else []
        outer = [Interval(1.0, 2.0, SLEEVE_ELEMENTS)] if self.outer_sleeve else []
        return (*inner, *rubber, *outer)

    def _around_axis(self, around: int, mirrors: Mirrors) -> tuple[Interval, ...]:
        # The half on the side of positive x lies on both sides of theta = 0.
        start = -0.5 * math.pi if "x" in mirrors and "y" not in mirrors else 0.0
        stop = 0.5 * math.pi if "x" in mirrors else math.pi if "y" in mirrors else 2 * math.pi
        edges = {
            round(start + (edge - start) % (2 * math.pi), 12) for void in self.voids() for edge in void.theta
        }
        cuts = sorted({start, stop, *(edge for edge in edges if start + 1e-9 < edge < stop - 1e-9)})
        return tuple(self._arc(low, high, around, edges) for low, high in itertools.pairwise(cuts))

    def _arc(self, low: float, high: float, around: int, edges: Collection[float]) -> Interval:
        """Return a web, a void or half of one: elements by its angle, but enough at each end of a void that it has."""
        ends = (low in edges) + (high in edges)
        enough = ends * around // (4 * len(self.voids())) if ends else 1
        fine: Literal["start", "stop", "both"] = "both" if ends != 1 else "start" if low in edges else "stop"
        elements = max(1, enough, round(around * (high - low) / (2 * math.pi)))
        return Interval(low, high, elements, VOID_GRADING if ends else 1.0, fine)

    def _region(self, middle: Array) -> str | None:
        s = middle[0]
        if s < 0:
            return "inner_sleeve"
        if s > 1:
            return "outer_sleeve"
        if len(middle) == 3:
            for void in self.voids():
                begin, end = void.theta
                if void.s[0] < s < void.s[1] and (middle[1] - begin) % (2 * math.pi) < end - begin:
                    return None
        return "rubber"

    def _face_section(self, axis: int, middle: Array) -> str | None:
        s, t = middle
        if axis == 0:
            return self._cylinder(s)
        return "mirror_z" if abs(t) < 1e-9 else self._end(s, t)

    def _face_solid(self, axis: int, middle: Array) -> str | None:
        s, theta, t = middle
        if axis == 0:
            return self._cylinder(s)
        if axis == 2:
            return "mirror_z" if abs(t) < 1e-9 else self._end(s, t)
        for void in self.voids():
            if void.s[0] < s < void.s[1] and any(
                abs(math.remainder(theta - edge, 2 * math.pi)) < 1e-9 for edge in void.theta
            ):
                return "void"
        quarter = round(theta / (0.5 * math.pi))
        return "mirror_y" if quarter % 2 == 0 else "mirror_x"

    def _cylinder(self, s: float) -> str:
        low, high = (-1.0 if self.inner_sleeve else 0.0), (2.0 if self.outer_sleeve else 1.0)
        if abs(s - low) < 1e-9:
            bonded = self.inner_sleeve is None or self.inner_sleeve.grip == "surface"
            return "inner" if bonded else "bore"
        if abs(s - high) < 1e-9:
            bonded = self.outer_sleeve is None or self.outer_sleeve.grip == "surface"
            return "outer" if bonded else "rim"
        return "void"

    def _end(self, s: float, t: float) -> str:
        if s < 0 and self.inner_sleeve:
            return "inner" if self.inner_sleeve.grip == "ends" else "inner_sleeve_end"
        if s > 1 and self.outer_sleeve:
            return "outer" if self.outer_sleeve.grip == "ends" else "outer_sleeve_end"
        return "end_top" if t > 0 else "end_bottom"

    def _chart_section(self, p: Array) -> Array:
        s, t = p[:, 0], p[:, 1]
        return np.column_stack([self.radius(s), t * self.half_length(np.clip(s, 0.0, 1.0))])

    def _chart_solid(self, p: Array) -> Array:
        s, theta, t = p.T
        r = self.radius(s)
        return np.column_stack(
            [r * np.cos(theta), r * np.sin(theta), t * self.half_length(np.clip(s, 0.0, 1.0))]
        )


def _share(low: float, high: float, elements: int, span: float) -> Interval:
    return Interval(low, high, max(1, round(elements * (high - low) / span)))
