"""Evaluations on disk, so that a run that was killed goes on where it was.

One line of JSON per evaluation. The file is replaced as a whole, atomically, after every evaluation: whenever the
process dies, it holds all evaluations before the last. The optimisers are deterministic: fed with the kept answers
they take the same path, and end with the same result.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.inverse.channel import Answer

Array = NDArray[np.float64]


class Journal:
    """Kept evaluations of one identification.

    Parameters
    ----------
    file
        Where they are kept.
    identity
        What the run is of; a file of another run is refused.
    resume
        Use what the file holds; otherwise a new one is begun.

    Attributes
    ----------
    failure : str
        Why the last evaluation could not be kept on disk; empty where it was.

    Raises
    ------
    InputError
        The file is of another case, law or version.
    """

    def __init__(self, file: Path, identity: Mapping[str, Any], resume: bool) -> None:
        self.file = file
        self.identity = hashlib.sha256(json.dumps(identity, sort_keys=True, default=str).encode()).hexdigest()
        self._lines = [json.dumps({"identity": self.identity})]
        self._known: dict[bytes, list[Answer]] = {}
        self.failure = ""
        if resume and file.exists():
            self._read()

    def _read(self) -> None:
        try:
            lines = self.file.read_text(encoding="utf-8").splitlines()
            head, *rest = (json.loads(line) for line in lines)
            if head["identity"] != self.identity:
                raise InputError(
                    Problem(
                        str(self.file),
                        "is of another case, law or option",
                        "",
                        "the run to go on with, unchanged",
                    )
                )
            for row in rest:
                answers = [Answer(*(np.array(part) for part in answer)) for answer in row["answers"]]
                self._known[np.array(row["x"]).tobytes()] = answers
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OSError) as error:
            what = f"is damaged, or not a history of a run ({str(error)[:200]})"
            expected = "the file as the run left it; or go without --resume, which begins a new one"
            raise InputError(Problem(str(self.file), what, "", expected)) from None
        self._lines = lines

    def find(self, x: Array) -> list[Answer] | None:
        """Answers kept for exactly these parameters (empty: the march had failed), or None."""
        return self._known.get(np.ascontiguousarray(x, dtype=float).tobytes())

    def add(self, x: Array, answers: list[Answer]) -> None:
        """Keep an evaluation, on disk before this returns; where that fails, `failure` says so."""
        self._known[np.ascontiguousarray(x, dtype=float).tobytes()] = answers
        parts = [
            [p.tolist() for p in (a.displacement, a.force, a.slope, a.states) if p is not None]
            for a in answers
        ]
        self._lines.append(json.dumps({"x": x.tolist(), "answers": parts}))
        fresh = self.file.with_suffix(f".{os.getpid()}.part")
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            with fresh.open("w", encoding="utf-8") as out:
                out.write("\n".join(self._lines) + "\n")
                out.flush()
                os.fsync(out.fileno())
            fresh.replace(self.file)
            self.failure = ""
        except OSError as error:
            # What was computed is worth more than the means of going on with it.
            self.failure = error.strerror or str(error)
            with suppress(OSError):
                fresh.unlink(missing_ok=True)
