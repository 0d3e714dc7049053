"""What came of one solution for an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    """What came of one solution.

    Attributes
    ----------
    iterations
        Corrections of the state: Broyden's and Newton's.
    newton
        Newton's alone, by SNES; 0 where Broyden's were enough.
    reason
        SNES's, by name.
    """

    iterations: int
    newton: int
    reason: str

    @property
    def found(self) -> bool:
        """Whether it is an equilibrium."""
        return not self.reason.startswith("DIVERGED")
