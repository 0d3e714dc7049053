"""Convergence: PETSc's reasons by name, and the smallest residual that rounding allows."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from cases.model import FiniteElementModel

REASONS = {
    value: name
    for name, value in vars(PETSc.SNES.ConvergedReason).items()
    if name.startswith(("CONVERGED_", "DIVERGED_"))
}


def rounding(model: FiniteElementModel) -> float:
    """Return several times the residual (N) that rounding errors of mu, springs and the sleeves' E leave over a face.

    In the half-plane a node stands for a whole circle, and sleeves leave ten times as much (measured up to E = 1e9
    MPa).
    """
    shear = model.shear_modulus
    metal = model.metal_modulus
    extent = float(model.comm.allreduce(np.ptp(model.mesh.mesh.geometry.x, axis=0).max(initial=0.0)))
    share = 5e-16 if model.mesh.dimension == 3 else 5e-15
    springs = sum(item.feature.springs for item in model.features)
    return ((1e-12 + 1e-16 * springs) * abs(shear) + share * metal) * extent**2
