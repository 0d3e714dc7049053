"""d(force)/d(parameter) along the march, exactly, from the tangent's solution.

At equilibrium the force is the derivative of the stored energy along the path of equilibria, Q = dPi/dq, and the
residual vanishes in every direction that leaves the sleeves where they are. Differentiating with respect to a
parameter leaves dQ/dc = v . dR/dc with v = d(u, p)/dq, the tangent's answer to a motion of the sleeve: one
back-substitution for all parameters together, then one scalar per parameter. Holds for laws without history.

References
----------
Michaleris, Tortorelli and Vidal (1994), Int. J. Numer. Methods Eng. 37:2471-2499, doi:10.1002/nme.1620371408.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray

from cases.jit import options
from cases.model import Model

Array = NDArray[np.float64]


class Sensitivity:
    """Derivatives of a model's force with respect to its parameters.

    Parameters
    ----------
    model
        The model; its law must not depend on history.
    names
        Law parameters, and "compliance" (1 / bulk modulus, 1/MPa).
    """

    def __init__(self, model: Model, names: Iterable[str]) -> None:
        self.model = model
        self.names = tuple(names)
        self._rate = fem.Function(model.space)
        self._forms = [
            fem.form(model.potential.parameter_force(name, self._rate), jit_options=options())
            for name in self.names
        ]

    def __call__(self, rate: Array) -> Array:
        """Derivative of the force with respect to each parameter, shape (names,), at the present equilibrium.

        Parameters
        ----------
        rate
            d(u, p)/dq over this rank's unknowns.
        """
        self._rate.x.array[:] = rate
        parts = np.array([fem.assemble_scalar(form) for form in self._forms])
        return np.asarray(self.model.comm.allreduce(parts)) * self.model.multiplicity
