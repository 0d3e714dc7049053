"""PETSc's SNES for Newton's method, with a factorisation by MUMPS, or dense elimination of a small system."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

from cases.border import Border
from cases.model import FiniteElementModel
from cases.small import MOST_UNKNOWNS as MOST_SMALL
from cases.small import Small

# Where MUMPS says how many negative eigenvalues a symmetric matrix has (INFOG).
NEGATIVE = 12


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


def bends(model: FiniteElementModel, ksp: PETSc.KSP, matrix: PETSc.Mat) -> bool:
    """Whether a tangent with contact has more negative eigenvalues than pressures, factorising it.

    The energy then has no minimum in the displacements nearby, and Newton's step is not one of descent. Behind a
    surface that is due to the contact, whose pressure changes its direction: in the kidney STEP's void the tangents at
    the first guesses of steps had 6 to 98 negative eigenvalues too many, and without those of the contact's stiffness
    at single points none or a few. Newton's method then converges where it did not in 14 iterations.

    Parameters
    ----------
    model
        At the state of the tangent.
    ksp
        Solver with the factorisation.
    matrix
        The tangent.

    References
    ----------
    Waechter and Biegler (2006), On the implementation of an interior-point filter line-search algorithm for large-scale
    nonlinear programming, Math. Program. 106:25-57, doi:10.1007/s10107-004-0559-y (the same question to the same kind
    of factorisation, section 3.1).
    """
    contact = model.surfaces.acting
    if contact is None or not contact.touching:
        return False
    ksp.setOperators(matrix)
    ksp.setUp()
    return bool(ksp.getPC().getFactorMatrix().getMumpsInfog(NEGATIVE) > model.system.free_pressures)
