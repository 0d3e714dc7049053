"""The folder of results: which files in it belong to bushcli, and writing files into it.

`result.json` lists the files that bushcli wrote; no other file is replaced, and no symbolic link is followed. Every
file is written under a temporary name beside its place and then renamed, so that nobody reads an incomplete file.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from bushcli.errors import InputError, Problem
from bushcli.runtime.bounded import read_bounded
from bushcli.runtime.claims import claimed, release

RESULT = "result.json"
#: Key of `result.json` with the names of all files that bushcli wrote into the folder.
FILES = "files"
#: Bytes of a result.json; larger ones are not bushcli's.
_LARGEST = 200_000_000
_FOLDER = "a folder for the results"

Content = Callable[[Path], None] | Mapping[str, Any]
"""A function that writes a file at a path, or the result, which becomes JSON."""


def check_folder(directory: Path) -> None:
    """Refuse a folder that cannot be created or written to.

    Raises
    ------
    InputError
        The path is a file, lies below one, has a name that the file system does not accept, or is not writable.
    """
    import tempfile  # here, because it adds 8 ms to a start-up

    try:
        existing = next(path for path in (directory, *directory.absolute().parents) if _is_there(path))
        if existing.is_dir():
            # Tested with a temporary file: permissions alone do not reveal a full disk or /proc.
            with tempfile.TemporaryFile(dir=existing) as probe:
                probe.write(b"x")
            return
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise InputError(Problem(str(directory), what, "", "give another -o")) from None
    raise InputError(Problem(str(existing), "is a file", "", _FOLDER))


def _is_there(path: Path) -> bool:
    """Whether a path exists; `Path.exists` also denies a name that is too long, from Python 3.14 on."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def refuse_others(directory: Path, names: Iterable[str], inputs: Collection[Path]) -> None:
    """Refuse to replace inputs of the case, links, or files that no earlier run wrote.

    Parameters
    ----------
    directory : Path
    names : iterable of str
        Files to be written.
    inputs : collection of Path
        Files that the case reads.

    Raises
    ------
    InputError
    """
    there = [directory / name for name in names if os.path.lexists(directory / name)]
    if not there:
        return
    read = {path.resolve() for path in inputs}
    own = owned(directory)
    findings = []
    for path in there:
        if path.is_symlink():
            findings.append(
                Problem(str(path), "is a symbolic link, which is not followed", "", "give another -o")
            )
        elif path.resolve() in read:
            what = "is an input of the case, and a result would replace it"
            findings.append(Problem(str(path), what, "", "give another -o"))
        elif own is None:
            what = "exists already and was not written by an earlier run (the folder has no result.json of bushcli)"
            findings.append(Problem(str(path), what, "", "give another -o"))
        elif own and path.name not in own:
            what = "exists already and was not written by an earlier run (result.json does not list it)"
            findings.append(Problem(str(path), what, "", "give another -o"))
    if findings:
        raise InputError(*findings)


def owned(directory: Path) -> frozenset[str] | None:
    """Return the files that bushcli wrote into a folder; None if it wrote none, empty if they are not listed."""
    noted = claimed(directory)
    found = _read(directory / RESULT)
    if not isinstance(found, dict) or not {"command", "versions"} <= found.keys():
        return noted or None
    listed = found.get(FILES, [])
    if not isinstance(listed, list):
        return noted or None
    return noted | {str(name) for name in listed} | {RESULT} if FILES in found else frozenset()


def _read(file: Path) -> Any:
    """Contents of a JSON file; None if it cannot be read, or is a link."""
    try:
        return None if file.is_symlink() else json.loads(read_bounded(file, _LARGEST))
    except (OSError, ValueError, RecursionError):
        return None


def _unwritable(directory: Path, error: OSError) -> InputError:
    what = f"cannot be written: {error.strerror or error}"
    return InputError(
        Problem(str(error.filename or directory), what, "", "free some space, or give another -o")
    )


def write_files(
    directory: Path, files: Mapping[str, Content], inputs: Collection[Path], beside: Iterable[str] = ()
) -> tuple[Path, ...]:
    """Write files into a folder, which is created if necessary.

    Parameters
    ----------
    directory : Path
    files : mapping of str to Content
        By name; result.json first, so that after a failure half way the files beside it are recognised as bushcli's.
    inputs : collection of Path
        Files that the case reads.
    beside : iterable of str
        Names of files that were written already, such as fields.

    Returns
    -------
    tuple of Path
        The files written.

    Raises
    ------
    InputError
        The folder is a file or cannot be written, or a file to be replaced is not bushcli's.
    """
    if directory.exists() and not directory.is_dir():
        raise InputError(Problem(str(directory), "is a file", "", _FOLDER))
    refuse_others(directory, files, inputs)
    before = owned(directory) or frozenset()
    listed = sorted({*before, *files, *beside})
    try:
        directory.mkdir(parents=True, exist_ok=True)
        listed = [name for name in listed if name in files or os.path.lexists(directory / name)]
        for name, content in files.items():
            _replace(directory / name, _writer(content, listed))
        if RESULT in files:
            release(directory)
    except OSError as error:
        raise _unwritable(directory, error) from None
    return tuple(directory / name for name in files)


def _writer(content: Content, listed: list[str]) -> Callable[[Path], None]:
    if not isinstance(content, Mapping):
        return content
    text = json.dumps({**content, FILES: listed}, indent=2, allow_nan=False) + "\n"

    def write(path: Path) -> None:
        path.write_text(text, encoding="utf-8")

    return write


def _replace(path: Path, write: Callable[[Path], None]) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.unlink(missing_ok=True)
        # Created exclusively, in case somebody has placed a link of this name.
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW, 0o666))
        write(part)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
