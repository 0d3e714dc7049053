"""Results of fits kept on disk, so that a diagnosis that was stopped goes on where it was.

Each result is one NumPy archive of plain arrays, which nothing executes when it is read. Its name is made of the
question and of the code's own text: another question, or another revision of the code, is another file. A file that is
damaged counts as absent.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import struct
import zipfile
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bushcli.diagnosis.canonical import canonical
from bushcli.diagnosis.model import Fitted
from bushcli.errors import InputError, Problem

SUFFIX = ".npz"
PACKAGES = ("bushcli", "cases", "forms", "geometry")
# What NumPy, its archives and our own reading make of bytes that were overwritten.
_DAMAGED = (
    OSError,
    ValueError,
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
    """Digest of the text of all modules of the program."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in PACKAGES:
        for file in sorted((root / package).rglob("*.py")):
            digest.update(file.relative_to(root).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


class Store:
    """A folder of results.

    Parameters
    ----------
    folder
    resume
        Use what the folder holds; it is emptied otherwise.

    Attributes
    ----------
    there : int
        Results that the folder held: those to go on with, or those thrown away.

    Raises
    ------
    InputError
        The folder cannot be made or emptied.
    """

    def __init__(self, folder: Path, resume: bool = False) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            results = list(folder.glob(f"*{SUFFIX}"))
            for file in [*folder.glob("*.part"), *([] if resume else results)]:
                file.unlink()
        except OSError as error:
            place = str(error.filename or folder)
            raise InputError(Problem(place, f"cannot be written: {error.strerror or error}")) from None
        self.there = len(results)

    def file(self, work: str, question: tuple[Any, ...]) -> Path:
        """Where the answer to a question is kept."""
        digest = hashlib.sha256(f"{code_revision()} {work}".encode())
        digest.update(canonical(question))
        return self.folder / f"{digest.hexdigest()[:24]}{SUFFIX}"

    @staticmethod
    def read(file: Path, question: tuple[Any, ...]) -> tuple[bool, Any]:
        """Whether there is an answer, and the answer."""
        try:
            # Read at once: a damaged archive would stay open.
            with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as found:
                return True, _decoded({name: found[name] for name in found.files}, question)
        except _DAMAGED:
            return False, None

    @staticmethod
    def write(file: Path, answer: Any) -> None:
        """Keep an answer; the file appears whole or not at all."""
        content = io.BytesIO()
        np.savez(content, **_encoded(answer))
        fresh = file.with_suffix(f".{os.getpid()}.part")
        with fresh.open("wb") as out:
            out.write(content.getvalue())
            out.flush()
            os.fsync(out.fileno())
        fresh.replace(file)


def _encoded(answer: Any) -> dict[str, Any]:
    """An answer as arrays: a fit, a tuple of arrays, or nothing."""
    if answer is None:
        return {"kind": np.array("nothing")}
    if isinstance(answer, Fitted):
        about = {
            "names": list(answer.names),
            "values": answer.values,
            "converged": answer.converged,
            "solves": answer.solves,
            "failed": answer.failed,
            "channels": len(answer.simulated),
        }
        arrays = {f"simulated{i}": one for i, one in enumerate(answer.simulated)}
        arrays |= {f"jacobian{i}": one for i, one in enumerate(answer.jacobians)}
        return {"kind": np.array("fit"), "about": np.array(json.dumps(about)), "x": answer.x, **arrays}
    arrays = {f"array{i}": np.asarray(one) for i, one in enumerate(answer)}
    return {"kind": np.array("arrays"), "count": np.array(len(arrays)), **arrays}


def _decoded(found: dict[str, Any], question: tuple[Any, ...]) -> Any:
    kind = str(found["kind"])
    if kind == "nothing":
        return None
    if kind == "arrays":
        return tuple(found[f"array{i}"] for i in range(int(found["count"])))
    about = json.loads(str(found["about"]))
    each = range(int(about["channels"]))
    # The model is the question's, with other values.
    return Fitted(
        question[1].at(about["values"]),
        tuple(about["names"]),
        found["x"],
        tuple(found[f"simulated{i}"] for i in each),
        tuple(found[f"jacobian{i}"] for i in each),
        bool(about["converged"]),
        int(about["solves"]),
        int(about["failed"]),
    )
