"""Interruptions inside callbacks of PETSc, which turns every exception in a callback into its own error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from petsc4py import PETSc


class Callbacks:
    """Passes an interruption from the callbacks of a PETSc solver on to the caller of the solver."""

    def __init__(self) -> None:
        self._interrupt: KeyboardInterrupt | None = None

    @contextmanager
    def inside(self) -> Iterator[None]:
        """Remember an interruption that is raised inside a callback."""
        try:
            yield
        except KeyboardInterrupt as interrupt:
            self._interrupt = interrupt
            raise

    @contextmanager
    def around(self) -> Iterator[None]:
        """Raise the interruption in place of PETSc's error, around a call of the solver."""
        self._interrupt = None
        try:
            yield
        except PETSc.Error:
            if self._interrupt is not None:
                raise self._interrupt from None
            raise
