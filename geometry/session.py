"""Gmsh sessions: the only place that opens and closes one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from geometry.errors import GeometryError
from geometry.view import View


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


@contextmanager
def convert_errors(where: str, what: str, view: View | None = None) -> Iterator[None]:
    """Convert the bare exceptions of Gmsh into `GeometryError`.

    Parameters
    ----------
    where
        File, or key of the case.
    what
        The finding; Gmsh's own words are appended.
    view
        Contents of a picture.

    Raises
    ------
    GeometryError
    """
    try:
        yield
    except GeometryError:
        raise
    except Exception as error:  # noqa: BLE001 - Gmsh raises nothing more precise
        words = str(error).strip().splitlines()
        raise GeometryError(
            where, f"{what}: {words[0] if words else 'Gmsh gives no reason'}", view=view
        ) from None


def model() -> Any:
    """The model of the open session."""
    import gmsh

    return gmsh.model


def options() -> Any:
    """The options of the open session."""
    import gmsh

    return gmsh.option
