"""Cad: a bushing from a STEP or BREP file, or a mesh of one as it is (.msh, Abaqus .inp)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator
from typing_extensions import override

from geometry.cad.find_part import CadStatements, FoundPart, find_part
from geometry.cad.part import STEP
from geometry.cad.ready_mesh import SUFFIXES as MESHES
from geometry.cad.ready_mesh import ReadyMesh, read_mesh
from geometry.cad.rules import Rules, Vector
from geometry.file import existing_file
from geometry.metal import Metal, Plate, metal_text, metals
from geometry.shape import Meets, Mirrors, Names, Refinement, shown_measures
from geometry.size import MILLIMETRES, UNSTATED, Unit
from geometry.view import View
from geometry.wall import Wall

SUFFIXES = (".step", ".stp", ".brep", ".brp", *MESHES)


class BondRules(BaseModel):
    """``[geometry.bonds]``: which faces are bonded, where that cannot be found."""

    model_config = ConfigDict(frozen=True, defer_build=True, extra="forbid")

    inner: Rules = Field(default=(), description="{radius = 10.0}, or a list of such rules")
    outer: Rules = Field(default=(), description="likewise")


class Cad(Meets):
    """A CAD part: solids of rubber, with sleeves and plates as solids or rigid."""

    name: ClassVar[str] = "cad"
    summary: ClassVar[str] = (
        "a STEP or BREP file, or a finished mesh; bonds, axis and symmetry are found or given"
    )

    structured: ClassVar[bool] = False
    # One tetrahedron from bond to bond, and more where a part is narrow: some 5 % too stiff.
    coarse: ClassVar[Refinement] = Refinement(across=1)
    suffixes: ClassVar[tuple[str, ...]] = SUFFIXES
    # Needs a file: tests/parts.py makes them.
    examples: ClassVar[tuple[Mapping[str, Any], ...]] = ()

    file: str = Field(description="STEP, BREP, MSH or INP file, relative to the case file")
    unit: Unit | None = Field(
        default=None, description="unit of the numbers in the file; absent = the one that the file states"
    )
    axis: Vector | None = Field(default=None, description="direction of the axis; absent = found")
    origin: Vector | None = Field(
        default=None,
        description="the bushing's centre, mm; absent = on the axis, in the middle of the inner bond",
    )
    direction: Vector | None = Field(
        default=None,
        description="direction of the radial load; absent = the file's x, or a plane of symmetry",
    )
    bonds: BondRules | None = Field(default=None, description="rules for faces; absent = found")
    solids: Mapping[str, str] = Field(
        default={},
        description='solid, by name or number, -> "rubber", "inner_sleeve", "outer_sleeve", "ignore" or a plate',
    )
    plates: Mapping[str, Plate] = Field(
        default={},
        description="metal of plates (steel where not given) and of sleeves that are elastic",
    )

    @field_validator("file")
    @classmethod
    def _beside_the_case(cls, value: str, info: ValidationInfo) -> str:
        if Path(value).suffix.lower() not in SUFFIXES:
            raise ValueError(f"is not a {', '.join(SUFFIXES)} file")
        return existing_file(Path(info.context["folder"]) if info.context else Path(), value)

    def contents(self) -> bytes:
        """Return the present contents of the file: saved results of another file are not those of this shape."""
        return Path(self.file).read_bytes()

    def __hash__(self) -> int:
        return hash((self._statements, tuple(self.plates.items())))

    @property
    def _statements(self) -> CadStatements:
        path = Path(self.file)
        return CadStatements(
            path,
            path.stat().st_mtime,
            self.unit,
            self.axis,
            self.origin,
            self.direction,
            self.bonds.inner if self.bonds else (),
            self.bonds.outer if self.bonds else (),
            tuple(self.solids.items()),
            tuple(self.plates),
            tuple(name for name, plate in self.plates.items() if plate.rigid),
        )

    @property
    def interpretation(self) -> FoundPart | ReadyMesh:
        """The interpretation of the file.

        Raises
        ------
        GeometryError
        """
        path = Path(self.file)
        if path.suffix.lower() in MESHES:
            scale = MILLIMETRES[self.unit or "mm"]
            return read_mesh(path, path.stat().st_mtime, scale, self.axis, self.origin, self.direction)
        return find_part(self._statements)

    @property
    @override
    def element_directions(self) -> tuple[str, ...]:
        # A finished mesh is used as it is; tetrahedra follow no direction.
        return () if Path(self.file).suffix.lower() in MESHES else ("across",)

    @property
    @override
    def notes(self) -> tuple[str, ...]:
        metal = self.elastic_sleeves
        # BREP and meshes have no unit.
        stated = self.unit is not None or Path(self.file).suffix.lower() in STEP
        return (
            *self.interpretation.notes,
            *(() if stated else (UNSTATED,)),
            *(f"{name}: {metal_text(sleeve)}" for name, sleeve in metal.items()),
        )

    @property
    @override
    def view(self) -> View | None:
        return self.interpretation.view

    @property
    @override
    def overall(self) -> float | None:
        return super().overall if isinstance(self.interpretation, ReadyMesh) else self.interpretation.size

    @property
    @override
    def wall(self) -> Wall | None:
        return self.interpretation.wall

    @property
    @override
    def beyond(self) -> Mapping[str, tuple[float, float]]:
        part = self.interpretation
        return {} if isinstance(part, ReadyMesh) else part.beyond

    @property
    @override
    def mirror_planes(self) -> Mirrors:
        return self.interpretation.planes

    @override
    def generate(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Names:
        """Mesh the part into the open Gmsh session, and return the names of its groups.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        from geometry.cad.meshing import generate
        from geometry.raw import to_gmsh

        part = self.interpretation
        if isinstance(part, ReadyMesh):
            return to_gmsh(part.raw)
        return generate(self._statements, mirrors, refinement)

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
        from geometry.cad.meshing import part_cells

        part = self.interpretation
        if isinstance(part, ReadyMesh):
            return float(sum(len(cells) for cells in part.raw.cells.values()))
        return part_cells(part, mirrors, refinement)

    @override
    def measures(self) -> Mapping[str, float]:
        return shown_measures(self.interpretation.measures, self.interpretation.regions)

    @property
    @override
    def elastic_sleeves(self) -> Mapping[str, Metal]:
        part = self.interpretation
        known_names = part.regions if isinstance(part, ReadyMesh) else part.roles.values()
        return metals(self.plates, part.regions, known_names, self.file)
