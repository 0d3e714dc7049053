"""Broyden's method: corrections computed with a factorisation from an earlier step.

References
----------
Broyden (1965), Math. Comput. 19:577-593, doi:10.1090/S0025-5718-1965-0198670-6.
Kelley (1995), Iterative Methods for Linear and Nonlinear Equations, SIAM, section 7.3,
doi:10.1137/1.9781611970944.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from petsc4py import PETSc

# If a correction has to be scaled up by more than this, the factorisation is too old to be of use.
LONGEST = 10.0


def broyden_step(ksp: PETSc.KSP, b: PETSc.Vec, steps: Sequence[tuple[PETSc.Vec, float]]) -> PETSc.Vec | None:
    """Return the next step, from the old factorisation and corrected by all previous steps; None if it is too long.

    Parameters
    ----------
    ksp
        Solver with the present factorisation.
    b
        Residual.
    steps
        Previous steps, each with the square of its norm (the unit of the unknowns, squared).
    """
    step = b.duplicate()
    ksp.solve(b, step)
    step.scale(-1.0)
    for (before, square), (after, _) in pairwise(steps):
        step.axpy(before.dot(step) / square, after)
    if steps:
        last, square = steps[-1]
        share = 1.0 - last.dot(step) / square
        if not share * LONGEST > 1.0:
            step.destroy()
            return None
        step.scale(1.0 / share)
    return step
