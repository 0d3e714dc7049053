"""One block of quadrilaterals over a section with four sides: bond, free end, bond, free end."""

from __future__ import annotations

from geometry.raw import RawMesh
from geometry.section.draw import Drawn
from geometry.shape import Refinement


def block(drawn: Drawn, thickness: float, refinement: Refinement, solid: bool) -> RawMesh | None:
    """Mesh of a section that has four sides, with elements that are none too skew; None for any other."""
    return None
