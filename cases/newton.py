"""Newton's method by PETSc's SNES, Broyden's between its steps, and the outcome of a solution.

The system is solved with the factorisation that is fastest for its size. In a small one, such as that of a coupon of
one element, MUMPS takes as long to prepare a back-substitution as dense elimination takes for all of it.

References
----------
Broyden (1965), Math. Comput. 19:577-593, doi:10.1090/S0025-5718-1965-0198670-6.
Kelley (1995), Iterative Methods for Linear and Nonlinear Equations, SIAM, section 7.3,
doi:10.1137/1.9781611970944.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.border import Border
from cases.model import FiniteElementModel

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
    serial, unknowns = model.comm.size == 1, model.system.owned
    if border is not None or (serial and unknowns <= MOST_SMALL):
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(Small() if border is None else border)
    else:
        ksp.getPC().setType("cholesky")
        compressible = float(model.compliance.value) > 0.0
        if serial and compressible and model.mesh.dimension == 2 and unknowns <= MOST_IN_PLANE:
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
    contact = model.surfaces.active_contact
    if contact is None or not contact.is_touching:
        return False
    ksp.setOperators(matrix)
    ksp.setUp()
    return negative_eigenvalues(ksp) > model.system.free_pressures


def negative_eigenvalues(ksp: PETSc.KSP) -> int:
    """Return how many negative eigenvalues the factorised tangent has, on all ranks together."""
    if ksp.getPC().getType() == PETSc.PC.Type.PYTHON:
        context: Small = ksp.getPC().getPythonContext()
        return context.negative_eigenvalues()
    factor = ksp.getPC().getFactorMatrix()
    mumps = ksp.getPC().getFactorSolverType() == "mumps"
    return int(factor.getMumpsInfog(NEGATIVE) if mumps else factor.getInertia()[0])


# Largest number of unknowns of dense elimination. A coupon has 25, for which it took 12 microseconds, a
# back-substitution by MUMPS some 100; for 64 unknowns dense elimination took 240.
MOST_SMALL = 32


class Small:
    """Dense elimination as PETSc's preconditioner."""

    def __init__(self) -> None:
        self._matrix: NDArray[np.float64] = np.zeros((0, 0))

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the entries of the matrix (called by PETSc)."""
        start, column, value = pc.getOperators()[0].getValuesCSR()
        count = len(start) - 1
        self._matrix = np.zeros((count, count))
        self._matrix[np.repeat(np.arange(count), np.diff(start)), column] = value

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve the system (called by PETSc).

        Parameters
        ----------
        pc : PETSc.PC
            The calling preconditioner; not used.
        b : PETSc.Vec
            Right-hand side; unchanged.
        x : PETSc.Vec
            Receives the solution; nan where the matrix is singular, by which the march recognises a failed step.
        """
        try:
            x.array_w[:] = np.linalg.solve(self._matrix, b.array_r)
        except np.linalg.LinAlgError:
            x.set(np.nan)

    def negative_eigenvalues(self) -> int:
        """Return how many negative eigenvalues the symmetric matrix has."""
        return int(np.count_nonzero(np.linalg.eigvalsh(self._matrix) < 0.0))


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
    for (previous, square), (following, _) in pairwise(steps):
        step.axpy(previous.dot(step) / square, following)
    if steps:
        last, square = steps[-1]
        share = 1.0 - last.dot(step) / square
        if not share * LONGEST > 1.0:
            step.destroy()
            return None
        step.scale(1.0 / share)
    return step


class Callbacks:
    """Passes an interruption from the callbacks of a PETSc solver on to the caller of the solver."""

    def __init__(self) -> None:
        self._interrupt: KeyboardInterrupt | None = None

    @contextmanager
    def remember_interrupts(self) -> Iterator[None]:
        """Remember an interruption that is raised inside a callback."""
        try:
            yield
        except KeyboardInterrupt as interrupt:
            self._interrupt = interrupt
            raise

    @contextmanager
    def around(self) -> Iterator[None]:
        """Raise the interruption in place of PETSc's error, around a call of the solver."""
        self._interrupt = None
        try:
            yield
        except PETSc.Error:
            if self._interrupt is not None:
                raise self._interrupt from None
            raise


@dataclass(frozen=True)
class Outcome:
    """Outcome of one attempt to solve for an equilibrium.

    Attributes
    ----------
    iterations
        Corrections of the state: Broyden's and Newton's.
    newton
        Corrections by Newton's method alone, in SNES; 0 where Broyden's were enough.
    reason
        Name of SNES's reason.
    """

    iterations: int
    newton: int
    reason: str

    @property
    def found(self) -> bool:
        """Whether it is an equilibrium."""
        return not self.reason.startswith("DIVERGED")


REASONS = {
    value: name
    for name, value in vars(PETSc.SNES.ConvergedReason).items()
    if name.startswith(("CONVERGED_", "DIVERGED_"))
}


def rounding_residual(model: FiniteElementModel) -> float:
    """Return several times the residual (N) that rounding errors of mu, springs and the sleeves' E leave over a face.

    In the half-plane a node stands for a whole circle, and sleeves leave ten times as much (measured up to E = 1e9
    MPa).
    """
    shear = model.shear_modulus
    metal = model.metal_modulus
    extent = float(model.comm.allreduce(np.ptp(model.mesh.mesh.geometry.x, axis=0).max(initial=0.0)))
    share = 5e-16 if model.mesh.dimension == 3 else 5e-15
    springs = sum(installed.feature.springs for installed in model.features)
    return ((1e-12 + 1e-16 * springs) * abs(shear) + share * metal) * extent**2
