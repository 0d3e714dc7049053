"""Generalised force: the residual acting on the derivative of the sleeve's motion with respect to q.

Virtual work of the assembled out-of-balance forces. It needs no surface integral, and it is as accurate as the energy.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from cases.model import Array, FiniteElementModel
from cases.ranks import summed


def reaction(model: FiniteElementModel, residual: PETSc.Vec, rate: Array) -> float:
    """Force Q (N, N mm, or MPa for a coupon) that holds the driven sleeve.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    residual : PETSc.Vec
        Assembled by `System.residual` at the present state, nothing cleared.
    rate : Array
        Derivative of this rank's unknowns by q, shape (m,), per mm or rad.
    """
    owned = model.system.owned_constrained
    work = float(np.dot(residual.array_r[owned], rate[owned]))
    return float(summed(model.comm, work)) * model.multiplicity
