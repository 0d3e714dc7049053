"""PETSc's SNES for Newton's method, with the factorisation that is fastest for the system's size."""

from __future__ import annotations

from petsc4py import PETSc

from cases.border import Border
from cases.model import FiniteElementModel
from cases.small import MOST_UNKNOWNS as MOST_SMALL
from cases.small import Small

# Largest number of unknowns of a half-plane that PETSc factorises itself, in an order by nested dissection. MUMPS needs
# 0.15 ms before a back-substitution begins, more than the substitution itself: 20 steps with 741 unknowns took 67 ms
# instead of 103 (back-substitutions 6 instead of 28, factorisations 2.8 instead of 5.4), and with 2775 unknowns 0.83 of
# the time; with 6105 MUMPS is faster. In space it is faster already with 2597 unknowns (15 ms for 41).
MOST_IN_PLANE = 3000
# Where MUMPS says how many negative eigenvalues a symmetric matrix has (INFOG).
NEGATIVE = 12


def newton_solver(model: FiniteElementModel, most: int, border: Border | None) -> PETSc.SNES:
    """Return the solver, without function, Jacobian and convergence test.

    Parameters
    ----------
    model
        Model whose tangent it factorises.
    most
        Largest number of iterations.
    border
        Equations of the free motions of the sleeve; None where there are none.
    """
    snes = PETSc.SNES().create(model.comm)
    snes.setTolerances(max_it=most)
    snes.setType("newtonls")
    prefix = "bushcli_"
    snes.setOptionsPrefix(prefix)
    # The secant search minimises the residual along the step. Backtracking only asks for a decrease, which
    # the saddle point of u and p refuses too often: radial loads then stop at 42 % of the thickness.
    PETSc.Options()[prefix + "snes_linesearch_type"] = "l2"
    ksp = snes.getKSP()
    ksp.setType("preonly")
    alone, unknowns = model.comm.size == 1, model.system.owned
    if border is not None or (alone and unknowns <= MOST_SMALL):
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(Small() if border is None else border)
    else:
        ksp.getPC().setType("cholesky")
        compressible = float(model.compliance.value) > 0.0
        if alone and compressible and model.mesh.dimension == 2 and unknowns <= MOST_IN_PLANE:
            # L D L^T without exchange of rows. With a finite bulk modulus the pressures' block is negative definite,
            # so that every order of elimination has a factorisation while the rubber is stable (Vanderbei 1995,
            # doi:10.1137/0805005); where it is not, residuals of 3753 solutions were below 4e-11 (1e-15 usually).
            ksp.getPC().setFactorSolverType("petsc")
            ksp.getPC().setFactorOrdering("nd")
        else:
            ksp.getPC().setFactorSolverType("mumps")
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
    return negative_eigenvalues(ksp) > model.system.free_pressures


def negative_eigenvalues(ksp: PETSc.KSP) -> int:
    """Return how many negative eigenvalues a factorised tangent has, on all ranks together."""
    if ksp.getPC().getType() == PETSc.PC.Type.PYTHON:
        context: Small = ksp.getPC().getPythonContext()
        return context.negative_eigenvalues()
    factor = ksp.getPC().getFactorMatrix()
    mumps = ksp.getPC().getFactorSolverType() == "mumps"
    return int(factor.getMumpsInfog(NEGATIVE) if mumps else factor.getInertia()[0])
