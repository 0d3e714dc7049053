"""Gmsh sessions: the only place where one opens and closes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def session() -> Iterator[None]:
    """A Gmsh session with an empty model; sessions do not nest.

    Raises
    ------
    RuntimeError
        A session is open already: closing the inner one would end the outer one too.
    """
    import gmsh

    if gmsh.isInitialized():
        raise RuntimeError("a Gmsh session is open already")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("bushing")
        yield
    finally:
        gmsh.finalize()


def model() -> Any:
    """The model of the open session."""
    import gmsh

    return gmsh.model
