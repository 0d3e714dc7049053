"""PETSc's SNES for Newton's method, with a factorisation by MUMPS, or dense elimination of a small system."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

from cases.border import Border
from cases.small import MOST as MOST_SMALL
from cases.small import Small


def newton_solver(comm: Any, most: int, unknowns: int, border: Border | None) -> PETSc.SNES:
    """Return the solver, without function, Jacobian and convergence test.

    Parameters
    ----------
    comm
        MPI communicator.
    most
        Largest number of iterations.
    unknowns
        Number of unknowns.
    border
        Equations of the free motions of the sleeve; None where there are none.
    """
    snes = PETSc.SNES().create(comm)
    snes.setTolerances(max_it=most)
    snes.setType("newtonls")
    prefix = "bushcli_"
    snes.setOptionsPrefix(prefix)
    # The secant search minimises the residual along the step. Backtracking only asks for a decrease, which
    # the saddle point of u and p refuses too often: radial loads then stop at 42 % of the thickness.
    PETSc.Options()[prefix + "snes_linesearch_type"] = "l2"
    ksp = snes.getKSP()
    ksp.setType("preonly")
    small = comm.size == 1 and unknowns <= MOST_SMALL
    if border is None and not small:
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("mumps")
    else:
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(Small() if border is None else border)
    snes.setFromOptions()
    PETSc.Options().delValue(prefix + "snes_linesearch_type")
    return snes
