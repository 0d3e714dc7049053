"""The type of a shape: dimensions, a chart from a box of parameters to the bushing, and named faces.

A shape describes the bushing as a box of parameters that a *chart* maps to space, so that meshing is the same for all
of them: Gmsh meshes the box in structured blocks and `geometry.mesh` moves every node, mid-side nodes
included, through the chart. The nodes therefore lie exactly on curved surfaces.

Bushings use the parameters (s, theta, t): s = 0 on the inner bond, 1 on the outer bond (-1..0 and 1..2 are the inner
and the outer sleeve); theta the angle about the axis in radians; t = -1 and 1 at the two free ends.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from typing_extensions import override

from geometry.blocks import Blocks
from geometry.metal import Metal
from geometry.structured import mesh_blocks
from geometry.view import View
from geometry.wall import Annulus, Wall

Mirrors = frozenset[Literal["x", "y", "z"]]
Names = dict[int, dict[str, int]]
"""Dimension -> name -> tag of the physical group in Gmsh."""


def shown_measures(measures: Mapping[str, float], regions: Iterable[str]) -> dict[str, float]:
    """Return the volumes of meshed bodies and the areas of the bonds, mm3 and mm2, of all that were measured.

    Parameters
    ----------
    measures : mapping of str to float
        By name of a body or an edge, in cubic or square mm.
    regions : iterable of str
        Meshed bodies.
    """
    names = {*regions, "inner_bond", "outer_bond"}
    return {name: value for name, value in measures.items() if name in names}


class Sleeve(BaseModel):
    """An elastic metal ring on one side of the rubber; a sleeve that is not given is rigid."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False)

    thickness: float = Field(gt=0, description="radial thickness, mm")
    youngs_modulus: float = Field(default=70000.0, gt=0, description="Young's modulus, MPa (aluminium)")
    poissons_ratio: float = Field(default=0.33, ge=0, lt=0.5, description="Poisson's ratio (aluminium)")
    # Wrought aluminium alloys: 2,660 to 2,810 kg/m3 (EN 573-3; EN AW-6082 2,700).
    density: float = Field(
        default=2700.0, ge=500, le=25000, description="density (aluminium), kg/m3; for vibrations only"
    )
    grip: Literal["surface", "ends"] = Field(
        default="surface",
        description="where the rig holds the sleeve: over its free cylinder (bolt in the bore, pressed into an eye), "
        "or at its two end faces only (clamped between brackets)",
    )


