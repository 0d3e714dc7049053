"""The edge of a law's stability beside a fitted model: optima are predicted within it, because fits end there.

A law is stable where the tangent moduli H of every state that the rubber reaches are positive definite. For a vector v,
v H v is linear in the parameters of the polynomial laws: a law beyond the edge violates a linear condition, a cutting
plane, with v the eigenvector of the smallest modulus there. For other laws it is linearised at the fit.

References
----------
Kelley (1960), J. Soc. Indust. Appl. Math. 8:703-712, doi:10.1137/0108053.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.problem import (
    ACTIVE,
    STABILITY_EDGE,
    STABILITY_MARGIN,
    differences,
    penalty,
    smallest_moduli,
)
from bushcli.selection.state import State
from bushcli.selection.tangent_space import Cuts
from cases.stability import moduli
from forms.law import Law

Array = NDArray[np.float64]

# Halvings of the way from the fit to parameters at which the law has no moduli (Gent beyond locking). That is a
# thousandth of the way.
_HALVINGS = 10


@dataclass
class LawEdge:
    """Conditions on the parameters of a fitted model, under which its law is stable.

    Attributes
    ----------
    optimum : shape (p,)
        To first order, of the fitted model itself.
    cuts : Cuts
        Conditions found so far, MPa; the law is stable where their values are no less than zero.
    """

    state: State
    optimum: Array
    cuts: Cuts = field(init=False)

    def __post_init__(self) -> None:
        self.cuts = Cuts(np.zeros((0, len(self.state.fitted.x))), np.zeros(0))

    @cached_property
    def is_active(self) -> bool:
        """Whether the law's stability holds the fit back.

        So it does where the fit has ended at the edge, or before an optimum that is beyond it. Where it does not, the
        edge is far, and the way there is not one to predict: with other effects the rubber reaches other stretches. A
        single parameter only scales the law.
        """
        fitted = self.state.fitted
        if not len(fitted.states) or sum(name in self.state.model.start for name in fitted.names) < 2:
            return False
        if penalty(self._smallest_moduli(fitted.x)).max() > ACTIVE:
            return True
        return bool(self.margins(self.optimum).min() < -STABILITY_EDGE)

    def margins(self, x: Array) -> Array:
        """Margin (n,) in each state with parameters x (p,), in shear moduli, negative beyond the edge."""
        return self._smallest_moduli(x) - STABILITY_MARGIN

    def cut_off(self, x: Array) -> bool:
        """Add the condition that parameters x (p,) violate; return whether the law is unstable with them."""
        if not self.is_active:
            return False
        margins = self.margins(x)
        worst = int(np.argmin(margins))
        if margins[worst] >= -STABILITY_EDGE:
            return False
        states, fitted = self.state.fitted.states[[worst]], self.state.fitted.x
        for halvings in range(_HALVINGS + 1):
            (tangent,) = moduli(self._law, self._values(fitted + (x - fitted) / 2**halvings), states)
            if np.isfinite(tangent).all():
                break
        else:
            return False
        v = np.linalg.eigh(tangent)[1][:, 0]

        def side(at: Array) -> Array:
            values = self._values(at)
            (tangent,) = moduli(self._law, values, states)
            return np.array([v @ tangent @ v - STABILITY_MARGIN * self._law.shear_modulus(**values)])

        self.cuts = self.cuts.with_condition(differences(side, fitted)[0], float(side(fitted)[0]))
        return True

    def _smallest_moduli(self, x: Array) -> Array:
        return smallest_moduli(self._law, self._values(x), self.state.fitted.states)

    @cached_property
    def _law(self) -> Law:
        return self.state.model.task(self.state.problem.case).law

    def _values(self, x: Array) -> dict[str, float]:
        """Parameters of the law, by name."""
        return dict(self.state.model.at(dict(zip(self.state.fitted.names, map(float, x), strict=True))).start)
