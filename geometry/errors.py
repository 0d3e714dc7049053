"""Errors of a geometry, in a sentence and, where it helps, with a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry.view import View


class GeometryError(Exception):
    """An outline or a CAD file that does not describe a bushing.

    Parameters
    ----------
    where
        File, or key of the case.
    what
        The finding, as one sentence without a full stop.
    expected
        Description of valid input, or empty.
    view
        Contents of a picture; None where nothing could be drawn.
    """

    def __init__(self, where: str, what: str, expected: str = "", view: View | None = None) -> None:
        super().__init__(where, what, expected, view)
        self.where, self.what, self.expected, self.view = where, what, expected, view

    def __str__(self) -> str:
        """Return ``where: what (expected)``."""
        return f"{self.where}: {self.what}" + (f" ({self.expected})" if self.expected else "")
