"""Equilibrium at one displacement of the sleeve: the factorisation at hand first, Newton where it does not serve.

Most of the time of a step would go into the tangent and its factorisation. Where the path is smooth the last
factorisation still points the right way, and Broyden's method corrects the extrapolated state with it, at one
residual and one back-substitution per iteration: a thirtieth of a Newton iteration in three dimensions. SNES judges
the result. Where that fails a fresh tangent at the extrapolated state gets the same chance, and after it SNES starts
over from there with Newton's method and a line search.

References
----------
Broyden (1965), Math. Comput. 19:577-593, doi:10.1090/S0025-5718-1965-0198670-6.
Kelley (1995), Iterative Methods for Linear and Nonlinear Equations, SIAM, section 7.3,
doi:10.1137/1.9781611970944.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.model import Model
from cases.ranks import summed
from cases.rates import Found, Rates, ghosted
from cases.reaction import reaction

Array = NDArray[np.float64]

MAX_NEWTON = 25
MAX_BROYDEN = 25
# Broyden's method is given up where SPAN iterations have not brought the residual down to this share.
SPAN, SHARE = 4, 0.5
# A factorisation that took more iterations than this is renewed before the next step: with 4 to 10 the measured
# times of a mode differ by 15 % (benchmarks/README.md).
TIRED = 8
# A correction that would have to be lengthened more than this says that the factorisation points nowhere.
LONGEST = 10.0


@dataclass(frozen=True)
class Outcome:
    """What came of one solution.

    Attributes
    ----------
    iterations
        Corrections of the state: Broyden's and Newton's.
    newton
        Newton's alone, by SNES; 0 where Broyden's were enough.
    reason
        SNES's, by name.
    """

    iterations: int
    newton: int
    reason: str


class Equilibrium:
    """Solver for the free unknowns of a model.

    Parameters
    ----------
    model
        Its state is read and written.
    tolerance
        Out-of-balance force over the norm of the reactions.
    most
        Iterations of Newton after which a solution has failed.

    Attributes
    ----------
    force, energy : float
        Generalised force (N, N mm; MPa for a coupon) and stored energy (N mm) at the last solution.
    tangents : int
        Tangents assembled and factorised so far.
    """

    def __init__(self, model: Model, tolerance: float, most: int = MAX_NEWTON) -> None:
        self.model, self.tolerance, self.most = model, tolerance, most
        self._interrupt: KeyboardInterrupt | None = None
        self.x, self.b = model.create_vector(), model.create_vector()
        self.matrix = model.create_matrix()
        self.reactions = 0.0
        self.force = self.energy = 0.0
        self.tangents = 0
        self.q, self.rate = 0.0, model.rate(0.0)
        self._rates = Rates()
        # Iterations that the last solution took with the factorisation at hand; None where there is none.
        self._fatigue: int | None = None
        self._factorised = False
        self.floor = _rounding(model)
        snes = PETSc.SNES().create(model.comm)
        snes.setFunction(self._function, self.b)
        snes.setJacobian(self._jacobian, self.matrix)
        snes.setConvergenceTest(self._test)
        snes.setTolerances(max_it=most)
        snes.setType("newtonls")
        prefix = "bushcli_"
        snes.setOptionsPrefix(prefix)
        # The secant search minimises the residual along the step. Backtracking only asks for a decrease, which
        # the saddle point of u and p refuses too often: radial loads then stop at 42 % of the thickness.
        PETSc.Options()[prefix + "snes_linesearch_type"] = "l2"
        self.snes, self.ksp = snes, snes.getKSP()
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("cholesky")
        self.ksp.getPC().setFactorSolverType("mumps")
        snes.setFromOptions()
        PETSc.Options().delValue(prefix + "snes_linesearch_type")

    def solve(self, q: float, guess: Array) -> Outcome:
        """Bring the model's state into equilibrium at q.

        Parameters
        ----------
        q
            Generalised displacement, mm or rad.
        guess
            This rank's unknowns to start from.
        """
        self.q, self.rate = q, self.model.rate(q)
        corrections = 0
        for renew in (self._fatigue is None or self._fatigue > TIRED, True):
            self._begin(guess)
            tangents = self.tangents
            balanced, iterations = self._broyden(renew)
            corrections += iterations
            if balanced:
                newton, reason = self._newton()
                if not reason.startswith("DIVERGED"):
                    return Outcome(corrections + newton, newton, reason)
            if renew:
                break
        self._begin(guess)
        newton, reason = self._newton(factorised=self.tangents > tangents)
        return Outcome(corrections + newton, newton, reason)

    def tangent_rate(self, factorised: bool = False) -> Array:
        """dx/dq of this rank's unknowns at the last solution, by a linear solution with the tangent there.

        Parameters
        ----------
        factorised
            Whether the tangent has to be factorised afterwards, because the caller has more to solve for.
        """
        if not factorised and self._fatigue is not None and self._fatigue <= TIRED:
            self.model.stiffen()
            rate = self._rates.iterated(Found(self.model, self.ksp, self.q, self.rate, self.tolerance))
            if rate is not None:
                return rate
        self._renew()
        self.model.lift(self.b, self.rate)
        solution = self.b.duplicate()
        self.ksp.solve(self.b, solution)
        rate = ghosted(solution)
        solution.destroy()
        self._rates.add(self.q, rate)
        return rate

    def destroy(self) -> None:
        """Free the PETSc objects: the garbage collector does not do so in step on all ranks."""
        for item in (self.snes, self.matrix, self.b, self.x):
            item.destroy()

    # -- Broyden's method ----------------------------------------------------------------------------------------

    def _broyden(self, renew: bool) -> tuple[bool, int]:
        """Correct the state in `x`, with its own tangent or that at hand; whether it balances, and the iterations."""
        steps: list[tuple[PETSc.Vec, float]] = []
        norms = [self._residual()]
        try:
            while not self._balanced(norms[-1]):
                stalled = len(norms) > SPAN and norms[-1] > SHARE * norms[-1 - SPAN]
                if stalled or not np.isfinite(norms[-1]) or len(steps) == MAX_BROYDEN:
                    return False, len(steps)
                if renew and not steps:
                    self._renew()
                step = self._broyden_step(steps)
                if step is None:
                    return False, len(steps)
                steps.append((step, step.dot(step)))
                self.x.axpy(1.0, step)
                norms.append(self._residual())
            if self._fatigue is not None:
                self._fatigue = len(steps)
            return True, len(steps)
        finally:
            for step, _ in steps:
                step.destroy()

    def _broyden_step(self, steps: list[tuple[PETSc.Vec, float]]) -> PETSc.Vec | None:
        """The next step from the residual in `b`: the factorisation's, corrected by all steps before it."""
        step = self.b.duplicate()
        self.ksp.solve(self.b, step)
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

    def _renew(self) -> None:
        """Factorise the tangent at the model's state."""
        self.model.assemble_tangent(self.matrix)
        self.ksp.setOperators(self.matrix)
        self.tangents += 1
        self._fatigue = 0

    def _residual(self) -> float:
        self._function(self.snes, self.x, self.b)
        return float(self.b.norm())

    # -- Newton's method, and the judgement ----------------------------------------------------------------------

    def _newton(self, factorised: bool = False) -> tuple[int, str]:
        """Solve by SNES from `x`, whose tangent may be the one factorised last; iterations and reason."""
        self._factorised = factorised
        self._interrupt = None
        try:
            self.snes.solve(None, self.x)
        except PETSc.Error:
            # What is raised in a callback comes out as PETSc's own error.
            if self._interrupt is not None:
                raise self._interrupt from None
            raise
        # SNES leaves the last trial of the line search in the state: put the accepted iterate there.
        self._to_state(self.x)
        reason = self.snes.getConvergedReason()
        return self.snes.getIterationNumber(), _REASONS.get(reason, str(reason))

    def _begin(self, guess: Array) -> None:
        state = self.model.state.x
        state.array[:] = guess
        self.model.impose(self.q)
        self.x.array_w[:] = state.array[: self.x.getLocalSize()]

    def _to_state(self, x: PETSc.Vec) -> None:
        state = self.model.state.x
        state.array[: x.getLocalSize()] = x.array_r
        state.scatter_forward()

    def _function(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        with self._heard():
            self._to_state(x)
            self.model.assemble_residual(b)
            self.force = reaction(self.model, b, self.rate)
            self.reactions = self.model.clear_constrained(b)

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat) -> None:
        if self._factorised:
            self._factorised = False
            return
        with self._heard():
            self.model.assemble_tangent(matrix)
        self.tangents += 1
        self._fatigue = 0

    @contextmanager
    def _heard(self) -> Iterator[None]:
        """Know of an interruption in a callback."""
        try:
            yield
        except KeyboardInterrupt as interrupt:
            self._interrupt = interrupt
            raise

    def _balanced(self, norm: float) -> bool:
        """Whether the residual in `b` is small: its forces over the reactions, its volumes over the body's own."""
        if norm > self.tolerance * self.reactions + self.floor:
            return False
        squares = float(np.sum(self.b.array_r[self.model.owned_pressures] ** 2))
        volume = float(np.sqrt(summed(self.model.comm, squares)))
        return volume <= self.tolerance * self.model.volume

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int | None:
        if not np.isfinite(norms[2]):
            return int(PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN)
        if self._balanced(norms[2]):
            # A locking law (Gent) has a residual beyond its limit too, but no energy there.
            self.energy = self.model.energy()
            # A step that is too long may end behind a surface.
            if not np.isfinite(self.energy) or self.model.surfaces.passed_through:
                return int(PETSc.SNES.ConvergedReason.DIVERGED_FUNCTION_DOMAIN)
            return int(PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE)
        if iteration >= self.most:
            return int(PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT)
        return None


_REASONS = {
    value: name
    for name, value in vars(PETSc.SNES.ConvergedReason).items()
    if name.startswith(("CONVERGED_", "DIVERGED_"))
}


def _rounding(model: Model) -> float:
    """What rounding leaves of the residual (N), several times: of mu, springs and sleeves' E, over the face.

    In the half-plane a node stands for a whole circle, and ten times that is left of the sleeve's (measured up to
    E = 1e9 MPa).
    """
    shear = model.shear_modulus
    metal = model.metal_modulus
    extent = float(model.comm.allreduce(np.ptp(model.mesh.mesh.geometry.x, axis=0).max(initial=0.0)))
    share = 5e-16 if model.mesh.dimension == 3 else 5e-15
    springs = sum(item.feature.springs for item in model.features)
    return ((1e-12 + 1e-16 * springs) * abs(shear) + share * metal) * extent**2
