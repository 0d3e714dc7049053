"""d(force)/d(parameter) along the march, exactly, from the tangent's solutions.

At equilibrium the residual R(x, h; c) vanishes in every direction that leaves the sleeves where they are; h is the
rubber's memory of the earlier steps. The force is the work of R on v = dx/dq, the tangent's response to a motion of the
sleeve, and because the tangent is symmetric the total derivative is dQ/dc = v . (dR/dc + dR/dh h'), with no need for
dx/dc. Without memory that is all: one back-substitution for all parameters together, then one scalar each. A tangent K
that is not symmetric (with a clock, `forms.branch`) adds v . K dx/dc.

With memory its derivative h' = dh/dc is marched along: one back-substitution per step, for v and all parameters
together (or, after a short step, two or three with an older factorisation: `cases.refinement`), gives x' = dx/dc,
and the update rule h_new = U(x, h; c) gives h'_new = U_x x' + U_h h' + U_c. Parameters may also move a boundary (its
motion is then an x' known beforehand) or the path of the sleeve itself (dq/dc, given with the program).

References
----------
Michaleris, Tortorelli and Vidal (1994), Int. J. Numer. Methods Eng. 37:2471-2499, doi:10.1002/nme.1620371408.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.history import failure_at_start
from cases.load import PrescribedForce
from cases.model import FiniteElementModel
from cases.parameters import Numbers
from cases.predictor import RecentPoints
from cases.ranks import sum_over_ranks
from cases.rates import MOST_OF_SKEW, ConvergedState
from cases.refinement import solve_by_refinement
from cases.rigid import complete_forces, solve_under_forces
from cases.series import SeriesSpring
from cases.slopes import Along, Slopes

Array = NDArray[np.float64]

# Step of the central difference for the second derivative of a path, whose rates are sines and cosines, exact to
# rounding.
BEND = 1e-5
# A step is short if it took at most this many iterations with the factorisation at hand, which then serves the
# derivatives too. With 3 the times were the same to within the noise of the machine.
SHORT = 5


class Sensitivity:
    """Derivatives of a model's force with respect to its parameters, step by step.

    Parameters
    ----------
    model
        The model.
    names
        Law parameters, "compliance" (1 / bulk modulus, 1/MPa), parameters of features ("name.parameter"), and any
        others that only move the path.
    """

    def __init__(self, model: FiniteElementModel, names: Iterable[str]) -> None:
        self.model = model
        self.names = tuple(names)
        self.begin()

    def begin(self) -> None:
        """Forget the steps so far: the rubber is virgin."""
        count = len(self.model.body.material.families)
        self.memory: Sequence[Sequence[Array | None]] = [[None] * count for _ in self.names]
        self._rates: dict[str, Numbers] = {}
        self._rates_at: tuple[float, ...] = ()
        # Solutions of the last steps, shape (1 + names, n) each: along a branch they change smoothly.
        self._last = RecentPoints()
        # dx/dq at the last step with memory, shape (n,).
        self.rate: Array | None = None

    def __call__(
        self,
        solver: Equilibrium,
        path_rates: Mapping[str, float] | None = None,
        drive: SeriesSpring | PrescribedForce | None = None,
        time: float = 0.0,
    ) -> tuple[Array, Array]:
        """Derivatives of the force and of the sleeve's displacement, shape (names,) each, at the present equilibrium.

        Where the model has a memory, call it once per accepted step, before the memory is brought up to date.

        Parameters
        ----------
        solver
            Solver that has just found the equilibrium.
        path_rates
            Parameter -> derivative of the prescribed displacement, for those that move it.
        drive
            What is prescribed in place of the sleeve's displacement (`cases.march.march`).
        time
            s, as in the program.
        """
        model, prescribed = self.model, path_rates or {}
        changes = [self._change(name) for name in self.names]
        boundaries = [model.motion.boundary_rate(name, solver.q) for name in self.names]
        if not model.path_dependent:
            rate = solver.tangent_rate()
            works = self._works(Slopes(model.body, model.state.x.array), changes, boundaries, rate)
        else:
            model.system.stiffen()
            slopes = Slopes(model.body, model.state.x.array)
            forces = self._forces(slopes, changes, boundaries)
            rate, movements = self._solutions(solver, -forces)
            self.rate = rate
            if not model.system.symmetric:
                forces += model.system.pulls(movements)
            works = forces @ rate
        stiffness = self._stiffness(solver.q, rate) if drive is not None or any(prescribed.values()) else 0.0
        works = sum_over_ranks(model.comm, works) * model.multiplicity
        works += [self._work_of_bend(name, solver.q) for name in self.names]
        rates = np.array([prescribed.get(name, 0.0) for name in self.names])
        if drive is not None:
            for i, (name, work) in enumerate(zip(self.names, works, strict=True)):
                rates[i] = drive.rate(name, solver.q, solver.force, time, stiffness, rates[i], work)
        if model.path_dependent:
            movements += np.outer(rates, rate)
            for movement, boundary in zip(movements, boundaries, strict=True):
                movement += 0.0 if boundary is None else boundary
            self.memory = list(slopes.memory_after(self.names, changes, self.memory, list(movements)))
        return works + stiffness * rates, rates

    def movements(
        self, solver: Equilibrium, rate: Array, drive: PrescribedForce | None = None
    ) -> tuple[Array, Array, Array]:
        """Return dx/dc, (names, n), dq/dc and the force's derivative, (names,) each; of a model without memory.

        Parameters
        ----------
        solver
            Solver that has just found the equilibrium, and factorised the tangent there.
        rate
            dx/dq, shape (n,).
        drive
            As in `__call__`.
        """
        model = self.model
        changes = [self._change(name) for name in self.names]
        boundaries = [model.motion.boundary_rate(name, solver.q) for name in self.names]
        forces = self._forces(Slopes(model.body, model.state.x.array), changes, boundaries)
        movements = solve_under_forces(model, solver.factor, complete_forces(model, -forces))
        works = np.asarray(sum_over_ranks(model.comm, forces @ rate)) * model.multiplicity
        works += [self._work_of_bend(name, solver.q) for name in self.names]
        stiffness = self._stiffness(solver.q, rate)
        rates = np.zeros(len(works)) if drive is None else -works / stiffness
        movements += np.outer(rates, rate)
        for movement, boundary in zip(movements, boundaries, strict=True):
            movement += 0.0 if boundary is None else boundary
        return movements, rates, works + stiffness * rates

    def stiffness(self, solver: Equilibrium) -> float:
        """Return dQ/dq at the present equilibrium, at fixed memory: N/mm or N mm/rad."""
        return self._stiffness(solver.q, solver.tangent_rate())

    def _change(self, name: str) -> Numbers:
        """Return the derivative of the body's material numbers by a parameter."""
        parameters = self.model.parameters
        # A step's duration changes it only where the temperature scales the duration.
        state = parameters.state if "temperature" in parameters.constants else parameters.state[:-1]
        if state != self._rates_at:
            self._rates_at, self._rates = state, {}
        if name not in self._rates:
            self._rates[name] = parameters.rates(name)
        return self._rates[name]

    # -- contributions outside the body's points -----------------------------------------------------------------

    def _works(
        self, slopes: Slopes, changes: Sequence[Numbers], boundaries: Sequence[Array | None], rate: Array
    ) -> Array:
        """Work of the forces' derivatives by each parameter on v, of this rank; without memory."""
        along = slopes.along(rate)
        works = [
            slopes.work(name, change, along) + self._work_of_surfaces(name, change, boundary, along)
            for name, change, boundary in zip(self.names, changes, boundaries, strict=True)
        ]
        return np.array(works)

    def _forces(
        self, slopes: Slopes, changes: Sequence[Numbers], boundaries: Sequence[Array | None]
    ) -> Array:
        """Derivatives of the forces by each parameter with the unknowns held, (names, n), of this rank."""
        stresses = slopes.stresses(changes, self.memory)
        forces = slopes.forces(self.names, changes, stresses)
        for name, change, boundary, force in zip(self.names, changes, boundaries, forces, strict=True):
            self._add_outside(name, change, boundary, force)
        return forces

    def _work_of_surfaces(self, name: str, change: Numbers, boundary: Array | None, along: Along) -> float:
        """Work of the derivative of surfaces' forces, and of the tangent on a boundary's motion; of this rank."""
        if boundary is None and not self.model.surfaces.any_present:
            return 0.0
        force = np.zeros_like(along.direction)
        self._add_outside(name, change, boundary, force)
        return float(force @ along.direction)

    def _add_outside(self, name: str, change: Numbers, boundary: Array | None, force: Array) -> None:
        model = self.model
        if name in model.marked:
            model.surfaces.add_slope(name, change.shear_modulus, force)
        if boundary is not None:
            model.body.add_action(boundary, force)
            model.surfaces.add_action(boundary, force)

    def _work_of_bend(self, name: str, q: float) -> float:
        """Work of the reactions on the change of the sleeve's rate by a parameter; of all ranks, whole bushing."""
        bend = self.model.motion.boundary_bend(name, q)
        return 0.0 if bend is None else self._on_reactions(bend)

    def _stiffness(self, q: float, rate: Array) -> float:
        """dQ/dq: the tangent's work on v, and that of the reactions on the bend of a rotating sleeve's path."""
        model, step = self.model, BEND * max(abs(q), 1.0)
        force = np.zeros_like(rate)
        model.body.add_action(rate, force)
        model.surfaces.add_action(rate, force)
        tangent = float(sum_over_ranks(self.model.comm, force @ rate)) * model.multiplicity
        bend = np.asarray((model.rate(q + step) - model.rate(q - step)) / (2.0 * step), dtype=np.float64)
        return tangent + (self._on_reactions(bend) if bend.any() else 0.0)

    def _on_reactions(self, bend: Array) -> float:
        model = self.model
        force = np.zeros_like(bend)
        model.body.add_forces(model.state.x.array, force)
        model.surfaces.add_forces(force)
        return float(sum_over_ranks(model.comm, force @ bend)) * model.multiplicity

    # -- with memory ---------------------------------------------------------------------------------------------

    def _solutions(self, solver: Equilibrium, forces: Array) -> tuple[Array, Array]:
        """Return dx/dq, (n,), and the responses of the free unknowns to forces of this rank, (names, n)."""
        model = self.model
        right = complete_forces(model, forces)
        if solver.border is not None:
            return solver.tangent_rate(), solve_under_forces(model, solver.factor, right)
        solutions = self._refine(solver, right)
        if solutions is None:
            solver.factorise(stiffened=True)
            b = model.system.create_vector()
            model.system.lift(b, solver.rate)
            lifted = np.zeros_like(solver.rate)
            lifted[: model.system.owned] = b.array_r
            b.destroy()
            solutions = solve_under_forces(model, solver.factor, np.vstack([lifted, right]))
            if not model.system.symmetric:
                dofs = model.motion.constrained.dofs
                solutions[0, dofs] = solver.rate[dofs]
                solutions = self._refine_skew(
                    solver, np.vstack([np.zeros_like(solver.rate), right]), solutions
                )
        self._last.add(solver.q, solutions)
        return solutions[0], solutions[1:].copy()

    @staticmethod
    def _refine_skew(solver: Equilibrium, loads: Array, guess: Array) -> Array:
        """Refine solutions obtained with the tangent's symmetric part until they satisfy the tangent itself."""
        state = ConvergedState(solver.model, solver.factor, solver.q, solver.rate, solver.tolerance)
        solutions = solve_by_refinement(state, loads, guess, MOST_OF_SKEW)
        if solutions is None:
            raise failure_at_start("the tangent is far from symmetric")
        return solutions

    def _refine(self, solver: Equilibrium, right: Array) -> Array | None:
        """Solve for both by refining an extrapolation of the last steps; None unless the step was short."""
        if not self._last.q or self.model.mesh.dimension == 2 or not solver.fresh(SHORT):
            return None  # in the half-plane a factorisation costs less
        guess = self._last.extrapolate(solver.q)
        dofs = self.model.motion.constrained.dofs
        guess[0, dofs] = solver.rate[dofs]
        state = ConvergedState(self.model, solver.ksp, solver.q, solver.rate, solver.tolerance)
        return solve_by_refinement(state, np.vstack([np.zeros_like(solver.rate), right]), guess)
