"""SNES along the program: the one place where a load is applied and a solution is judged.

Newton with a line search and a sparse LDL^T factorisation. Each step starts from an extrapolation of the
last states; the first one from the tangent. A step that does not converge is cut back and grows again. Every attempt is
recorded.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.model import Model
from cases.program import Program
from cases.reaction import reaction
from cases.sensitivity import Sensitivity

Array = NDArray[np.float64]

# Out-of-balance force over the norm of the reactions. Newton's last step is quadratic: what is accepted at 1e-7
# is nearly always below 1e-10, and the force, a first integral of the energy, is better still.
TOLERANCE = 1e-7
MAX_NEWTON = 25
# A step cut back to this share of the program's largest step is given up.
SMALLEST_CUT = 1.0 / 256
# Few Newton iterations mean that a step was easy, and the next may grow.
EASY_NEWTON = 4
# Parabola through the last three: a cubic overshoots where the free surface folds.
PREDICTOR_STATES = 3


@dataclass(frozen=True)
class Attempt:
    """One try at a step: from and to (mm or rad), Newton iterations, SNES reason by name, seconds."""

    start: float
    stop: float
    newton: int
    reason: str
    seconds: float

    @property
    def accepted(self) -> bool:
        """Whether SNES converged."""
        return not self.reason.startswith("DIVERGED")


@dataclass(frozen=True)
class History:
    """What the march went through.

    Attributes
    ----------
    displacement, force : shape (n,)
        q (mm or rad) and Q (N, N mm; MPa for a coupon) at the program's targets reached.
    time : shape (n,) or None
        Seconds, from the program.
    energy : shape (n,)
        Stored energy, N mm.
    newton : shape (n,)
        Newton iterations from the target before, failed attempts included.
    attempts
        Every try, accepted or not.
    states : shape (n, m) or None
        This rank's unknowns at the targets, if they were kept.
    sensitivity : shape (n, parameters) or None
        Derivative of the force with respect to the parameters asked for.
    """

    displacement: Array
    force: Array
    time: Array | None
    energy: Array
    newton: NDArray[np.int64]
    attempts: tuple[Attempt, ...]
    states: Array | None = None
    sensitivity: Array | None = None


class NotConverged(RuntimeError):
    """The march could not go on.

    Attributes
    ----------
    history
        What it has, at the targets reached.
    target, last
        Where it was going and the last displacement in equilibrium, mm or rad.
    reason
        SNES's, by name.
    """

    def __init__(self, history: History, target: float, reason: str, last: float) -> None:
        self.history, self.target, self.reason, self.last = history, target, reason, last
        super().__init__(
            f"no equilibrium found beyond displacement {last:.6g} on the way to {target:.6g} ({reason})"
        )


Progress = Callable[[int, int, int, float], None]
"""Called after each target with step, number of steps, Newton iterations, displacement."""


@dataclass
class _Path:
    """Converged points of the march, the newest last."""

    q: list[float] = field(default_factory=list)
    x: list[Array] = field(default_factory=list)

    def add(self, q: float, x: Array) -> None:
        # One state per displacement: an elastic body has one, and the extrapolation needs distinct points.
        keep = [i for i, known in enumerate(self.q) if abs(known - q) > 1e-12 * max(1.0, abs(q))]
        self.q = [*[self.q[i] for i in keep][-(PREDICTOR_STATES - 1) :], q]
        self.x = [*[self.x[i] for i in keep][-(PREDICTOR_STATES - 1) :], x]

    def extrapolate(self, q: float) -> Array:
        """Lagrange polynomial through the points, at q."""
        nodes = np.array(self.q)
        weights = [np.prod([(q - m) / (n - m) for m in nodes if m != n]) for n in nodes]
        return np.asarray(sum(w * x for w, x in zip(weights, self.x, strict=True)))


class _Solver:
    """SNES on the free unknowns of a model."""

    def __init__(self, model: Model, tolerance: float) -> None:
        self.model, self.tolerance = model, tolerance
        self.x, self.b = model.create_vector(), model.create_vector()
        self.matrix = model.create_matrix()
        self.reactions = 0.0
        self.force = self.energy = 0.0
        self.q = 0.0
        # Where nothing is loaded yet the reactions vanish, and rounding leaves some 1e-13 mu over the body's face.
        self.floor = 1e-12 * _force_scale(model)
        snes = PETSc.SNES().create(model.comm)
        snes.setFunction(self._function, self.b)
        snes.setJacobian(self._jacobian, self.matrix)
        snes.setConvergenceTest(self._test)
        snes.setTolerances(max_it=MAX_NEWTON)
        snes.setType("newtonls")
        prefix = f"bushcli_{id(self):x}_"
        snes.setOptionsPrefix(prefix)
        # The secant search minimises the residual along the step. Backtracking only asks for a decrease, which
        # the saddle point of u and p refuses too often: radial loads then stop at 42 % of the thickness.
        PETSc.Options()[prefix + "snes_linesearch_type"] = "l2"
        ksp = snes.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("mumps")
        snes.setFromOptions()
        PETSc.Options().delValue(prefix + "snes_linesearch_type")
        self.snes = snes

    def _function(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        self._to_state(x)
        self.model.assemble_residual(b)
        self.force = reaction(self.model, b, self.q)
        self.reactions = self.model.clear_constrained(b)

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, matrix: PETSc.Mat, _: PETSc.Mat) -> None:
        self.model.assemble_tangent(matrix)

    def _test(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int | None:
        if not np.isfinite(norms[2]):
            return int(PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN)
        if norms[2] <= self.tolerance * self.reactions + self.floor:
            # A locking law (Gent) has a residual beyond its limit too, but no energy there.
            self.energy = self.model.energy()
            if not np.isfinite(self.energy):
                return int(PETSc.SNES.ConvergedReason.DIVERGED_FUNCTION_DOMAIN)
            return int(PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE)
        if iteration >= MAX_NEWTON:
            return int(PETSc.SNES.ConvergedReason.DIVERGED_MAX_IT)
        return None

    def _to_state(self, x: PETSc.Vec) -> None:
        state = self.model.state.x
        state.array[: x.getLocalSize()] = x.array_r
        state.scatter_forward()

    def solve(self, q: float, guess: Array) -> tuple[int, str]:
        """Equilibrium at q from a guess of this rank's unknowns; Newton iterations and reason."""
        state = self.model.state.x
        state.array[:] = guess
        self.q = q
        self.model.impose(q)
        self.x.array_w[:] = state.array[: self.x.getLocalSize()]
        self.snes.solve(None, self.x)
        reason = self.snes.getConvergedReason()
        # SNES leaves the last trial of the line search in the state: put the accepted iterate there.
        self._to_state(self.x)
        return self.snes.getIterationNumber(), _REASONS.get(reason, str(reason))

    def tangent_rate(self, q: float) -> Array:
        """dx/dq of this rank's unknowns at the present state, by one linear solve with the tangent."""
        rate = self.model.state.x.petsc_vec.duplicate()
        self.model.assemble_tangent(self.matrix)
        self.model.lift(self.b, self.model.rate(q))
        ksp = self.snes.getKSP()
        ksp.setOperators(self.matrix)
        ksp.solve(self.b, rate)
        rate.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
        with rate.localForm() as local:
            result = local.array_r.copy()
        rate.destroy()
        return result

    def destroy(self) -> None:
        """Free the PETSc objects: the garbage collector does not do so in step on all ranks."""
        for item in (self.snes, self.matrix, self.b, self.x):
            item.destroy()


