"""6 x 6 stiffness against rigid motions of the inner sleeve, from one factorisation of the tangent.

Let G_k be the constrained unknowns per unit of the twist k, K the tangent and R the residual. V_k = (-K_ff^-1 K_fc G_k,
G_k) is the body's response, and V_k . K V_l + R . dG_k/dl is the derivative of the reaction k by the motion l; its
second term is due to the present forces on lever arms that turn. The reported moments are about axes that do not turn,
for which this term is not symmetric: a rotation first about x and then about y differs from one in the opposite order.
It differs from the second derivative of the energy by half the cross product with the moment (`Tangent.symmetric`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.model import FiniteElementModel
from cases.motion import pose_motion_of
from cases.ranks import sum_over_ranks
from cases.rates import with_ghosts
from cases.reaction import reactions
from cases.six import possible, skew, twist_of

Array = NDArray[np.float64]


class NoFactorisation(ArithmeticError):
    """The tangent could not be factorised, for example because it is singular."""


@dataclass(frozen=True)
class Tangent:
    """Stiffness against rigid motions of the inner sleeve, at one state.

    Attributes
    ----------
    stiffness : shape (6, 6)
        Derivative of the reactions (N, N mm; moments about axes that do not turn) by twists (mm, rad); zero in motions
        that a plane of symmetry rules out.
    answers : shape (6, n)
        Response of all local unknowns to each twist.
    pull : shape (6, n)
        K_fc G_k on the free unknowns of this rank, zero elsewhere.
    arms : shape (3, 3)
        Part of the stiffness that is due to the present forces on lever arms that turn, N mm/rad.
    moment : shape (3,)
        Moment on the sleeve at that state, N mm.
    """

    stiffness: Array
    answers: Array
    pull: Array
    arms: Array
    moment: Array

    @property
    def symmetric(self) -> Array:
        """Second derivative of the stored energy, (6, 6): by the centre's displacement and a rotation vector from here.

        It is symmetric where the rubber has no memory, without averaging.
        """
        stiffness = self.stiffness.copy()
        # dM = K_sym w + w x M / 2, for a twist w.
        stiffness[3:, 3:] += 0.5 * skew(self.moment)
        return stiffness


def tangent(
    model: FiniteElementModel, ksp: PETSc.KSP, q: float, motions: Sequence[int] = range(6)
) -> Tangent:
    """Solve for the response of the body to all rigid motions together.

    Parameters
    ----------
    model
        At an equilibrium or near one, its moduli up to date (`System.stiffen`, `System.tangent`).
    ksp
        Solver with the factorised tangent of the state.
    q
        Path's parameter, s.
    motions
        Motions by number; the others' rows and columns are zero.
    """
    twist = model.motion.over_all(pose_motion_of(model.motion).twists(q))
    allowed = [k for k in motions if k in possible(model.mesh.mirrors)]
    pull = np.zeros_like(twist)
    forces = np.zeros_like(twist)
    b = model.system.create_vector()
    for k in allowed:
        model.system.apply_tangent(b, twist[k])
        forces[k] = with_ghosts(b)
        pull[k] = forces[k]
        pull[k, model.motion.constrained.dofs] = 0.0
    answers = np.zeros_like(twist)
    answers[allowed] = twist[allowed] - solve_under_forces(model, ksp, pull[allowed])
    owned = slice(0, model.system.owned)
    work = twist[:, owned] @ forces[:, owned].T + pull[:, owned] @ answers[:, owned].T
    model.system.residual(b)
    stiffness = np.asarray(sum_over_ranks(model.comm, work)) * model.multiplicity
    arms = work_on_turning_arms(model, b, q)
    stiffness[3:, 3:] += arms
    moment = reactions(model, b, q)[3:]
    b.destroy()
    mask = np.zeros(6)
    mask[allowed] = 1.0
    return Tangent(stiffness * np.outer(mask, mask), answers, pull, arms, moment)


def adjoint(model: FiniteElementModel, ksp: PETSc.KSP, q: float, reaction: int) -> Array:
    """Return the direction (n,) whose work on the derivative of the forces is the change of a reaction.

    Free motions then move such that their reactions stay zero.

    Parameters
    ----------
    model, ksp, q
        As in `tangent`; q in s.
    reaction
        Number of the reaction.
    """
    motion, pose_tangent = pose_motion_of(model.motion), tangent(model, ksp, q)
    coupled = [k for k in motion.free_numbers if pose_tangent.stiffness[k].any()]
    direction: Array = pose_tangent.answers[reaction].copy()
    if coupled:
        columns = pose_tangent.stiffness @ twist_of(motion.pose(q))[:, coupled]
        direction -= np.linalg.solve(columns[coupled].T, columns[reaction]) @ pose_tangent.answers[coupled]
    return direction


def complete_forces(model: FiniteElementModel, forces: Array) -> Array:
    """Add what all ranks contribute to each unknown's force, and clear those of constrained ones.

    Parameters
    ----------
    model
        The model.
    forces
        This rank's contributions, shape (k, n) over all local unknowns.

    Returns
    -------
    ndarray, shape (k, n)
        Right-hand sides of `solve_under_forces`; zero in ghosts.
    """
    if model.comm.size == 1:
        complete = forces.copy()
        complete[:, model.system.owned_constrained] = 0.0
        return complete
    complete = np.zeros_like(forces)
    b = model.system.create_vector()
    for force, row in zip(forces, complete, strict=True):
        with b.localForm() as local:
            local.array_w[:] = force
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        b.array_w[model.system.owned_constrained] = 0.0
        row[: model.system.owned] = b.array_r
    b.destroy()
    return complete


def solve_under_forces(model: FiniteElementModel, ksp: PETSc.KSP, forces: Array) -> Array:
    """Solve for the free unknowns under forces on them.

    Parameters
    ----------
    model, ksp
        The model, and a solver with the factorised tangent.
    forces
        Shape (k, n) over all local unknowns, with this rank's own entries complete and no constrained ones.

    Returns
    -------
    ndarray, shape (k, n)

    Raises
    ------
    NoFactorisation
    """
    ksp.setUp()
    if ksp.getPC().getFailedReason():
        # MUMPS would be asked for a solution without a factorisation, which is an error in the program.
        raise NoFactorisation
    owned = np.ascontiguousarray(forces[:, : model.system.owned])
    shape = ((owned.shape[1], None), (None, len(owned)))
    # PETSc stores columns one after the other: the rows of these arrays.
    right, answers = (
        PETSc.Mat().createDense(shape, array=rows.T, comm=model.comm)
        for rows in (owned, np.zeros_like(owned))
    )
    # Solved together they take a third of the time of solving one by one.
    ksp.matSolve(right, answers)
    dense = np.array(answers.getDenseArray(readonly=True).T, order="C")
    right.destroy()
    answers.destroy()
    if model.comm.size == 1:
        return dense
    b, solutions = model.system.create_vector(), np.empty_like(forces)
    for row, complete in zip(dense, solutions, strict=True):
        b.array_w[:] = row
        complete[:] = with_ghosts(b)
    b.destroy()
    return solutions


def work_on_turning_arms(model: FiniteElementModel, residual: PETSc.Vec, q: float) -> Array:
    """Work of the present forces on arms r that turn, R . (e_k x (e_l x r)) = D_lk - tr D at k = l, (3, 3).

    Parameters
    ----------
    model, residual, q
        As in `reactions`; q in s.
    """
    c = model.motion.constrained
    owned = np.flatnonzero((c.dofs < model.system.owned) & c.driven)
    force, arms = residual.array_r[c.dofs[owned]], pose_motion_of(model.motion).arms(q)[:, owned]
    components = np.eye(3)[:, c.component[owned]]
    # D_ab: the sum of the force's component a times the arm's b.
    dyad = np.asarray(sum_over_ranks(model.comm, (components * force) @ arms.T)) * model.multiplicity
    return np.asarray(dyad.T - np.trace(dyad) * np.eye(3))
