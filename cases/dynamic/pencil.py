"""The matrices of small vibrations about an equilibrium, K_eq + s K_N - omega^2 M, as actions on vectors.

K_eq is the tangent at the equilibrium. A Maxwell branch at rest there adds its complex modulus g mu i omega tau / (1 +
i omega tau) times int 2 dev eps(v) : dev eps(w) dV, eps(v) = sym(grad v F^-1): one matrix mu K_N for all branches,
whose complex moduli over mu sum to s. M is the mass. Contact keeps the status that it has at the equilibrium.

The pressure's equations have neither branches nor mass. Every vector that solves K_eq x = f without forces on pressures
fulfils them, and so does every sum of such vectors: on them the forms are those of the displacements alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.model import FiniteElementModel
from cases.newton import negative_eigenvalues
from cases.ranks import summed
from cases.rigid import completed, reactions, solved, turned
from cases.six import possible, skew

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
        Unit motions of the boundaries: those of the driven sleeve, then (of a bushing) those of the held one.
    driven : int
        Number of the former.
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
        self._spring = model.body.rubber.resting_moduli()
        self._spring *= model.shear_modulus
        self._metal = [metal[name] for name in model.mesh.sleeves]
        self._state = model.state.x.array.copy()
        self.static: Array = np.zeros((0, 0))
        self.motions, self.driven = self._motions(solver.q)

    def _motions(self, q: float) -> tuple[Array, int]:
        motion = self.model.motion
        residual = self.model.system.create_vector()
        self.model.system.residual(residual)
        if motion.six is not None:
            moves = list(possible(self.model.mesh.mirrors))
            twists = np.vstack([motion.twists(q)[moves], motion.held_twists(q)[moves]])
            forces = reactions(self.model, residual, q)
            self.static = np.zeros((12, 12))
            self.static[3:6, 3:6] = turned(self.model, residual, q) + 0.5 * skew(forces[3:])
            # Moments of the held sleeve are about the centre of the driven one, which moves.
            self.static[9:, :3] = -skew(forces[:3])
            self.static[9:, 3:6] = -0.5 * skew(forces[3:])
            both = [*moves, *(6 + k for k in moves)]
            self.static = self.static[np.ix_(both, both)]
            found, driven = motion.over_all(twists), len(moves)
        else:
            rate = motion.rate(q)
            rates = [rate] if self.model.mode.specimen == "coupon" else [rate, motion.held_rate()]
            bend = (motion.rate(q + BEND) - motion.rate(q - BEND)) / (2.0 * BEND)
            owned = self.model.system.owned
            work = float(summed(self.model.comm, float(residual.array_r @ bend[:owned])))
            self.static = np.zeros((len(rates), len(rates)))
            self.static[0, 0] = work * self.model.multiplicity
            found, driven = np.array(rates), 1
        residual.destroy()
        return found, driven

    def act(self, directions: Array) -> Actions:
        """Multiply all matrices with some vectors, shape (k, n)."""
        directions = np.ascontiguousarray(directions)
        viscous, rubber, metal = (np.zeros_like(directions) for _ in range(3))
        body = self.model.body
        body.rubber.points.add_action(self._spring, directions, viscous)
        if self.model.mode.specimen == "bushing":
            body.rubber.points.add_inertia(self._state, directions, rubber)
        for part, density in zip(body.parts[1:], self._metal, strict=True):
            own = np.zeros_like(directions)
            part.points.add_inertia(self._state, directions, own)
            metal += density * own
        return Actions(self.model.system.pulls(directions), viscous, rubber, metal)

    def followed(self) -> Array:
        """Response of the body to each of the motions at rest, K_eq alone; shape (m, n)."""
        pull = completed(self.model, self.model.system.pulls(np.ascontiguousarray(self.motions)))
        return self.motions - solved(self.model, self._solver.factor, pull)

    def solve(self, forces: Array) -> Array:
        """Solve K_eq x = f in the free unknowns.

        Parameters
        ----------
        forces
            This rank's contributions, shape (k, n); what acts on constrained unknowns is left out.
        """
        return solved(self.model, self._solver.factor, completed(self.model, forces))

    def products(self, left: Array, forces: Array) -> Array:
        """Return the work of forces, contributions of this rank (l, n), on motions, (k, n): shape (k, l)."""
        work = np.asarray(summed(self.model.comm, left @ forces.T))
        return work * self.model.multiplicity
