"""dx/dq along a path, with a factorisation of the tangent that is some steps old.

The derivative of the state by q solves K v = 0 with the sleeve's own rate prescribed. Along a path v changes little,
and the factorisation at hand is still a good preconditioner: GMRES, started from an extrapolation of the last rates,
needs a few back-substitutions and products with the tangent, which is applied at the quadrature points and never
assembled. In three dimensions that takes a third of the time of assembling and factorising it.

References
----------
Saad and Schultz (1986), GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems, SIAM
J. Sci. Stat. Comput. 7:856-869, doi:10.1137/0907058. Eisenstat, Elman and Schultz (1983), Variational iterative methods
for nonsymmetric systems of linear equations, SIAM J. Numer. Anal. 20:345-357, doi:10.1137/0720023 (the form used here).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.model import FiniteElementModel
from cases.predictor import RecentPoints
from cases.ranks import sum_over_ranks

Array = NDArray[np.float64]

# Largest number of iterations. Two dozen cost as much as a fresh factorisation in three dimensions, six in the
# half-plane.
MOST_ITERATIONS = 8
# The same with a fresh factorisation of the symmetric part of a tangent that is not symmetric.
MOST_OF_SKEW = 40
# Relative error of a rate over the march's tolerance, and the least error that rounding allows. With these, the
# derivatives by parameters were within 4e-7 of their largest value at the default tolerance (Yeoh and Ogden, four
# modes).
LOOSER, SMALLEST = 100.0, 1e-11
# Number of rates in the extrapolation, a cubic. With more of them, errors are carried on from rate to rate.
KEPT = 4


@dataclass(frozen=True)
class ConvergedState:
    """A solution, with the solver objects that are available there.

    Attributes
    ----------
    model
        Its moduli are those of the solution (`System.stiffen`).
    ksp
        Solver with a factorisation of some earlier tangent.
    q, rate
        Displacement of the sleeve, and the derivative of the constrained unknowns by it.
    tolerance
        Tolerance of the march.
    """

    model: FiniteElementModel
    ksp: PETSc.KSP
    q: float
    rate: Array
    tolerance: float


class Rates:
    """The last rates along a path."""

    def __init__(self) -> None:
        self._known = RecentPoints(KEPT)

    def add(self, q: float, rate: Array) -> None:
        """Take the rate found at q.

        Parameters
        ----------
        q : float
            Generalised displacement, mm or rad.
        rate : Array
            Derivative of this rank's unknowns by q, shape (m,), per mm or rad.
        """
        self._known.add(q, rate)

    def guess(self, q: float, rate: Array) -> Array:
        """Extrapolate the last rates; return ``rate`` where there is none.

        Parameters
        ----------
        q : float
            Generalised displacement, mm or rad.
        rate : Array
            Derivative of this rank's unknowns by q, shape (m,), per mm or rad.
        """
        return self._known.extrapolate(q) if self._known.q else rate.copy()

    def iterate(
        self, state: ConvergedState, guess: Array | None = None, most: int = MOST_ITERATIONS
    ) -> Array | None:
        """The rate at a solution, all local unknowns, from a guess; None if it needs too many iterations."""
        model = state.model
        prescribed = state.rate
        rate = self.guess(state.q, prescribed) if guess is None else guess
        dofs = model.motion.constrained.dofs
        rate[dofs] = prescribed[dofs]
        b, step = model.system.create_vector(), model.system.create_vector()
        try:
            improved = self._improve(state, rate, b, step, most)
        finally:
            b.destroy()
            step.destroy()
        if improved:
            self.add(state.q, rate)
            return rate
        return None

    def _improve(self, state: ConvergedState, rate: Array, b: PETSc.Vec, step: PETSc.Vec, most: int) -> bool:
        """Improve the rate in place down to its tolerance; return whether that was possible."""
        directions: list[tuple[Array, Array]] = []
        residual = self._precondition(state, rate, b, step)
        residual *= -1.0
        tolerance = max(LOOSER * state.tolerance, SMALLEST)
        # Relative to the rate as it is now: that of a bad guess may be of any size.
        while not self._norm(state, residual) <= tolerance * self._norm(state, rate):
            if len(directions) == most:
                return False
            # The remaining error is the next direction; minimise the error over all directions so far.
            image, direction = self._precondition(state, residual, b, step), residual.copy()
            for earlier, its_image in directions:
                share = self._dot(state, its_image, image)
                image -= share * its_image
                direction -= share * earlier
            size = self._norm(state, image)
            if not np.isfinite(size) or size == 0.0:
                return False
            image /= size
            direction /= size
            directions.append((direction, image))
            share = self._dot(state, image, residual)
            rate += share * direction
            residual = residual - share * image
        return True

    @staticmethod
    def _precondition(state: ConvergedState, vector: Array, b: PETSc.Vec, step: PETSc.Vec) -> Array:
        """Apply the tangent to a vector of all local unknowns, and the present factorisation to the product."""
        state.model.system.apply_tangent(b, vector)
        b.array_w[state.model.system.owned_constrained] = 0.0
        state.ksp.solve(b, step)
        return with_ghosts(step)

    @staticmethod
    def _dot(state: ConvergedState, left: Array, right: Array) -> float:
        owned = state.model.system.owned
        return float(sum_over_ranks(state.model.comm, left[:owned] @ right[:owned]))

    @classmethod
    def _norm(cls, state: ConvergedState, vector: Array) -> float:
        return float(np.sqrt(cls._dot(state, vector, vector)))


def with_ghosts(vector: PETSc.Vec) -> Array:
    """Entries of this rank of a vector, and those of its ghosts."""
    vector.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
    with vector.localForm() as local:
        return np.array(local.array_r)
