"""Files of the command `mesh`: pictures of meshes and geometries, and a case file to start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bushcli.report.contents import drawn, geometry_pictures, text_file
from bushcli.report.folder import RESULT, Content, earlier_result, refuse_others, write_files
from bushcli.report.output import FIELDS
from bushcli.runtime.claims import claim

if TYPE_CHECKING:
    from bushcli.simulate.meshes import Meshed
    from geometry.errors import GeometryError
    from geometry.shape import Shape

#: The case file that `bushcli mesh PART` writes.
BEGINNING = "case.toml"
#: Folder beside a result for the picture of a geometry that was refused: the result keeps its own.
REFUSED = "refused-mesh"


def write_meshes(
    directory: Path,
    meshes: Sequence[Meshed],
    result: Mapping[str, Any],
    shape: Shape | None = None,
) -> tuple[Path, ...]:
    """Write pictures of the meshes and of the interpretation of a geometry file, and result.json.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    meshes : sequence of Meshed
        The meshes that were built.
    result : mapping of str to object
        What `mesh_json` returned.
    shape : Shape or None
        Shape of the case; a picture of its interpretation is written if it was read from a file.

    Raises
    ------
    InputError
        The folder cannot be written.
    """

    def draw() -> dict[str, Content]:
        from bushcli.report.drawing.results import mesh_figures

        seen = None if shape is None else shape.view
        known = {} if seen is None or shape is None else shape.measures()
        shown = {} if seen is None else geometry_pictures(seen, "How the file was interpreted", known)
        return shown | drawn(mesh_figures(meshes))

    fields = [f"mesh-{one.name}{end}" for one in meshes for end in FIELDS]
    return write_files(directory, {RESULT: result}, [], fields, draw)


def write_refused(directory: Path, error: GeometryError) -> tuple[Path, ...]:
    """Write a picture of a geometry that was refused, if the error has a view of it.

    Parameters
    ----------
    directory : Path
        Folder for the picture, created if necessary; if it holds a result, `REFUSED` in it.
    error : GeometryError
        The error, whose message becomes the title.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    if error.view is None:
        return ()
    if earlier_result(directory) is not None:
        directory = directory / REFUSED
    pictures = geometry_pictures(error.view, str(error), {})
    refuse_others(directory, pictures, [])
    with suppress(OSError):  # `write_files` says why
        claim(directory, pictures)
    return write_files(directory, pictures, [])


def write_starter_case(directory: Path, case: str) -> tuple[Path, ...]:
    """Write a case file to start from, unless the folder has one, which the user may have edited.

    Parameters
    ----------
    directory : Path
        Folder for the case file; created if necessary.
    case : str
        Text of the case file.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    return (
        () if (directory / BEGINNING).exists() else write_files(directory, {BEGINNING: text_file(case)}, [])
    )
