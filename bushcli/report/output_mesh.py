"""Files of the command `mesh`: pictures of meshes and geometries, and a case file to start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bushcli.report.contents import drawn, geometry_pictures, text_file
from bushcli.report.folder import RESULT, Content, refuse_others, write_files
from bushcli.report.output import FIELDS
from bushcli.runtime.claims import claim

if TYPE_CHECKING:
    from bushcli.simulate.meshes import Meshed
    from geometry.errors import GeometryError
    from geometry.shape import Shape

#: The case file that `bushcli mesh PART` writes.
BEGINNING = "case.toml"


def write_meshes(
    directory: Path,
    meshes: Sequence[Meshed],
    result: Mapping[str, Any] | None = None,
    shape: Shape | None = None,
) -> tuple[Path, ...]:
    """Write pictures of the meshes and of the interpretation of a geometry file, and result.json.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    meshes : sequence of Meshed
        The meshes that were built.
    result : mapping of str to object or None
        What `mesh_json` returned; None writes no result.json.
    shape : Shape or None
        Shape of the case; a picture of its interpretation is written if it was read from a file.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    from bushcli.report.figures import mesh_figures

    files: dict[str, Content] = {} if result is None else {RESULT: result}
    if shape is not None and shape.view is not None:
        files |= geometry_pictures(shape.view, "How the file was interpreted", shape.measures())
    files |= drawn(mesh_figures(meshes))
    fields = [file.name for file in directory.glob("mesh-*") if file.suffix in FIELDS]
    return write_files(directory, files, [], fields)


def write_refused(directory: Path, error: GeometryError) -> tuple[Path, ...]:
    """Write a picture of a geometry that was refused, if the error has a view of it.

    Parameters
    ----------
    directory : Path
        Folder for the picture; created if necessary.
    error : GeometryError
        The error, whose message becomes the title.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    if error.view is None:
        return ()
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
