"""Solver of a small system, such as that of a coupon, which is one element.

MUMPS takes as long to prepare a back-substitution as dense elimination takes for the whole system of a few dozen
unknowns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

# Largest number of unknowns. A coupon has 25, for which dense elimination took 12 microseconds, a back-substitution by
# MUMPS some 100; for 64 unknowns dense elimination took 240.
MOST_UNKNOWNS = 32


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