class Snubber(BaseModel):
    """Rigid plates in front of the free ends, which the rubber touches at large travel; contact is frictionless."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False)

    gap: float = Field(ge=0, description="from the furthest point of the free end to the plate at rest, mm")
    ends: Literal["both", "top", "bottom"] = Field(
        default="both", description="ends that have a plate; the top is at positive z"
    )
    fixed_to: Literal["outer", "inner"] = Field(
        default="outer", description="sleeve that carries the plates; on the inner one they move with it"
    )


@dataclass(frozen=True)
class Stops:
    """Plates in front of the free ends, with the largest height and the thickness of the rubber (mm)."""

    snubber: Snubber
    height: float
    thickness: float


@dataclass(frozen=True)
class Refinement:
    """How fine the mesh is: rubber elements in each direction of the whole bushing (None = the shape's default).

    `factor` multiplies them all, the defaults too: for the finer mesh of a convergence check. `doubled` meshes a whole
    bushing with twice the mesh of its upper half, so that it compares with a model of that half alone. `partly_bonded`:
    the bond may end anywhere along the axis; solid rings then have more and more even elements (`ring.PARTLY_BONDED`),
    other shapes ignore it.
    """

    across: int | None = None
    along: int | None = None
    around: int | None = None
    factor: float = 1.0
    doubled: bool = False
    partly_bonded: bool = False

    def elements(self, number: int | None, default: int) -> int:
        """Return the number of elements in a direction: the given one, or else the default.

        Parameters
        ----------
        number : int | None
            Number that the case gives; None where it gives none.
        default : int
            Number to use if none is given.
        """
        return max(1, math.ceil(self.factor * (default if number is None else number)))


class Shape(BaseModel):
    """A parametric shape: its fields are its dimensions (mm, degrees), one subclass per file in `geometry/shapes`.

    `examples` holds the dimensions of sound specimens, one of each kind that the shape has; the tests of all shapes use
    them.
    """

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid", allow_inf_nan=False)

    name: ClassVar[str]
    summary: ClassVar[str]
    specimen: ClassVar[Literal["bushing", "coupon"]] = "bushing"
    axisymmetric: ClassVar[bool] = False
    displacement_order: ClassVar[int] = 2
    #: Whether meshes are products of intervals: twice as many elements then halve every one of them.
    structured: ClassVar[bool] = True
    #: Elements of a coarse mesh for quick estimates: a tenth of the time, an error of some per cent in the force.
    coarse: ClassVar[Refinement] = Refinement(2, 4, 8)
    #: Suffixes of files that describe such a shape by themselves.
    suffixes: ClassVar[tuple[str, ...]] = ()
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)

    @property
    def element_directions(self) -> tuple[str, ...]:
        """Directions in which the case may give a number of elements, of "across", "along" and "around"."""
        return ("across", "along", "around")

    @property
    def mirror_planes(self) -> Mirrors:
        """Planes of symmetry through the centre, by their normals."""
        return frozenset({"x", "y", "z"})

    def generate(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Names:
        """Mesh into the open Gmsh session (rank 0 only), and name the groups.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.

        Raises
        ------
        GeometryError
            The shape that the case or its file describes cannot be meshed.
        """
        return mesh_blocks(
            self.blocks(dimension, mirrors, refinement), order=2 if self.displacement_order > 1 else 1
        )

    def cells(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> float:
        """About how many cells `generate` will make of a shape that is not `structured`, estimated without meshing.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.

        Raises
        ------
        GeometryError
        """
        raise TypeError(f"shape {type(self).__name__} does not say how many cells it has")

    def blocks(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Blocks:
        """Blocks of the half-plane (`dimension` 2, axes s and t) or of the solid cut at the `mirrors` (3).

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        raise TypeError(f"shape {type(self).__name__} does not describe its blocks")

    def measures(self) -> Mapping[str, float]:
        """Exact volume of the regions (mm^3) and area of the bonds (mm^2), by name, for the whole solid."""
        raise TypeError(f"shape {type(self).__name__} does not state its measures")

    @property
    def gap(self) -> float | None:
        """Radial travel at which the inner sleeve has reached the outer one, mm; None if unknown."""
        return None if self.wall is None else self.wall.reach

    @property
    def wall(self) -> Wall | None:
        """The rubber between two coaxial sleeves, for effects of the assembly; None where there is no such rubber.

        Raises
        ------
        GeometryError
        """
        return None

    @property
    def overall(self) -> float | None:
        """Largest extent of the part, or of what lies between its bonds, mm; None where the bonds bound no wall."""
        return None if self.wall is None else max(2.0 * self.wall.outer_radius, self.wall.extent)

    def with_sleeves(self, inner: Sleeve, outer: Sleeve) -> Shape | None:
        """Return the same shape with these elastic sleeves where it has rigid ones; None where it cannot have any.

        Parameters
        ----------
        inner, outer : Sleeve
            Sleeves to be added.
        """
        return None

    @property
    def stops(self) -> Stops | None:
        """The plates in front of the free ends; None where there are none."""
        return None

    @property
    def annulus(self) -> Annulus | None:
        """The bonded ring by which closed forms approximate the rubber; None if there is none."""
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """Interpretation of a geometry file in sentences; empty where the dimensions say everything.

        Raises
        ------
        GeometryError
        """
        return ()

    @property
    def view(self) -> View | None:
        """Contents of a picture, with names; None where a picture of the mesh is enough."""
        return None

    @property
    def elastic_sleeves(self) -> Mapping[str, Metal]:
        """The elastic metal bodies by region name."""
        return {}

    @property
    def contact_surfaces(self) -> Meeting:
        """Surfaces with contact: none, those of the mesh, or also the rigid sleeves."""
        return False

    @property
    def beyond(self) -> Mapping[str, tuple[float, float]]:
        """Lengths by which rigid sleeves are known to continue below and above their bonds (mm), by bond."""
        return {}


def _check_contact(value: Any) -> Any:
    if value is not True and value is not False and value != "sleeves":
        raise ValueError('must be true, false or "sleeves"')
    return value


Meeting = Annotated[bool | Literal["sleeves"], BeforeValidator(_check_contact)]


class Meets(Shape):
    """A shape with surfaces that can come into contact."""

    contact: Meeting = Field(
        default=True,
        description="frictionless contact of the surfaces; "
        '"sleeves" = also with the rigid sleeves beyond the bonds; false = surfaces pass through each other',
    )

    @property
    @override
    def contact_surfaces(self) -> Meeting:
        return self.contact


class _Shapes(Mapping[str, type[Shape]]):
    """Shapes by name. The name of a shape is that of its file, which is loaded when the shape is first needed."""

    def __init__(self, package: str) -> None:
        self._package = package
        path = importlib.import_module(package).__path__
        self._names = sorted(info.name for info in pkgutil.iter_modules(path))

    def __getitem__(self, name: str) -> type[Shape]:
        if name not in self._names:
            raise KeyError(name)
        module = importlib.import_module(f"{self._package}.{name}")
        return next(
            value
            for value in vars(module).values()
            if isinstance(value, type) and issubclass(value, Shape) and vars(value).get("name") == name
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


@cache
def shapes() -> Mapping[str, type[Shape]]:
    """All shapes by name, discovered in `geometry/shapes`."""
    return _Shapes("geometry.shapes")