_REASONS = {
    value: name
    for name, value in vars(PETSc.SNES.ConvergedReason).items()
    if name.startswith(("CONVERGED_", "DIVERGED_"))
}


def _force_scale(model: Model) -> float:
    shear = model.law.shear_modulus(**{name: float(c.value) for name, c in model.constants.items()})
    extent = np.ptp(model.mesh.mesh.geometry.x, axis=0).max(initial=0.0)
    return abs(shear) * float(model.comm.allreduce(extent)) ** 2


def march(
    model: Model,
    program: Program,
    *,
    tolerance: float = TOLERANCE,
    keep_states: bool = False,
    sensitivity: Sequence[str] = (),
    progress: Progress | None = None,
) -> History:
    """Follow the program from the unloaded state.

    Parameters
    ----------
    model
        Its state is overwritten.
    program
        Targets in mm or rad.
    tolerance
        Out-of-balance force over the norm of the reactions.
    keep_states
        Keep this rank's unknowns at every target.
    sensitivity
        Parameters of which the force's derivative is wanted.
    progress
        Called after each target.

    Raises
    ------
    NotConverged
        The step was cut back to the smallest and still failed. Carries the history so far.
    """
    solver = _Solver(model, tolerance)
    try:
        return _march(model, solver, program, keep_states, Sensitivity(model, sensitivity), progress)
    finally:
        solver.destroy()


def _march(
    model: Model,
    solver: _Solver,
    program: Program,
    keep_states: bool,
    sensitivity: Sensitivity,
    progress: Progress | None,
) -> History:
    targets = program.displacement
    rows: list[tuple[float, float, float, int]] = []
    attempts: list[Attempt] = []
    states: list[Array] = []
    derivatives: list[Array] = []
    model.state.x.array[:] = 0.0
    known = _Path()
    known.add(0.0, model.state.x.array.copy())
    q = 0.0
    rate: Array | None = None
    smallest = SMALLEST_CUT * max(float(np.abs(np.diff(targets, prepend=0.0)).max()), 1e-12)
    step = np.inf

    def history() -> History:
        columns = np.array(rows, dtype=float).reshape(-1, 4)
        time_ = None if program.time is None else program.time[: len(rows)]
        return History(
            displacement=columns[:, 0],
            force=columns[:, 1],
            time=time_,
            energy=columns[:, 2],
            newton=columns[:, 3].astype(int),
            attempts=tuple(attempts),
            states=np.array(states) if keep_states else None,
            sensitivity=np.array(derivatives) if sensitivity.names else None,
        )

    for number, target in enumerate(targets):
        newton = 0
        while True:
            goal = target if abs(target - q) <= step * (1 + 1e-9) else q + np.copysign(step, target - q)
            if len(known.q) > 1:
                guess = known.extrapolate(goal)
            else:
                if rate is None and goal != q:
                    rate = solver.tangent_rate(q)
                guess = known.x[-1] + (0.0 if rate is None else (goal - q) * rate)
            begin = time.perf_counter()
            iterations, reason = solver.solve(goal, guess)
            attempts.append(Attempt(q, goal, iterations, reason, time.perf_counter() - begin))
            newton += iterations
            if attempts[-1].accepted:
                if abs(goal - q) > 0 and iterations <= EASY_NEWTON:
                    step = 2.0 * step
                q = goal
                known.add(q, model.state.x.array.copy())
                if q == target:
                    break
                continue
            step = 0.5 * abs(goal - q)
            if step < smallest:
                raise NotConverged(history(), float(target), reason, q)
        rows.append((q, solver.force, solver.energy, newton))
        if keep_states:
            states.append(known.x[-1])
        if sensitivity.names:
            derivatives.append(sensitivity(solver.tangent_rate(q)))
        if progress is not None:
            progress(number + 1, len(targets), newton, q)
    return history()
