"""The meshes of a case -> their document."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.case.typical import unusual_values
from bushcli.report.conditions import size_of
from bushcli.report.document import Columns, Document, Section, Table, paragraphs, table_of
from bushcli.report.results import MeshResult

if TYPE_CHECKING:
    from bushcli.simulate.meshes import Meshed
    from geometry.shape import Shape


def mesh_document(result: MeshResult) -> Document:
    """Return the document of the meshes of a case, with the interpretation of a geometry file."""
    case, shape = result.case, result.case.geometry
    size = size_of(shape)
    columns: Columns[Meshed] = (
        ("mesh", lambda mesh: mesh.name),
        ("for", lambda mesh: ", ".join(mesh.modes)),
        ("boundaries", lambda mesh: ", ".join(mesh.boundaries)),
        ("elements", lambda mesh: str(mesh.cells)),
        ("nodes", lambda mesh: str(mesh.nodes)),
    )
    sections = [
        notes_section(shape),
        Section("Volumes and areas", [measure_table(shape)] if shape.notes else []),
        Section("", paragraphs([f"Size: {size}" if size else ""])),
        Section("Meshes", [table_of("Meshes", result.meshes, columns, left=3)]),
    ]
    return Document("", (), "plain", sections, unusual_values(case, case.material))


def notes_section(shape: Shape) -> Section:
    """Return how a geometry file was interpreted; without blocks for a shape that is given by its dimensions."""
    return Section("How the file was interpreted", paragraphs(shape.notes))


def measure_table(shape: Shape) -> Table:
    """Return the volumes of the bodies and the areas of the bonds."""
    rows = tuple(
        (name.replace("_bond", " bond"), f"{value:.6g}", "mm2" if name.endswith("_bond") else "mm3")
        for name, value in shape.measures().items()
    )
    return Table("Volumes and areas", ("", "", ""), rows, left=1)
