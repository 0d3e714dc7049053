"""The matrices of small vibrations about an equilibrium, K_eq + s K_N - omega^2 M, as actions on vectors.

K_eq is the tangent at the equilibrium. A Maxwell branch at rest there adds its complex modulus g mu i omega tau / (1 +
i omega tau) times int 2 dev eps(v) : dev eps(w) dV, eps(v) = sym(grad v F^-1): one matrix mu K_N for all branches,
whose complex moduli over mu sum to s. M is the mass. Contact keeps the status that it has at the equilibrium.

The pressure's equations have neither branches nor mass. Every vector that solves K_eq x = f without forces on pressures
fulfils them, and so does every sum of such vectors: on them the forms are those of the displacements alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.model import FiniteElementModel
from cases.motion import PoseMotion
from cases.newton import negative_eigenvalues
from cases.ranks import sum_over_ranks
from cases.reaction import reactions
from cases.rigid import complete_forces, solve_under_forces, work_on_turning_arms
from cases.six import possible, skew
from geometry.dolfinx_api import collapse

Array = NDArray[np.float64]

# Step of the central difference of a sleeve's rate by q: sines and cosines, exact to rounding.
BEND = 1e-5


class Unstable(ValueError):
    """The equilibrium is no minimum of the energy: it does not stay there, whatever vibrates."""


@dataclass(frozen=True)
class Actions:
    """Products of the matrices with some vectors: this rank's contributions, shape (k, n) each.

    Attributes
    ----------
    equilibrium, viscous
        K_eq, and mu K_N (N/mm; N mm with rotations).
    rubber, metal
        Mass of the rubber per unit of its density (mm^3), and of the elastic sleeves (t).
    """

    equilibrium: Array
    viscous: Array
    rubber: Array
    metal: Array

    def with_(self, other: Actions) -> Actions:
        """Return the products with these vectors and others after them."""
        return Actions(*(np.vstack([vars(self)[name], vars(other)[name]]) for name in vars(self)))


class Pencil:
    """K_eq, K_N and M of a model at the equilibrium that was found last.

    Parameters
    ----------
    model
        Without branches: they are at rest, and have no stress.
    solver
        Solver that has just found the equilibrium.
    metal
        Density of each elastic sleeve, t/mm^3.

    Attributes
    ----------
    motions : shape (m, n)
        Unit motions of the driven sleeve.
    rigid : shape (m, n)
        The same motions of the whole body, (0, n) for a coupon.
    spring : shape (points, upper triangle)
        mu K_N at each point, by the gradients, MPa.
    static : shape (m, m)
        Stiffness due to the present forces on lever arms that turn, N and mm.

    Raises
    ------
    Unstable
        The tangent has negative eigenvalues.
    """

    def __init__(self, model: FiniteElementModel, solver: Equilibrium, metal: Mapping[str, float]) -> None:
        self.model, self._solver = model, solver
        solver.factorise()
        if negative_eigenvalues(solver.factor) > model.system.free_pressures:
            raise Unstable
        self._metal = [metal[name] for name in model.mesh.sleeves]
        space, self._parent = collapse(model.space.sub(0))
        self._nodes: Array = space.tabulate_dof_coordinates()[:, : model.mesh.dimension].T
        self._take(solver.q)

    def at(self, q: float) -> Pencil:
        """Return the matrices at the model's present state and parameters, near the equilibrium: no `solve` there.

        Parameters
        ----------
        q
            Displacement of the sleeve, mm or rad.
        """
        pencil = copy(self)
        pencil.model.system.stiffen()
        pencil._take(q)
        return pencil

    def _take(self, q: float) -> None:
        model = self.model
        self.spring = model.body.rubber.resting_moduli()
        self.spring *= model.shear_modulus
        self._state = model.state.x.array.copy()
        self.static: Array = np.zeros((0, 0))
        self.motions = self._motions(q)
        self.rigid = self._rigid(q)

    def _motions(self, q: float) -> Array:
        motion, system = self.model.motion, self.model.system
        residual = system.create_vector()
        system.residual(residual)
        if isinstance(motion, PoseMotion):
            moves = list(possible(self.model.mesh.mirrors))
            turning = np.zeros((6, 6))
            # Symmetric as the second derivative of the energy (`cases.rigid`).
            turning[3:, 3:] = work_on_turning_arms(self.model, residual, q)
            turning[3:, 3:] += 0.5 * skew(reactions(self.model, residual, q)[3:])
            self.static = turning[np.ix_(moves, moves)]
            motions = motion.over_all(motion.twists(q)[moves])
        else:
            bend = (motion.rate(q + BEND) - motion.rate(q - BEND)) / (2.0 * BEND)
            work = float(sum_over_ranks(self.model.comm, float(residual.array_r @ bend[: system.owned])))
            self.static = np.full((1, 1), work * self.model.multiplicity)
            motions = motion.rate(q)[None]
        residual.destroy()
        return motions

    def _rigid(self, q: float) -> Array:
        if self.model.mode.specimen == "coupon":
            return self.motions[:0]
        model = self.model
        components = len(self._parent) // self._nodes.shape[1]
        # Of the half-plane the radius and z; its angle moves no point of it.
        plane = [0, components - 1] if model.mesh.dimension == 2 else [0, 1, 2]
        positions = self._nodes + self._state[self._parent].reshape(-1, components).T[plane]
        rigid_motions = model.motion.rigid(positions, q)
        motions = np.zeros((len(rigid_motions), len(self._state)))
        motions[:, self._parent] = rigid_motions.transpose(0, 2, 1).reshape(len(rigid_motions), -1)
        return motions

    def act(self, directions: Array) -> Actions:
        """Multiply all matrices with some vectors, shape (k, n)."""
        directions = np.ascontiguousarray(directions)
        viscous, rubber, metal = (np.zeros_like(directions) for _ in range(3))
        body = self.model.body
        body.rubber.points.add_action(self.spring, directions, viscous)
        if self.model.mode.specimen == "bushing":
            body.rubber.points.add_inertia(self._state, directions, rubber)
        for part, density in zip(body.parts[1:], self._metal, strict=True):
            inertia = np.zeros_like(directions)
            part.points.add_inertia(self._state, directions, inertia)
            metal += density * inertia
        return Actions(self.model.system.pulls(directions), viscous, rubber, metal)

    def followed_motions(self) -> Array:
        """Response of the body to each of the sleeve's motions, K_eq alone; shape (m, n)."""
        pull = complete_forces(self.model, self.model.system.pulls(np.ascontiguousarray(self.motions)))
        return self.motions - solve_under_forces(self.model, self._solver.factor, pull)

    def solve(self, forces: Array) -> Array:
        """Solve K_eq x = f in the free unknowns.

        Parameters
        ----------
        forces
            This rank's contributions, shape (k, n); what acts on constrained unknowns is left out.
        """
        return solve_under_forces(self.model, self._solver.factor, complete_forces(self.model, forces))

    def products(self, left: Array, forces: Array) -> Array:
        """Return the work of forces on motions, shape (k, l).

        Parameters
        ----------
        left
            Motions, shape (k, n), mm or rad.
        forces
            Contributions of this rank, shape (l, n), N or N mm.
        """
        work = np.asarray(sum_over_ranks(self.model.comm, left @ forces.T))
        return work * self.model.multiplicity
