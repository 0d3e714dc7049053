"""Saved evaluations of an identification, from which an interrupted run continues.

Each evaluation is one file of the store (`bushcli.runtime.store`), on disk before the search goes on: whenever the
process dies, all evaluations but the last are there. The optimisers are deterministic: with the saved answers they take
the same path and end with the same result. An evaluation that is damaged, or was made by another revision of the code,
is calculated again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.inverse.channel import ChannelForces
from bushcli.runtime.bounded import read_bounded
from bushcli.runtime.store import Store, history_of

Array = NDArray[np.float64]

# Text file beside the evaluations that identifies their run.
RUN = "run.json"
# Largest admissible size of that file, bytes: ours have some hundred.
_LARGEST = 10_000
_DAMAGED = (ValueError, LookupError, TypeError, RecursionError, OSError)
_WORK = "bushcli.inverse.journal.evaluation"


class AnswersCodec:
    """Converts the answers of all channels at one vector of parameters to arrays and back; none if the march failed."""

    def encode(self, answers: list[ChannelForces]) -> dict[str, Any]:
        """Return the arrays of the answers by channel and field."""
        arrays: dict[str, Any] = {"channels": np.array(len(answers))}
        for i, answer in enumerate(answers):
            arrays |= {f"{i}.{field}": value for field, value in vars(answer).items() if value is not None}
        return arrays

    def decode(self, arrays: dict[str, Any], question: tuple[Any, ...]) -> list[ChannelForces]:
        """Return the answers from their arrays."""
        answers = []
        for i in range(int(arrays["channels"])):
            q, force, slope = (arrays[f"{i}.{field}"] for field in ("displacement", "force", "slope"))
            answers.append(ChannelForces(q, force, slope, arrays.get(f"{i}.states")))
        return answers


def open_journal(folder: Path, identity: Mapping[str, Any], resume: bool | None) -> Journal:
    """Return the saved evaluations of an identification, in the folder that holds them or may hold them."""

    def is_of(candidate: Path) -> bool:
        try:
            return identity_in(candidate / RUN) == digest(identity)
        except _DAMAGED:
            return False

    chosen, used = history_of(folder, is_of, resume)
    return Journal(chosen, identity, used)


def identity_in(file: Path) -> str:
    """Return the identity of the run whose evaluations are beside the file; one of `_DAMAGED` if it cannot be read."""
    return str(json.loads(read_bounded(file, _LARGEST))["identity"])


def digest(identity: Mapping[str, Any]) -> str:
    """Return a digest of what determines the answers of an identification."""
    return hashlib.sha256(json.dumps(identity, sort_keys=True, default=str).encode()).hexdigest()


class Journal:
    """Saved evaluations of one identification, in a folder.

    The identity is all that determines the answers, ready for JSON. A folder of another case, law or option is refused;
    its evaluations are deleted unless the run resumes.
    """

    def __init__(self, folder: Path, identity: Mapping[str, Any], resume: bool) -> None:
        self.folder = folder
        self.identity = digest(identity)
        self._index = folder / RUN
        if resume and self._index.exists():
            self._check()
        self._store = Store(folder, AnswersCodec(), resume)
        self._known: dict[bytes, list[ChannelForces]] = {}
        self._write_index()

    def _refusal(self, what: str, expected: str = "give another -o") -> InputError:
        return InputError(Problem(str(self._index), what, "", expected))

    def _check(self) -> None:
        """Refuse evaluations of another run."""
        try:
            identity = identity_in(self._index)
        except _DAMAGED as error:
            expected = "restore the file, or run without --resume, which begins a history of its own"
            raise self._refusal(f"is damaged ({str(error)[:200]})", expected) from None
        if identity != self.identity:
            expected = "the case, law and options of that run; or leave --resume out"
            raise self._refusal("was saved by a run of another case, law or options", expected)

    def _write_index(self) -> None:
        text = json.dumps({"identity": self.identity, "contents": "evaluations of bushcli inverse"})
        try:
            if self._index.is_symlink():
                raise self._refusal("is a symbolic link, which is not followed")
            # A file that was written here begins like this, even if it is damaged.
            if self._index.exists() and not read_bounded(self._index, _LARGEST).startswith(b'{"identity": '):
                raise self._refusal("exists already and was not written by an earlier run")
            self._index.write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise self._refusal(f"cannot be written: {error.strerror or error}", "") from None

    @property
    def failure(self) -> str:
        """Why evaluations cannot be saved at present; empty if they can."""
        return self._store.failure()

    @property
    def damaged_entries(self) -> int:
        """Number of saved evaluations that were found damaged and calculated again."""
        return self._store.damaged

    def find(self, x: Array) -> list[ChannelForces] | None:
        """Return the answers saved for exactly these parameters, none if the march failed; None if nothing is saved."""
        question = self._question(x)
        stored_answers = self._known.get(question[1].tobytes())
        if stored_answers is not None:
            return stored_answers
        stored, answers = self._store.read(self._store.file(_WORK, question), question)
        return answers if stored else None

    def add(self, x: Array, answers: list[ChannelForces]) -> None:
        """Save an evaluation, on disk before this returns; where that fails, `failure` says so."""
        question = self._question(x)
        self._known[question[1].tobytes()] = answers
        self._store.write(self._store.file(_WORK, question), answers)

    def _question(self, x: Array) -> tuple[str, Array]:
        return self.identity, np.ascontiguousarray(x, dtype=float)
