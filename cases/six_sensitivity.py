"""d(reactions)/d(parameter) along a path of six motions, exactly.

With the sleeve held, the reaction k changes by V_k . dR/dc, with V_k the body's response to the motion k
(`cases.rigid`): six solutions with one factorisation serve all parameters, as one does where q alone moves the sleeve
(`cases.sensitivity`). Free motions then give way until their reactions vanish again: a system of at most six equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.load import PrescribedForce
from cases.motion import pose_motion_of
from cases.ranks import sum_over_ranks
from cases.rigid import Tangent, complete_forces, solve_under_forces, tangent
from cases.sensitivity import BEND, Sensitivity
from cases.series import SeriesSpring
from cases.six import twist_of
from cases.slopes import Slopes

Array = NDArray[np.float64]


class SixSensitivity(Sensitivity):
    """Derivatives of all six reactions, step by step.

    Attributes
    ----------
    reactions : shape (6, names)
        Derivatives of the reactions by each parameter, at the last step.
    motions : shape (6, names)
        Derivatives of the pose; nonzero in free motions only.
    """

    def __call__(
        self,
        solver: Equilibrium,
        path_rates: Mapping[str, float] | None = None,
        drive: SeriesSpring | PrescribedForce | None = None,
        time: float = 0.0,
    ) -> tuple[Array, Array]:
        """Derivatives of the power Q and of q, shape (names,) each; those of the reactions become attributes.

        Parameters
        ----------
        solver
            Solver that has just found the equilibrium.
        path_rates, drive, time
            As in `Sensitivity`; a path of six motions has none of them.
        """
        assert not path_rates
        assert drive is None
        model, motion, q = self.model, pose_motion_of(self.model.motion), solver.q
        solver.factorise()
        pose_tangent = tangent(model, solver.factor, q)
        slopes = Slopes(model.body, model.state.x.array)
        changes = [self._change(name) for name in self.names]
        boundaries = [motion.boundary_rate(name, q) for name in self.names]
        forces = self._forces(slopes, changes, boundaries)
        if model.path_dependent:
            movements = solve_under_forces(model, solver.factor, complete_forces(model, -forces))
        if not model.system.symmetric:
            pose_tangent, movements = self._whole(solver, pose_tangent, movements, -forces)
            forces += model.system.pulls(movements)
        held_forces = (
            np.asarray(sum_over_ranks(model.comm, pose_tangent.answers @ forces.T)) * model.multiplicity
        )
        for i, name in enumerate(self.names):
            if motion.arms_depend_on(name):
                bends = motion.over_all(motion.twists(q, by=name))
                held_forces[:, i] += [self._on_reactions(bend) for bend in bends]
        columns = twist_of(motion.pose(q))
        given_way = self._given_way(pose_tangent.stiffness @ columns, held_forces)
        self.motions = given_way
        self.reactions = held_forces + pose_tangent.stiffness @ columns @ given_way
        if model.path_dependent:
            movements += (columns @ given_way).T @ pose_tangent.answers
            for i, boundary in enumerate(boundaries):
                movements[i] += 0.0 if boundary is None else boundary
            self.memory = list(slopes.memory_after(self.names, changes, self.memory, list(movements)))
        return self._power(solver), np.zeros(len(self.names))

    def _whole(
        self, solver: Equilibrium, pose_tangent: Tangent, movements: Array, forces: Array
    ) -> tuple[Tangent, Array]:
        """Refine responses found with the tangent's symmetric part until they satisfy the whole tangent."""
        model, six = self.model, len(pose_tangent.answers)
        loads = np.vstack([np.zeros_like(pose_tangent.answers), complete_forces(model, forces)])
        better = self._refine_skew(solver, loads, np.vstack([pose_tangent.answers, movements]))
        answers = better[:six]
        work = answers @ model.system.pulls(answers).T
        stiffness = np.asarray(sum_over_ranks(model.comm, work)) * model.multiplicity
        possible = np.any(answers[3:] != 0.0, axis=1)
        stiffness[3:, 3:] += pose_tangent.arms * possible * possible[:, None]
        return replace(pose_tangent, answers=answers, stiffness=stiffness), better[six:]

    def _given_way(self, stiffness: Array, held_forces: Array) -> Array:
        """Return the change of the pose, (6, names), that keeps the reactions of free motions at zero."""
        free = self.model.motion.free_numbers
        motions = np.zeros_like(held_forces)
        # Motions that symmetry rules out have no stiffness, and no need to move.
        coupled = [k for k in free if stiffness[k].any()]
        if coupled:
            motions[coupled] = -np.linalg.solve(stiffness[np.ix_(coupled, coupled)], held_forces[coupled])
        return motions

    def _power(self, solver: Equilibrium) -> Array:
        """Derivative of the power, through the reactions and through the twists along the path."""
        motion, q = pose_motion_of(self.model.motion), solver.q
        assert solver.six is not None
        pose, rate = motion.pose(q), motion.path.rate(q)
        total = (twist_of(pose) @ rate) @ self.reactions
        for i in range(len(self.names)):
            step = BEND * self.motions[:, i]
            if step.any():
                bend = (twist_of(pose + step) - twist_of(pose - step)) / (2.0 * BEND)
                total[i] += solver.six @ bend @ rate
        return np.asarray(total)
