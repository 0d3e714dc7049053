"""Generalised force: the residual acting on the derivative of the sleeve's motion with respect to q.

Virtual work of the assembled out-of-balance forces. It needs no surface integral, and it is as accurate as the energy.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from cases.model import Array, FiniteElementModel
from cases.motion import pose_motion_of
from cases.ranks import sum_over_ranks
from cases.six import possible


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
    return float(sum_over_ranks(model.comm, work)) * model.multiplicity


def reactions(model: FiniteElementModel, residual: PETSc.Vec, q: float) -> Array:
    """Force and moment that hold the sleeve, (6,) in N and N mm, about its centre.

    Parameters
    ----------
    model
        Model of a path of six motions, at an equilibrium or an iterate on the way to one.
    residual
        Assembled by `System.residual` there, nothing cleared.
    q
        Path's parameter, s.
    """
    constrained = model.motion.constrained.dofs
    owned = constrained < model.system.owned
    work = pose_motion_of(model.motion).twists(q)[:, owned] @ residual.array_r[constrained[owned]]
    return _clear_mirrored(model, np.asarray(sum_over_ranks(model.comm, work)) * model.multiplicity)


def _clear_mirrored(model: FiniteElementModel, values: Array) -> Array:
    """Clear the values of motions that planes of symmetry rule out: forces of the other half cancel them."""
    mask = np.zeros(6)
    mask[list(possible(model.mesh.mirrors))] = 1.0
    return np.asarray(mask * values)
