"""PETSc's SNES for Newton's method, with a factorisation by MUMPS."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

from cases.border import Border


def newton_solver(comm: Any, most: int, border: Border | None) -> PETSc.SNES:
    """Return the solver, without function, Jacobian and convergence test.

    Parameters
    ----------
    comm
        MPI communicator.
    most
        Largest number of iterations.
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
    if border is None:
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("mumps")
    else:
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(border)
    snes.setFromOptions()
    PETSc.Options().delValue(prefix + "snes_linesearch_type")
    return snes
