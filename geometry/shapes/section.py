"""Section: any section of revolution, by outlines of named edges in the case file or in a DXF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator
from typing_extensions import override

from geometry.file import existing_file
from geometry.metal import Metal, Plate, is_rigid, metal_text, metals
from geometry.section.dxf import Drawing, read_dxf
from geometry.section.find_section import FoundSection, find_section
from geometry.section.outline import Edge, Loop, loops_of
from geometry.shape import Meets, Mirrors, Names, Refinement, shown_measures
from geometry.size import STATES, UNSTATED, Unit
from geometry.view import View, caption
from geometry.wall import Wall

Edges = Annotated[tuple[Edge, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]


class Section(Meets):
    """Rubber of revolution between named bonds, with plates and sleeves inside it or beside it."""

    name: ClassVar[str] = "section"
    summary: ClassVar[str] = "any section of revolution: outlines in the case file or in a DXF"
    axisymmetric: ClassVar[bool] = True
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = (
        {
            "outline": [
                {"from": [10.0, -20.0], "to": [20.0, -15.0]},
                {"to": [20.0, 15.0], "name": "outer"},
                {"to": [10.0, 20.0], "arc_through": [15.0, 16.0]},
                {"to": [10.0, -20.0], "name": "inner"},
            ]
        },
        {
            "outline": [
                {"from": [10.0, -22.0], "to": [20.0, -16.0], "arc_through": [14.2, -17.7]},
                {"to": [20.0, 16.0], "name": "outer"},
                {"to": [26.0, 16.0], "name": "outer"},
                {"to": [26.0, 19.0]},
                {"to": [20.0, 19.0]},
                {"to": [10.0, 22.0], "spline_through": [[16.0, 18.5], [12.0, 20.0]]},
                {"to": [10.0, -22.0], "arc_through": [11.5, 0.0], "name": "inner"},
            ]
        },
        {
            "outline": [
                {"from": [10.0, -20.0], "to": [24.0, -15.0]},
                {"to": [24.0, 15.0], "name": "outer"},
                {"to": [10.0, 20.0]},
                {"to": [10.0, -20.0], "name": "inner"},
                {"from": [16.0, -12.0], "to": [17.0, -12.0], "body": "plate"},
                {"to": [17.0, 12.0]},
                {"to": [16.0, 12.0]},
                {"to": [16.0, -12.0]},
            ]
        },
    )

    structured: ClassVar[bool] = False
    suffixes: ClassVar[tuple[str, ...]] = (".dxf",)

    outline: Edges | None = Field(
        default=None, description="edges in order around each body, [[geometry.outline]]"
    )
    file: str | None = Field(default=None, description="DXF file instead; layers are names")
    unit: Unit | None = Field(
        default=None, description="unit of the numbers in the DXF file; absent = the one that the file states"
    )
    centre: float | None = Field(
        default=None, description="z of the bushing's centre, mm; absent = middle of the inner bond"
    )
    plates: Mapping[str, Plate] = Field(
        default={}, description="metal of plates and sleeves by name; steel where not given"
    )

    @field_validator("file")
    @classmethod
    def _beside_the_case(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is None or not info.context:
            return value
        return existing_file(Path(info.context["folder"]), value)

    @model_validator(mode="after")
    def _one_source(self) -> Any:
        if bool(self.outline) == bool(self.file):
            raise ValueError("give the outline either as [[geometry.outline]] or as file")
        if self.unit and not self.file:
            raise ValueError("unit belongs to a file; [[geometry.outline]] is in mm")
        return self

    def contents(self) -> bytes:
        """Return the present contents of the file: saved results of another file are not those of this shape."""
        return Path(self.file).read_bytes() if self.file else b""

    def __hash__(self) -> int:
        return hash((self.outline, self.file, self.unit, self.centre, tuple(self.plates.items())))

    @property
    def interpretation(self) -> FoundSection:
        """The interpretation of the outlines.

        Raises
        ------
        GeometryError
        """
        return find_section(self._loops, self.where, self.centre)

    @property
    def where(self) -> str:
        """Source of the outlines, for messages."""
        return self.file or "geometry.outline"

    @property
    def _loops(self) -> tuple[Loop, ...]:
        drawing = self._drawing
        return drawing.loops if drawing else loops_of(self.outline or (), "geometry.outline")

    @property
    def _drawing(self) -> Drawing | None:
        if self.file is None:
            return None
        return read_dxf(Path(self.file), Path(self.file).stat().st_mtime, self.unit)

    @property
    @override
    def notes(self) -> tuple[str, ...]:
        section, metal, drawing = self.interpretation, self.elastic_sleeves, self._drawing
        symmetry = "symmetric" if section.symmetric else "not symmetric"
        unit = () if drawing is None else (STATES.format(drawing.stated),) if drawing.stated else ()
        bodies = (
            f"{region} ({metal_text(metal[region])})" if region in metal else region
            for region in section.regions
        )
        return (
            *unit,
            f"bodies: {', '.join(bodies)}",
            f"centre at z = {section.centre + 0.0:g} mm; the section is {symmetry} about it",
            *((UNSTATED,) if drawing and drawing.unit is None else ()),
        )

    @property
    @override
    def view(self) -> View | None:
        section = self.interpretation
        captions = {
            name: caption(name, "rigid" if is_rigid(sleeve) else "elastic", section.measures[name], True)
            for name, sleeve in self.elastic_sleeves.items()
        }
        return replace(section.view, captions=captions)

    @property
    @override
    def wall(self) -> Wall | None:
        return self.interpretation.wall

    @property
    @override
    def mirror_planes(self) -> Mirrors:
        return frozenset({"x", "y", "z"}) if self.interpretation.symmetric else frozenset({"x", "y"})

    @override
    def generate(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Names:
        """Mesh the section, or the solid that it sweeps, into the open session, and return the names of its groups.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        from geometry.section.meshing import generate

        return generate(self.interpretation, self.where, dimension, mirrors, refinement)

    @override
    def cells(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> float:
        """About how many cells `generate` will make.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        from geometry.section.meshing import section_cells

        return section_cells(self.interpretation, dimension, mirrors, refinement)

    @override
    def measures(self) -> Mapping[str, float]:
        return shown_measures(self.interpretation.measures, self.interpretation.regions)

    @property
    @override
    def elastic_sleeves(self) -> Mapping[str, Metal]:
        regions = self.interpretation.regions
        return metals(self.plates, regions, regions, self.where)
