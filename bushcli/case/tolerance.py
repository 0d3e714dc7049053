"""The band within which a simulated stiffness is accepted: percent, or a class of a drawing with its percent.

The literature accepts a simulated stiffness within 10 %, which is the default. Drawings give load-deflection
tolerances as classes D1 to D3 of the handbook of the Rubber Manufacturers Association (RMA, today ARPM, MO-1, section
on molded products). The meaning of a class depends on the hardness of the rubber and the thickness of its wall, and
the table is not public: the percentage is given on the drawing or in the handbook, and the case has to state it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """A tolerance on stiffness and force.

    Attributes
    ----------
    percent : float
        Percentage of the measured stiffness, and of the recorded force range.
    name : str
        The class on the drawing; empty where there is none.
    """

    percent: float = 10.0
    name: str = ""

    @property
    def band(self) -> float:
        """The tolerance as a share, 0.1 for 10 %."""
        return self.percent / 100.0

    @property
    def text(self) -> str:
        """The tolerance for use in a sentence: ``10 %``, ``D2 (15 %)``."""
        return f"{self.name} ({self.percent:g} %)" if self.name else f"{self.percent:g} %"


CLASSES = ("D1", "D2", "D3")
DEFAULT = Tolerance()
