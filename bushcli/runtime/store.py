"""Results of fits saved on disk, so that an interrupted diagnosis can be resumed.

Each result is one NumPy archive of plain arrays, so that reading it executes nothing. Its name is a digest of the
question and of the program's source: another question, or another revision of the code, has another file. A file that
is damaged counts as absent.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bushcli.errors import InputError, Problem
from bushcli.runtime.bounded import read_bounded
from bushcli.runtime.canonical import canonical
from bushcli.runtime.dolfinx_version import installed_dolfinx

SUFFIX = ".npz"
# Names that the store gives; other files in its folder are left alone.
_RESULT = re.compile(r"[0-9a-f]{24}\.npz")
_PART = re.compile(r"([0-9a-f]{24}|probe)\.\d+\.part")
# Bytes written to test the folder: as many as a result may need.
_PROBE = 100_000
PACKAGES = ("bushcli", "cases", "forms", "geometry")
# Largest admissible size of a result, bytes; the largest in use have some ten million.
_LARGEST = 1_000_000_000
# Errors that NumPy, its archives and the codecs raise for overwritten bytes.
_DAMAGED = (
    OSError,
    ValueError,
    OverflowError,
    MemoryError,  # of an array whose header claims more numbers than any answer has
    TypeError,
    LookupError,
    RuntimeError,
    AttributeError,
    EOFError,
    SyntaxError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


@cache
def code_revision() -> str:
    """Return the digest of the text of all modules of the program, those in C too, and of the solver's version."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256(str(installed_dolfinx()).encode())
    for package in PACKAGES:
        for file in sorted(
            path for path in (root / package).rglob("*") if path.suffix in {".py", ".c", ".h"}
        ):
            digest.update(file.relative_to(root).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def holds_results(folder: Path) -> bool:
    """Whether a folder holds results of a store, of whatever question."""
    return any(_RESULT.fullmatch(file.name) for file in folder.iterdir())


def _version(file: Path) -> tuple[int, int]:
    """Return what changes when a file is replaced: its number in the file system and the time of writing, ns."""
    status = file.lstat()
    return status.st_ino, status.st_mtime_ns


def _write_to_disk(file: Path, content: bytes) -> None:
    with file.open("wb") as out:
        out.write(content)
        out.flush()
        os.fsync(out.fileno())


class Codec(Protocol):
    """How the answers of one kind of work are written as arrays; an object that can be pickled, for other processes."""

    def encode(self, answer: Any) -> dict[str, Any]:
        """Return the answer as plain arrays by name."""

    def decode(self, arrays: dict[str, Any], question: tuple[Any, ...]) -> Any:
        """Return the answer to a question from its arrays.

        Raises
        ------
        Exception
            The arrays are not those of an answer: it counts as absent.
        """


class Store:
    """A folder of results.

    Parameters
    ----------
    folder
    codec
        How answers become arrays.
    resume
        Use the results in the folder; without it, those that are asked for are calculated again and replaced. Those of
        other questions stay in either case.

    Attributes
    ----------
    there : int
        Number of results that the folder held.
    used : set of str
        Names of those that have been used.
    damaged : int
        Number of results that this process found damaged; they are calculated again.

    Raises
    ------
    InputError
        The folder cannot be made, or a file that an interrupted run left in it cannot be removed.
    """

    def __init__(self, folder: Path, codec: Codec, resume: bool = False) -> None:
        self.folder, self.codec = folder, codec
        if folder.is_symlink():
            what = "is a symbolic link, which is not followed"
            raise InputError(Problem(str(folder), what, "", "give another -o"))
        try:
            folder.mkdir(parents=True, exist_ok=True)
            results = [file for file in folder.iterdir() if _RESULT.fullmatch(file.name)]
            for file in [file for file in folder.iterdir() if _PART.fullmatch(file.name)]:
                file.unlink()
            # What is there and not used is known by its version, so that other processes see when it was replaced.
            self._unused = {} if resume else {file.name: _version(file) for file in results}
        except OSError as error:
            place = str(error.filename or folder)
            what = f"cannot be written: {error.strerror or error}"
            raise InputError(Problem(place, what, "", "give another -o, or remove it")) from None
        self.there, self.damaged = len(results), 0
        self._found = frozenset(file.name for file in results) if resume else frozenset()
        self.used: set[str] = set()

    @property
    def resumes(self) -> bool:
        """Whether there are results of an earlier run that may be used."""
        return bool(self._found)

    def file(self, work: str, question: tuple[Any, ...]) -> Path:
        """Return the file that holds, or will hold, the answer to a question.

        Parameters
        ----------
        work : str
            Qualified name of the function that answers.
        question : tuple
            Its arguments.
        """
        digest = hashlib.sha256(f"{code_revision()} {work}".encode())
        digest.update(canonical(question))
        return self.folder / f"{digest.hexdigest()[:24]}{SUFFIX}"

    def read(self, file: Path, question: tuple[Any, ...]) -> tuple[bool, Any]:
        """Return whether the file holds an answer, and the answer.

        Parameters
        ----------
        file : Path
            As `file` returned it.
        question : tuple
            Arguments of the work, for decoding.
        """
        try:
            if file.is_symlink():
                raise ValueError("a symbolic link is not followed")
            if file.name in self._unused and self._unused[file.name] == _version(file):
                return False, None
            # Read completely first: a damaged archive would stay open.
            with np.load(io.BytesIO(read_bounded(file, _LARGEST)), allow_pickle=False) as arrays:
                answer = self.codec.decode({name: arrays[name] for name in arrays.files}, question)
            self.used |= {file.name} & self._found
            return True, answer
        except FileNotFoundError:
            return False, None
        except _DAMAGED:
            self.damaged += 1
            return False, None

    def write(self, file: Path, answer: Any) -> None:
        """Save an answer; the file appears whole or not at all.

        On a full disk the run goes on without saving: the answer matters more than that the run can be resumed.

        Parameters
        ----------
        file : Path
            As `file` returned it.
        answer : object
            What the codec can encode.
        """
        content = io.BytesIO()
        np.savez(content, **self.codec.encode(answer))
        fresh = file.with_suffix(f".{os.getpid()}.part")
        try:
            _write_to_disk(fresh, content.getvalue())
            fresh.replace(file)
        except OSError:
            # `failure` reports this at the end of the run; the code here may run in another process.
            with suppress(OSError):
                fresh.unlink(missing_ok=True)

    def failure(self) -> str:
        """Return why answers cannot be saved in the folder at present; empty if they can."""
        probe = self.folder / f"probe.{os.getpid()}.part"
        try:
            _write_to_disk(probe, bytes(_PROBE))
        except OSError as error:
            return error.strerror or str(error)
        finally:
            with suppress(OSError):
                probe.unlink(missing_ok=True)
        return ""


def history_of(folder: Path, is_of: Callable[[Path], bool], resume: bool | None) -> tuple[Path, bool]:
    """Return the folder for the saved results of a question, and whether those in it are used.

    A folder of another question is left alone: that of this question gets the same name with -2, -3 and so on.

    Parameters
    ----------
    folder : Path
        Its first name.
    is_of : callable
        Whether an existing folder holds results of the question.
    resume : bool or None
        True: use them; a folder that exists without any is returned, to be refused. False: begin anew in it. None:
        use them if there are any.
    """
    names = (folder if n == 1 else folder.with_name(f"{folder.name}-{n}") for n in count(1))
    for place in names:
        if not os.path.lexists(place):
            break
        real = place.is_dir() and not place.is_symlink()
        if real and is_of(place):
            return place, resume is not False
        if real and not any(place.iterdir()):
            break
    return (folder, True) if resume else (place, False)
