"""Memory of the rubber: internal variables of all branches at the quadrature points.

The stored values are those at the beginning of the present step. A step that is cut back leaves them unchanged; an
accepted step replaces them by the values at its end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.body import Body

Array = NDArray[np.float64]


class Internal:
    """Internal variables of a body.

    Parameters
    ----------
    body
        Body whose rubber has the memory.
    """

    def __init__(self, body: Body) -> None:
        self._body = body

    def reset(self) -> None:
        """Forget all earlier deformation."""
        for branch in self._body.material.families:
            branch.reset()

    def commit(self, state: Array) -> None:
        """Accept a state, this rank's unknowns, as the end of the step."""
        self._body.rubber.look(state)
        self._body.material.commit()
