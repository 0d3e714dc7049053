"""Independent runs side by side: as many processes as asked for, results in the order of the questions.

A result is kept on disk as soon as it is there, under a name made of the question itself, so that a diagnosis that was
stopped goes on where it was, with any number of workers, to the same end.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

Work = Callable[..., Any]


class Workers:
    """Runs functions of module level on lists of arguments.

    Parameters
    ----------
    count
        Processes; with 1 everything runs in this one.
    folder
        Where results are kept; None keeps none.
    resume
        Use what the folder holds; it is emptied otherwise.
    """

    def __init__(self, count: int = 1, folder: Path | None = None, resume: bool = False) -> None:
        self.count, self.folder = max(1, count), folder
        self.reused = 0
        self._executor: ProcessPoolExecutor | None = None
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            if not resume:
                for file in folder.glob("*.result"):
                    file.unlink()

    @contextmanager
    def open(self) -> Iterator[Workers]:
        """Start the processes, and end them."""
        if self.count == 1:
            yield self
            return
        with ProcessPoolExecutor(self.count, mp_context=get_context("spawn")) as executor:
            self._executor = executor
            yield self

    def run(
        self, work: Work, questions: Sequence[tuple[Any, ...]], told: Callable[[int, Any], None] | None = None
    ) -> list[Any]:
        """Answers to all questions, in their order; `told` hears of each as it is there."""
        answers: list[Any] = [None] * len(questions)
        waiting = []
        for i, question in enumerate(questions):
            file = self._file(work, question)
            if file is not None and file.exists():
                answers[i] = pickle.loads(file.read_bytes())
                self.reused += 1
                if told is not None:
                    told(i, answers[i])
            elif self._executor is None:
                answers[i] = self._keep(file, work(*question))
                if told is not None:
                    told(i, answers[i])
            else:
                waiting.append((i, file, self._executor.submit(work, *question)))
        for i, file, future in waiting:
            answers[i] = self._keep(file, future.result())
            if told is not None:
                told(i, answers[i])
        return answers

    def _file(self, work: Work, question: tuple[Any, ...]) -> Path | None:
        if self.folder is None:
            return None
        # Effects are found by name: what they are made of is no part of the question.
        name = hashlib.sha256(f"{work.__module__}.{work.__qualname__}".encode() + pickle.dumps(question))
        return self.folder / f"{name.hexdigest()[:24]}.result"

    def _keep(self, file: Path | None, answer: Any) -> Any:
        if file is not None:
            fresh = file.with_suffix(f".{os.getpid()}.part")
            with fresh.open("wb") as out:
                out.write(pickle.dumps(answer))
                out.flush()
                os.fsync(out.fileno())
            fresh.replace(file)
        return answer
