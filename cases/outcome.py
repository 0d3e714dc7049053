"""Outcome of one attempt to solve for an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    """Outcome of one attempt to solve for an equilibrium.

    Attributes
    ----------
    iterations
        Corrections of the state: Broyden's and Newton's.
    newton
        Corrections by Newton's method alone, in SNES; 0 where Broyden's were enough.
    reason
        Name of SNES's reason.
    """

    iterations: int
    newton: int
    reason: str

    @property
    def found(self) -> bool:
        """Whether it is an equilibrium."""
        return not self.reason.startswith("DIVERGED")
