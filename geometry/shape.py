"""What a shape is: dimensions, a chart from a box of parameters to the bushing, and named faces.

A shape describes the bushing as a box of parameters that a *chart* maps to space, so that meshing is the same for all
of them: Gmsh meshes the box in structured blocks and `geometry.mesh` moves every node, mid-side nodes
included, through the chart. Curved surfaces are therefore met exactly at the nodes.

Bushings use the parameters (s, theta, t): s = 0 on the inner bond, 1 on the outer bond (-1..0 and 1..2 are the inner
and the outer sleeve); theta the angle about the axis in radians; t = -1 and 1 at the two free ends.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

Array = NDArray[np.float64]
Mirrors = frozenset[Literal["x", "y", "z"]]


class Sleeve(BaseModel):
    """An elastic metal ring on one side of the rubber; a sleeve that is not given is rigid."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    thickness: float = Field(gt=0, description="radial thickness, mm")
    youngs_modulus: float = Field(default=70000.0, gt=0, description="Young's modulus, MPa (aluminium)")
    poissons_ratio: float = Field(default=0.33, ge=0, lt=0.5, description="Poisson's ratio (aluminium)")
    grip: Literal["surface", "ends"] = Field(
        default="surface",
        description="where the rig holds the sleeve: over its free cylinder (bolt in the bore, pressed into an eye), "
        "or at its two end faces only (clamped between brackets)",
    )


class Snubber(BaseModel):
    """Rigid plates before the free ends, which the rubber meets at large travel; contact is without friction."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    gap: float = Field(ge=0, description="from the furthest point of the free end to the plate at rest, mm")
    ends: Literal["both", "top", "bottom"] = Field(
        default="both", description="ends that have a plate; the top is at positive z"
    )
    fixed_to: Literal["outer", "inner"] = Field(
        default="outer", description="sleeve that carries the plates; on the inner one they move with it"
    )


@dataclass(frozen=True)
class Refinement:
    """How fine the mesh is: rubber elements in each direction of the whole bushing (None = the shape's default).

    `factor` multiplies them all, the defaults too: for the finer mesh of a convergence check. `doubled` asks of a whole
    bushing for twice the mesh of its upper half, where the same is elsewhere computed on that half.
    """

    across: int | None = None
    along: int | None = None
    around: int | None = None
    factor: float = 1.0
    doubled: bool = False

    def elements(self, given: int | None, default: int) -> int:
        """Number of elements in a direction from what was given for it, or else its default."""
        return max(1, math.ceil(self.factor * (default if given is None else given)))


@dataclass(frozen=True)
class Interval:
    """One block along a parameter axis, and the vertices of its elements.

    `grading` is the length of the longest element over that of the shortest; the short ones lie at the `fine` end(s).
    """

    start: float
    stop: float
    elements: int
    grading: float = 1.0
    fine: Literal["start", "stop", "both"] = "both"

    def vertices(self) -> Array:
        """The elements' end points, shape (elements + 1,), from start to stop."""
        k = np.arange(self.elements)
        n = max(self.elements - 1, 1)
        depth = {"start": n - k, "stop": k, "both": np.abs(2 * k - n)}[self.fine] / n
        lengths = self.grading**-depth
        return self.start + (self.stop - self.start) * np.concatenate(
            [[0.0], np.cumsum(lengths) / lengths.sum()]
        )


@dataclass(frozen=True)
class Blocks:
    """A structured parameter domain: the product of the axes' intervals, less what has no region.

    Attributes
    ----------
    axes
        The intervals of each parameter axis, in order; 2 or 3 axes.
    region
        Midpoint of a block in parameters -> name of its region, or None where there is nothing.
    face
        Axis normal to a bounding face and the face's midpoint in parameters -> its name. Faces toward a block that
        is missing are asked for too.
    chart
        Parameters (n, d) -> coordinates (n, d) in mm.
    closed
        True when the chart glues the ends of the second axis (a full circumference).
    """

    axes: tuple[tuple[Interval, ...], ...]
    region: Callable[[Array], str | None]
    face: Callable[[int, Array], str | None]
    chart: Callable[[Array], Array]
    closed: bool = False


class Shape(BaseModel):
    """A parametric shape: its fields are its dimensions (mm, degrees), one subclass per file in `geometry/shapes`.

    `examples` holds the dimensions of sound specimens, one of each kind that the shape knows; the tests of all shapes
    are made with them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: ClassVar[str]
    summary: ClassVar[str]
    specimen: ClassVar[Literal["bushing", "coupon"]] = "bushing"
    axisymmetric: ClassVar[bool] = False
    displacement_order: ClassVar[int] = 2
    mirror_planes: ClassVar[Mirrors] = frozenset({"x", "y", "z"})
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)

    def blocks(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Blocks:
        """Blocks of the half-plane (`dimension` 2, axes s and t) or of the solid cut at the `mirrors` (3)."""
        raise TypeError(f"shape {type(self).__name__} does not describe its blocks")

    def measures(self) -> Mapping[str, float]:
        """Exact volume of the regions (mm^3) and area of the bonds (mm^2), by name, for the whole solid."""
        raise TypeError(f"shape {type(self).__name__} does not state its measures")

    @property
    def elastic_sleeves(self) -> Mapping[str, Sleeve]:
        """The elastic sleeves by region name."""
        return {}


@cache
def shapes() -> Mapping[str, type[Shape]]:
    """All shapes by name, discovered in `geometry/shapes`."""
    package = importlib.import_module("geometry.shapes")

    found: dict[str, type[Shape]] = {}
    for info in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{info.name}")
        for value in vars(module).values():
            ours = (
                isinstance(value, type) and issubclass(value, Shape) and value.__module__ == module.__name__
            )
            if ours and "name" in vars(value):
                found[value.name] = value
    return dict(sorted(found.items()))
