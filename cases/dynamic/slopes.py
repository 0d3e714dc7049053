"""Derivatives of the reduced matrices by parameters of the model, which move the preloaded state too.

A stiffness is a stationary value x^T K x, so that its derivative by a parameter p is x^T (dK/dp) x, without those of x
and without an adjoint solution. But K is the tangent at a preload, whose state u depends on p as well: dK/dp = K_p +
K_u u_p. The movement u_p is exact: one back-substitution with the factorisation of K_eq (`Sensitivity.movements`).
Along it the matrices are differenced, at p and u(p) a little to either side: products with the few vectors of the
basis, where exact third derivatives of the energy would need kernels of their own for the law, its volumetric part,
sleeves and surfaces, to no use. Neither another march nor another factorisation is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cases.dynamic.reduction import Change, VectorBasis
from cases.equilibrium import Equilibrium
from cases.load import PrescribedForce
from cases.sensitivity import Sensitivity

Array = NDArray[np.float64]

# Step of the differences, relative: the matrices are smooth, and are exact to rounding at both ends.
STEP = 1e-4


@dataclass(frozen=True)
class Changes:
    """Derivatives of the reduced matrices and of the static force (N or N mm) by parameters, in the order of names."""

    names: tuple[str, ...] = ()
    matrices: tuple[Change, ...] = ()
    force: Array = field(default_factory=lambda: np.zeros(0))


def changes(
    basis: VectorBasis, solver: Equilibrium, names: Sequence[str], drive: PrescribedForce | None = None
) -> Changes:
    """Return the derivatives by parameters of the model at the equilibrium of a basis.

    Parameters
    ----------
    basis : VectorBasis
        Of one motion; its pencil has just been made.
    solver : Equilibrium
        Solver that has found the equilibrium.
    names : sequence of str
        Parameters of the model, as in `cases.sensitivity.Sensitivity`.
    drive : PrescribedForce or None
        Given if the preload is a force.
    """
    pencil, model = basis.pencil, basis.pencil.model
    movements, rates, force = Sensitivity(model, names).movements(solver, basis.vectors[0], drive)
    state, derivatives = model.state.x.array.copy(), []
    for name, movement, rate in zip(names, movements, rates, strict=True):
        value = float(model.constants[name].value)
        step = STEP * max(abs(value), 1e-3)
        ends = []
        for d in (step, -step):
            model.parameters.set({name: value + d})
            model.state.x.array[:] = state + d * movement
            ends.append(vars(basis.at(pencil.at(solver.q + d * rate))))
        model.parameters.set({name: value})
        derivatives.append(Change(**{key: (ends[0][key] - ends[1][key]) / (2.0 * step) for key in ends[0]}))
    model.state.x.array[:] = state
    model.system.stiffen()
    return Changes(tuple(names), tuple(derivatives), force)
