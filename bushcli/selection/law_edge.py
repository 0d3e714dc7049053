"""The edge of a law's stability beside a fitted model: optima are predicted within it, because fits end there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.problem import differences
from bushcli.inverse.stability import STABILITY_EDGE, stability_margins
from bushcli.selection.state import State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LawEdge:
    """Margins of a fitted model's law in the states that the rubber reaches, as functions of the fitted parameters.

    Attributes
    ----------
    state : State
    """

    state: State

    @cached_property
    def is_possible(self) -> bool:
        """Whether the law can become unstable: a single parameter only scales it."""
        names = self.state.fitted.names
        return len(self.state.fitted.states) > 0 and sum(name in self.state.model.start for name in names) > 1

    def margins(self, x: Array) -> Array:
        """Margin (n,) in each state with parameters x (p,), in shear moduli, negative beyond the edge."""
        values = dict(zip(self.state.fitted.names, map(float, x), strict=True))
        law = self.state.model.task(self.state.problem.case).law
        return stability_margins(law, self.state.model.at(values).start, self.state.fitted.states)

    def beyond(self, x: Array) -> int | None:
        """Index of the state in which the law is the least stable with parameters x (p,); None if it is stable."""
        if not self.is_possible:
            return None
        margins = self.margins(x)
        least = int(np.argmin(margins))
        return least if margins[least] < -STABILITY_EDGE else None

    @cached_property
    def rows(self) -> tuple[Array, Array]:
        """Margins (n,) at the fitted parameters, and their derivatives (n, p)."""
        x = self.state.fitted.x
        return self.margins(x), differences(self.margins, x)
