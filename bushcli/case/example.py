"""The bundled example: its location, and copying it into a user's folder."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from bushcli.errors import InputError, Problem

# The folder of the package `bushcli`, in a checkout or installed.
PACKAGE = Path(__file__).parents[1]


def example_directory() -> Path:
    """Return the folder of the bundled example case: package data when installed, else the folder in the checkout."""
    packaged = PACKAGE / "examples" / "batch"
    return packaged if packaged.is_dir() else PACKAGE.parent / "examples" / "batch"


def write_example(directory: Path) -> tuple[Path, ...]:
    """Copy the example into a folder; existing files are not overwritten.

    Returns
    -------
    tuple of Path
        The files written.

    Raises
    ------
    InputError
        A file of the example exists already, or the folder cannot be made.
    """
    sources = sorted(path for path in example_directory().iterdir() if path.is_file())
    targets = [directory / source.name for source in sources]
    # A link to a file that does not exist would be followed and written.
    present = [target for target in targets if os.path.lexists(target)]
    if present:
        what = "exists already and is not overwritten"
        raise InputError(*(Problem(str(target), what) for target in present))
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for source, target in zip(sources, targets, strict=True):
            target.write_bytes(source.read_bytes())
    except OSError as error:
        raise InputError(Problem(str(directory), f"cannot be written: {error.strerror}")) from None
    return tuple(targets)


def write_case(directory: Path, text: str) -> Path:
    """Write ``case.toml`` into a folder; an existing file is not overwritten.

    Parameters
    ----------
    directory : Path
    text : str
        Contents of the case file.

    Raises
    ------
    InputError
        The file exists already, or cannot be written; after a failure there is no file.
    """
    target = directory / "case.toml"
    content = text.encode()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with target.open("xb") as file:
            try:
                file.write(content)
                file.flush()
            except BaseException:
                # The next run would refuse to replace a file that could not be written completely.
                with suppress(OSError):
                    target.unlink()
                raise
    except FileExistsError:
        raise InputError(Problem(str(target), "exists already and is not overwritten")) from None
    except OSError as error:
        raise InputError(Problem(str(target), f"cannot be written: {error.strerror}")) from None
    return target
