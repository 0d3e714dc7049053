"""Equilibrium at one displacement of the sleeve: an earlier factorisation is tried first, then Newton's method.

The tangent and its factorisation would take most of the time of a step. Where the path is smooth, the last
factorisation is still good enough for Broyden's method to correct the extrapolated state, at one residual and one
back-substitution per iteration: a thirtieth of a Newton iteration in three dimensions. SNES checks the result. If that
fails, Broyden's method is tried with a new tangent at the extrapolated state; if that fails too, SNES starts over from
there with Newton's method and a line search.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.border import Border
from cases.drag import Drag
from cases.limit import Limit
from cases.model import FiniteElementModel
from cases.motion import PoseMotion
from cases.newton import REASONS, Callbacks, Outcome, bends, broyden_step, newton_solver, rounding_residual
from cases.ranks import sum_over_ranks
from cases.rates import MOST_OF_SKEW, ConvergedState, Rates, with_ghosts
from cases.reaction import reaction, reactions

Array = NDArray[np.float64]

MAX_BROYDEN = 25
# Broyden's method is given up where SPAN iterations have not reduced the residual to this share.
SPAN, SHARE = 4, 0.5
# A factorisation that took more iterations than this is renewed before the next step: with 4 to 10 the measured
# times of a mode differ by 15 % (benchmarks/README.md).
TIRED = 8


class Equilibrium:
    """Solver for the free unknowns of a model.

    Parameters
    ----------
    model
        Its state is read and written.
    tolerance
        Out-of-balance force over the norm of the reactions.
    limit
        When a solution by Newton's method is given up.

    Attributes
    ----------
    force, energy : float
        Generalised force (N, N mm; MPa for a coupon) and stored energy (N mm) at the last solution.
    six : shape (6,) or None
        Force and moment on the sleeve there (N, N mm); None except on a path of six motions.
    tangents : int
        Tangents assembled and factorised so far.
    """

    def __init__(self, model: FiniteElementModel, tolerance: float, limit: Limit | None = None) -> None:
        self.model, self.tolerance, self.limit = model, tolerance, limit or Limit()
        self._callbacks = Callbacks()
        self.x, self.b = model.system.create_vector(), model.system.create_vector()
        self.matrix = model.system.create_matrix()
        self.reactions = self.force = self.energy = 0.0
        self.six: Array | None = np.zeros(6) if isinstance(model.motion, PoseMotion) else None
        self.q, self.rate = 0.0, model.rate(0.0)
        self.tangents, self._rates = 0, Rates()
        # Iterations that the last solution took with the factorisation at hand; None where there is none.
        self._fatigue: int | None = None
        self._factorised = self._guessed = False
        self._drag: Drag | None = None
        self.floor = rounding_residual(model)
        # Free motions of the sleeve are unknowns beside those of the mesh.
        self.border = Border(model) if len(model.motion.free) else None
        self.snes = newton_solver(model, self.limit.most, self.border)
        self.snes.setFunction(self._function, self.b)
        self.snes.setJacobian(self._jacobian, self.matrix)
        self.snes.setConvergenceTest(self._test)
        self.ksp = self.snes.getKSP()

    def solve(self, q: float, guess: Array, again: bool = True) -> Outcome:
        """Bring the model's state into equilibrium at q.

        Parameters
        ----------
        q
            Generalised displacement, mm or rad.
        guess
            Unknowns to start from, shape (n,): this rank's, and the free motions of the sleeve after them.
        again
            Whether to repeat the solution with contact if surfaces meet that did not before; if not, it has failed.
        """
        with self.model.surfaces.without_contact() as rested:
            outcome = self._find_equilibrium(q, guess)
        if rested and not outcome.found and self.model.surfaces.near() and again:
            return self._find_equilibrium(q, guess, outcome.iterations)
        return outcome

    def newton(self, q: float, guess: Array, corrections: int) -> Outcome:
        """Bring the model's state into equilibrium by Newton's method alone, from a guess behind a surface.

        Parameters
        ----------
        q, guess
            As in `solve`: mm or rad, shape (n,).
        corrections
            Number of corrections that have gone before, which are counted too.
        """
        self.q, self.rate = q, self.model.rate(q)
        self._begin(guess)
        # The tangent nearly always bends there (19 of 20 guesses in the kidney STEP's void): this is not checked.
        return self._newton(corrections, guessed=True)

    def _find_equilibrium(self, q: float, guess: Array, corrections: int = 0) -> Outcome:
        """Bring the model's state into equilibrium, with contact or without it (`SurfaceForms.without_contact`)."""
        self.q, self.rate = q, self.model.rate(q)
        for renew in (self._fatigue is None or self._fatigue > TIRED, True):
            self._begin(guess)
            tangents = self.tangents
            balanced, iterations = self._broyden(renew)
            corrections += iterations
            if balanced:
                outcome = self._newton(corrections)
                if outcome.found:
                    return outcome
            if renew:
                break
        self._begin(guess)
        return self._newton(corrections, factorised=self.tangents > tangents)

    @contextmanager
    def with_drag(self, drag: Drag, origin: Array, viscosity: float) -> Iterator[None]:
        """Add a drag to the model, and limit Newton's iterations to `Drag.most`.

        Parameters
        ----------
        drag
            Drag of the model.
        origin
            `unknowns` of the state towards which it pulls, shape (n,).
        viscosity
            Ratio of its stiffness to that of the displacements at rest.
        """
        self._begin(origin)
        drag.begin(self.x, viscosity)
        self._drag, self._fatigue, usual, self.limit = drag, None, self.limit, Limit(drag.most)
        try:
            yield
        finally:
            self._drag, self._fatigue, self.limit = None, None, usual

    @contextmanager
    def coarse(self, tolerance: float) -> Iterator[None]:
        """Accept states whose out-of-balance force is up to this share of the norm of the reactions."""
        exact, self.tolerance = self.tolerance, max(tolerance, self.tolerance)
        try:
            yield
        finally:
            self.tolerance = exact

    @property
    def factor(self) -> PETSc.KSP:
        """Factorisation of the tangent in the mesh's free unknowns."""
        return self.ksp if self.border is None else self.border.factor

    @property
    def pose(self) -> Array | None:
        """Where the sleeve is at the last solution, (6,) in mm and rad; None except on a path of six motions."""
        return self.model.motion.pose(self.q)

    def unknowns(self) -> Array:
        """Unknowns of this rank, and the free motions of the sleeve after them, at the last solution."""
        return np.concatenate([self.model.state.x.array, self.model.motion.free])

    def ahead(self, q: float, state: Array) -> Array:
        """Return the derivative of `unknowns` by q at any solution; at a corner of the path, on the segment after it.

        Parameters
        ----------
        q
            Displacement there, mm or rad.
        state
            `unknowns` there, shape (n,).
        """
        self.model.put(state)
        self.q, self.rate = q, self.model.rate(q, ahead=True)
        return np.concatenate([self.tangent_rate(ahead=True), self.free_rate])

    def tangent_rate(self, factorised: bool = False, ahead: bool = False) -> Array:
        """Return dx/dq of this rank's unknowns at the last solution.

        Parameters
        ----------
        factorised
            Whether to factorise the tangent there.
        ahead
            Whether to take, at a corner of the path, the rate on the segment after it.
        """
        self.free_rate: Array = np.zeros_like(self.model.motion.free)
        if self.border is not None:
            self.factorise()
            border_rate, self.free_rate = self.border.rate(self.ksp, self.rate, ahead)
            return border_rate
        if not factorised and self.fresh(TIRED):
            self.model.system.stiffen()
            state = ConvergedState(self.model, self.ksp, self.q, self.rate, self.tolerance)
            rate = self._rates.iterate(state)
            if rate is not None:
                return rate
        self._renew()
        self.model.system.lift(self.b, self.rate)
        solution = self.b.duplicate()
        self.ksp.solve(self.b, solution)
        rate = with_ghosts(solution)
        solution.destroy()
        if not self.model.system.symmetric:
            state = ConvergedState(self.model, self.ksp, self.q, self.rate, self.tolerance)
            refined = self._rates.iterate(state, rate, MOST_OF_SKEW)
            if refined is not None:
                return refined
        self._rates.add(self.q, rate)
        return rate

    def fresh(self, most: int) -> bool:
        """Whether the last solution took at most `most` iterations with the factorisation at hand."""
        return self._fatigue is not None and self._fatigue <= most

    def factorise(self, stiffened: bool = False) -> None:
        """Factorise the tangent at the last solution, even if an older factorisation would do.

        ``stiffened``: the moduli there have just been computed (`System.stiffen`).
        """
        self._renew(stiffened)
        self.ksp.setUp()

    def destroy(self) -> None:
        """Free the PETSc objects: the garbage collector does not do so in step on all ranks."""
        for petsc_object in (self.snes, self.matrix, self.b, self.x):
            petsc_object.destroy()
        if self.border is not None:
            self.border.release()

    def _broyden(self, renew: bool) -> tuple[bool, int]:
        """Correct the state in `x` with a new or the last tangent; return whether it converged, and the iterations."""
        steps: list[tuple[PETSc.Vec, float]] = []
        norms = [self._residual()]
        try:
            while not self._is_balanced(norms[-1]):
                stalled = len(norms) > SPAN and norms[-1] > SHARE * norms[-1 - SPAN]
                if stalled or not np.isfinite(norms[-1]) or len(steps) == MAX_BROYDEN:
                    return False, len(steps)
                if renew and not steps:
                    self._renew()
                step = broyden_step(self.ksp, self.b, steps)
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

    def _renew(self, stiffened: bool = False) -> None:
        """Factorise the tangent at the model's state."""
        self._assemble(self.matrix, stiffened)
        self.ksp.setOperators(self.matrix)
        self.tangents += 1
        self._fatigue = 0

    def _residual(self) -> float:
        self._function(self.snes, self.x, self.b)
        return float(self.b.norm())

    def _newton(self, corrections: int, factorised: bool = False, guessed: bool = False) -> Outcome:
        """Solve by SNES from `x`, after some corrections; `factorised`: the tangent there was factorised last."""
        self._factorised, self._guessed = factorised, guessed
        with self._callbacks.around():
            self.snes.solve(None, self.x)
        # SNES leaves the last trial of the line search in the state: put the accepted iterate there.
        self._to_state(self.x)
        newton = self.snes.its
        return Outcome(corrections + newton, newton, REASONS.get(self.snes.reason, str(self.snes.reason)))

    def _begin(self, guess: Array) -> None:
        self.model.put(guess)
        self.model.impose(self.q)
        self.x.array_w[:] = self.model.state.x.array[: self.x.getLocalSize()]
        if self.border is not None:
            self.border.write(self.x, self.model.motion.free)

    def _to_state(self, x: PETSc.Vec) -> None:
        state = self.model.state.x
        state.array[: x.getLocalSize()] = x.array_r
        state.scatter_forward()
        if self.border is not None:
            self.model.motion.take(self.border.read(x))
            self.model.impose(self.q)

    def _function(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        with self._callbacks.remember_interrupts():
            self._to_state(x)
            self.model.system.residual(b)
            if self.border is not None:
                self.rate = self.model.rate(self.q)
            self.force = reaction(self.model, b, self.rate)
            motion = self.model.motion
            if isinstance(motion, PoseMotion):
                self.six = reactions(self.model, b, self.q)
            self.reactions = self.model.system.clear_constrained(b)
            if self._drag is not None:
                self._drag.add_forces(x, b)
            if self.border is not None and isinstance(motion, PoseMotion) and self.six is not None:
                self.border.write_forces(b, self.six - motion.path.load_at(self.q))

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat) -> None:
        if self._factorised:
            self._factorised = False
            return
        with self._callbacks.remember_interrupts():
            self._assemble(matrix, positive=self._guessed)
            exact, self._guessed = not self._guessed, False
            if exact and self.border is None and bends(self.model, self.ksp, matrix):
                self._assemble(matrix, stiffened=True, positive=True)
        self.tangents += 1
        self._fatigue = 0

    def _assemble(self, matrix: PETSc.Mat, stiffened: bool = False, positive: bool = False) -> None:
        self.model.system.tangent(matrix, stiffened, positive)
        if self._drag is not None:
            self._drag.add_stiffness(matrix)
        if self.border is not None:
            self.border.at(self.q)

    def _is_balanced(self, norm: float) -> bool:
        """Whether the residual in `b` is small: its forces relative to the reactions, its volumes to the body's."""
        if norm > self.tolerance * self.reactions + self.floor:
            return False
        squares = float(np.sum(self.b.array_r[self.model.system.owned_pressures] ** 2))
        volume = float(np.sqrt(sum_over_ranks(self.model.comm, squares)))
        return volume <= self.tolerance * self.model.volume

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int | None:
        if not np.isfinite(norms[2]):
            return int(PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN)
        if self._is_balanced(norms[2]):
            # A locking law (Gent) has a residual beyond its limit too, but no energy there.
            self.energy = self.model.energy()
            # A step that is too long may end behind a surface.
            if not np.isfinite(self.energy) or self.model.surfaces.is_refuted():
                return int(PETSc.SNES.ConvergedReason.DIVERGED_FUNCTION_DOMAIN)
            return int(PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE)
        if self.limit.ends(iteration, norms[2]):
            return int(PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT)
        return None
