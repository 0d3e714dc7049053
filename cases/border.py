"""Free motions of the inner sleeve as unknowns beside those of the mesh: a bordered tangent.

A motion that is not prescribed is one more unknown, and its reaction, which is the load, one more equation. Both use
the entry of a constrained unknown in PETSc's vectors, which is otherwise unused. A rotation is expressed as the length
of an arc and a moment as a force along it, so that all entries are in mm and N. The bordered tangent is solved by its
Schur complement on the sleeve's rigid motions (`cases.rigid`), with the factorisation of the rest.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.model import FiniteElementModel
from cases.motion import pose_motion_of
from cases.ranks import sum_over_ranks
from cases.rates import with_ghosts
from cases.rigid import NoFactorisation, Tangent, tangent
from cases.six import twist_of

Array = NDArray[np.float64]


class Border:
    """Free motions of a model, and the bordered tangent as PETSc's preconditioner.

    Parameters
    ----------
    model
        Model of a path of six motions, some of which are free.

    Attributes
    ----------
    factor : PETSc.KSP
        Factorisation of the tangent in the mesh's own free unknowns.
    """

    def __init__(self, model: FiniteElementModel) -> None:
        self._model, self._motion = model, pose_motion_of(model.motion)
        self._free = list(self._motion.free_numbers)
        count = len(self._free)
        dofs = model.system.owned_constrained
        ranks = [rank for rank, number in enumerate(model.comm.allgather(len(dofs))) if number >= count]
        self._home = ranks[0]
        self._slots = dofs[:count] if model.comm.rank == self._home else dofs[:0]
        extent = float(
            model.comm.allreduce(np.abs(model.mesh.mesh.geometry.x[:, :2]).max(initial=0.0), MPI.MAX)
        )
        # mm of a free unknown per mm or rad of its motion.
        self._length = np.array([1.0 if k < 3 else extent for k in self._free])
        self._q = 0.0
        self._tangent: Tangent | None = None
        self._columns: Array = np.zeros((6, count))
        self.factor = PETSc.KSP().create(model.comm)
        self.factor.setType("preonly")
        self.factor.getPC().setType("cholesky")
        self.factor.getPC().setFactorSolverType("mumps")

    # -- in vectors ----------------------------------------------------------------------------------------------

    def read(self, x: PETSc.Vec) -> Array:
        """Return the free motions (mm, rad) stored in a vector; collective."""
        return self._broadcast(x.array_r[self._slots]) / self._length

    def write(self, x: PETSc.Vec, motions: Array) -> None:
        """Put free motions (mm, rad) into a vector.

        Parameters
        ----------
        x : PETSc.Vec
            Vector over the unknowns; changed in place.
        motions : Array
            Free motions, mm or rad, shape (number of free motions,).
        """
        x.array_w[self._slots] = (motions * self._length)[: len(self._slots)]

    def write_forces(self, b: PETSc.Vec, reactions: Array) -> None:
        """Put what the reactions (6,) of the whole bushing exceed the load by into a residual of the part modelled.

        Parameters
        ----------
        b : PETSc.Vec
            Vector over the unknowns; changed in place.
        reactions : Array
            Forces (N) and moments (N mm) of the whole bushing, shape (6,); those of held motions are not used.
        """
        share = reactions[self._free] / (self._length * self._model.multiplicity)
        b.array_w[self._slots] = share[: len(self._slots)]

    def _broadcast(self, at_home: Array) -> Array:
        comm = self._model.comm
        return (
            np.array(at_home) if comm.size == 1 else np.asarray(comm.bcast(at_home.copy(), root=self._home))
        )

    # -- the bordered tangent ------------------------------------------------------------------------------------

    def at(self, q: float) -> None:
        """Record the parameter of the path at which the tangent has just been assembled."""
        self._q, self._tangent = q, None

    def setUp(self, pc: PETSc.PC) -> None:
        """Factorise, and solve for rigid motions (called by PETSc)."""
        matrix = pc.getOperators()[0]
        self.factor.setOperators(matrix)
        turning = any(k >= 3 for k in self._free)
        motions = sorted({*self._free, *((3, 4, 5) if turning else ())})
        try:
            pose_tangent = tangent(self._model, self.factor, self._q, motions)
        except NoFactorisation:
            # The linear solver then fails, and the step is cut back.
            pc.setFailedReason(PETSc.PC.FailedReason.FACTOR_OTHER)
            return
        self._columns = twist_of(self._motion.pose(self._q))[:, self._free]
        self._tangent = pose_tangent
        self._schur = (pose_tangent.stiffness @ self._columns)[self._free] / self._model.multiplicity

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve the bordered system (called by PETSc).

        Parameters
        ----------
        pc : PETSc.PC
            The calling preconditioner; not used.
        b : PETSc.Vec
            Right-hand side; unchanged.
        x : PETSc.Vec
            Receives the solution.
        """
        pose_tangent = self._tangent
        assert pose_tangent is not None
        reactions = self._broadcast(b.array_r[self._slots]) * self._length
        right = b.copy()
        right.array_w[self._model.system.owned_constrained] = 0.0
        self.factor.solve(right, x)
        owned = self._model.system.owned
        reactions -= sum_over_ranks(self._model.comm, pose_tangent.pull[self._free, :owned] @ x.array_r)
        motions = np.linalg.solve(self._schur, reactions)
        answers = (self._columns @ motions) @ pose_tangent.answers[:, :owned]
        answers[self._model.system.owned_constrained] = 0.0
        x.array_w[:] = x.array_r + answers
        self.write(x, motions)
        right.destroy()

    def release(self) -> None:
        """Free the PETSc objects. A method named `destroy` would be called by PETSc."""
        self.factor.destroy()

    # -- along the path ------------------------------------------------------------------------------------------

    def rate(self, ksp: PETSc.KSP, rate: Array, ahead: bool = False) -> tuple[Array, Array]:
        """Return the rates of all local unknowns and of the free motions by q, from the tangent assembled last.

        Parameters
        ----------
        ksp
            Solver whose preconditioner is this object.
        rate
            Rate of the constrained unknowns with the free motions at rest, shape (n,), mm per unit of q.
        ahead
            At a corner of the path: take the rate of the load after it.
        """
        model, pose_tangent = self._model, self._tangent
        assert pose_tangent is not None
        constrained = model.motion.constrained.dofs
        twists = self._motion.twists(self._q)
        twist = _coordinates(model, twists, rate[constrained])
        b, x = model.system.create_vector(), model.system.create_vector()
        model.system.apply_tangent(b, rate)
        owned = constrained < model.system.owned
        work = twists[:, owned] @ b.array_r[constrained[owned]]
        change = np.asarray(sum_over_ranks(model.comm, work)) * model.multiplicity
        change[3:] += pose_tangent.arms @ twist[3:]
        b.array_w[model.system.owned_constrained] = 0.0
        self.write_forces(b, change - self._motion.path.load_rate(self._q, ahead))
        b.scale(-1.0)
        ksp.solve(b, x)
        free, answer = self.read(x), with_ghosts(x)
        answer[constrained] = 0.0
        for vector in (b, x):
            vector.destroy()
        return answer + rate + model.motion.over_all((self._columns @ free) @ twists), free


def _coordinates(model: FiniteElementModel, twists: Array, rate: Array) -> Array:
    """Return the twist (6,) that moves the constrained unknowns at their rate; collective."""
    normal = np.asarray(sum_over_ranks(model.comm, twists @ twists.T))
    return np.asarray(
        np.linalg.lstsq(normal, np.asarray(sum_over_ranks(model.comm, twists @ rate)), rcond=None)[0]
    )
