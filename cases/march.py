"""Along the program: the one place where a load is applied.

Each step starts from an extrapolation of the last states, the first one from the tangent; `cases.equilibrium` does the
rest. A step that does not converge is cut back and grows again. Every attempt is recorded.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import MAX_NEWTON, Equilibrium
from cases.model import Model
from cases.program import Program
from cases.sensitivity import Sensitivity
from cases.series import CLOSE, MOST_TRIALS, Series

Array = NDArray[np.float64]

# Out-of-balance force over the norm of the reactions. The force, a first integral of the energy, is then within 1e-8
# of what it is at 1e-12 (measured in all four modes), so that differences between neighbouring parameters make sense.
TOLERANCE = 1e-8
# A step cut back to this share of the program's largest step is given up.
SMALLEST_CUT = 1.0 / 256
# Before that, so many times per target, a whole step is tried from the last state without looking back.
LEAPS = 1
# Few iterations of Newton, by SNES, mean that a step was easy, and the next may grow.
EASY_NEWTON = 4
# Iterations of Newton after which a march with little patience fails a step. Behind a fold of the free surface up to 25
# were seen to end well; a step that is half as long comes to the same end sooner.
IMPATIENT = 15
# Two points nearer to each other than this share of the step ahead are one.
CLOSEST = 0.2
# Parabola through the last three: a cubic overshoots where the free surface folds.
PREDICTOR_STATES = 3


@dataclass(frozen=True)
class Attempt:
    """One try at a step: from and to (mm or rad), corrections of the state, SNES reason by name, seconds."""

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
        q (mm or rad) and Q (N, N mm; MPa for a coupon) at the program's targets reached, and at the last equilibrium
        beyond them where the march had to stop.
    time : shape (n,) or None
        Seconds, from the program.
    energy : shape (n,)
        Stored energy, N mm.
    newton : shape (n,)
        Corrections of the state (Broyden's and Newton's) since the target before, failed attempts included.
    attempts
        Every try, accepted or not.
    states : shape (n, m) or None
        This rank's unknowns at the targets, if they were kept.
    sensitivity : shape (n, parameters) or None
        Derivative of the force with respect to the parameters asked for.
    path_sensitivity : shape (n, parameters) or None
        Derivative of the displacement with respect to them: of those that move the path.
    """

    displacement: Array
    force: Array
    time: Array | None
    energy: Array
    newton: NDArray[np.int64]
    attempts: tuple[Attempt, ...]
    states: Array | None = None
    sensitivity: Array | None = None
    path_sensitivity: Array | None = None


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


def unsolved(reason: str, attempts: Sequence[Attempt] = ()) -> NotConverged:
    """The exception for a path of which not even the first step was found."""
    none = np.zeros(0)
    return NotConverged(History(none, none, None, none, none.astype(int), tuple(attempts)), 0.0, reason, 0.0)


Progress = Callable[[int, int, int, float], None]
"""Called after each target with step, number of steps, Newton iterations, displacement."""
Observer = Callable[[Equilibrium], None]
"""Called at each target with the solver, before the rubber's memory is brought up to date."""


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

    def forget(self) -> None:
        """Keep the newest point alone."""
        self.q, self.x = self.q[-1:], self.x[-1:]

    def extrapolate(self, q: float) -> Array:
        """Lagrange polynomial through the points, at q.

        Points that nearly coincide, as where a path returns, would make wild polynomials: of such the newer one counts.
        """
        apart = CLOSEST * abs(q - self.q[-1])
        chosen: list[int] = []
        for i in reversed(range(len(self.q))):
            if all(abs(self.q[i] - self.q[j]) > apart for j in chosen):
                chosen.append(i)
        nodes = [self.q[i] for i in chosen]
        weights = [np.prod([(q - m) / (n - m) for m in nodes if m != n]) for n in nodes]
        return np.asarray(sum(w * self.x[i] for w, i in zip(weights, chosen, strict=True)))


def march(
    model: Model,
    program: Program,
    *,
    tolerance: float = TOLERANCE,
    keep_states: bool = False,
    sensitivity: Sequence[str] = (),
    path_rates: Mapping[str, Array] | None = None,
    series: Series | None = None,
    progress: Progress | None = None,
    observer: Observer | None = None,
    patience: int | None = None,
) -> History:
    """Follow the program from the unloaded state.

    Where the rubber remembers, its memory is brought up to date after every accepted step, cut-back ones included; the
    program's time is that of the steps, and without it every step is instantaneous.

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
    path_rates
        Parameter -> derivative of the program's displacements with respect to it, shape (n,), for parameters that move
        the path.
    series
        A spring through which the bushing is driven: the program is of both together, the history's displacement the
        bushing's.
    progress
        Called after each target.
    observer
        Called at each target; leaves the model's state as it is.
    patience
        Failed steps after which the march is given up; None = only when the step cannot be cut back any more.

    Raises
    ------
    NotConverged
        The step was cut back to the smallest and still failed, or patience is out. Carries the history so far.
    """
    solver = Equilibrium(model, tolerance, MAX_NEWTON if patience is None else IMPATIENT)
    try:
        derivatives = _Derivatives(Sensitivity(model, sensitivity), path_rates or {}, series)
        return _march(model, solver, program, keep_states, derivatives, series, progress, observer, patience)
    finally:
        solver.destroy()


def _march(
    model: Model,
    solver: Equilibrium,
    program: Program,
    keep_states: bool,
    sensitivity: _Derivatives,
    series: Series | None,
    progress: Progress | None,
    observer: Observer | None,
    patience: int | None,
) -> History:
    targets = program.displacement if series is None else program.displacement.copy()
    prescribed = program.displacement
    times = np.zeros(len(targets)) if program.time is None else program.time
    span = float(np.abs(prescribed).max())
    shared = _Shared(series, span, float(times[0])) if series is not None else None
    rows: list[tuple[float, float, float, int]] = []
    attempts: list[Attempt] = []
    states: list[Array] = []
    derivatives: list[Array] = []
    path_derivatives: list[Array] = []
    model.state.x.array[:] = 0.0
    if model.internal is not None:
        model.internal.reset()
    if model.assembled:
        attempts += _assemble(model, solver, sensitivity, float(times[0]))
    known = _Path()
    known.add(0.0, model.state.x.array.copy())
    q, now = 0.0, float(times[0])
    rate: Array | None = None
    widest = max(float(np.abs(np.diff(targets, prepend=0.0)).max()), 1e-12)
    smallest = SMALLEST_CUT * widest
    step = np.inf

    def history() -> History:
        columns = np.array(rows, dtype=float).reshape(-1, 4)
        time_ = None if program.time is None else _times(program, columns[:, 0])
        return History(
            displacement=columns[:, 0],
            force=columns[:, 1],
            time=time_,
            energy=columns[:, 2],
            newton=columns[:, 3].astype(int),
            attempts=tuple(attempts),
            states=np.array(states) if keep_states else None,
            sensitivity=np.array(derivatives) if sensitivity.names else None,
            path_sensitivity=np.array(path_derivatives) if sensitivity.names else None,
        )

    def record(newton: int) -> None:
        rows.append((q, *balance, newton))
        if keep_states:
            states.append(known.x[-1])

    balance = (0.0, 0.0)
    for number, target in enumerate(targets):
        newton = leaps = 0
        if shared is not None:
            target = targets[number] = shared.first(float(prescribed[number]))
        while True:
            goal = target if abs(target - q) <= step * (1 + 1e-9) else q + np.copysign(step, target - q)
            if len(known.q) > 1:
                guess = known.extrapolate(goal)
            else:
                if rate is None and goal != q:
                    model.state.x.array[:] = known.x[-1]
                    rate = solver.tangent_rate()
                guess = known.x[-1] + (0.0 if rate is None else (goal - q) * rate)
            share = 1.0 if target == q else (goal - q) / (target - q)
            model.duration.value = duration = share * (times[number] - now)
            begin = time.perf_counter()
            outcome = solver.solve(goal, guess)
            seconds = time.perf_counter() - begin
            attempts.append(Attempt(q, goal, outcome.iterations, outcome.reason, seconds))
            newton += outcome.iterations
            if attempts[-1].accepted:
                if shared is not None and goal == target:
                    better = shared.better(
                        goal, solver.force, float(times[number]), float(prescribed[number])
                    )
                    if better is not None and math.isnan(better):
                        raise NotConverged(history(), goal, "DIVERGED_SERIES", q)
                    if better is not None:
                        # Not yet the displacement that spring and bushing share: the same step again.
                        target = targets[number] = better
                        continue
                if abs(goal - q) > 0 and outcome.newton <= EASY_NEWTON:
                    step = 2.0 * step
                q, balance, now = goal, (solver.force, solver.energy), now + duration
                known.add(q, model.state.x.array.copy())
                if observer is not None and q == target:
                    observer(solver)
                if model.internal is not None:
                    sensitivity.follow(solver, number, share, now)
                    model.commit()
                if q == target:
                    break
                continue
            step = 0.5 * abs(goal - q)
            failed = sum(not one.accepted for one in attempts)
            if patience is not None and failed > patience:
                raise NotConverged(history(), float(target), outcome.reason, q)
            if step < smallest and leaps < LEAPS:
                # A fold of the free surface has no equilibrium near this one: look beyond it, from this state.
                leaps += 1
                step = widest
                known.forget()
                rate = None
                continue
            if step < smallest:
                # What was reached beyond the last target belongs to the curve; derivatives are of targets only.
                if rows and q != rows[-1][0] and not sensitivity.names:
                    record(newton)
                raise NotConverged(history(), float(target), outcome.reason, q)
        record(newton)
        if sensitivity.names:
            if model.internal is None:
                sensitivity.follow(solver, number, 1.0, now)
            derivatives.append(sensitivity.at)
            path_derivatives.append(sensitivity.rates)
        if progress is not None:
            progress(number + 1, len(targets), newton, q)
    return history()


# Steps in which a bushing is assembled, and the time that its rubber has to relax afterwards (s).
ASSEMBLY_STEPS = 4
RELAXED = 1e12


def _assemble(model: Model, solver: Equilibrium, sensitivity: _Derivatives, began: float) -> list[Attempt]:
    """Bring the parameters of the assembly to their values, the sleeve at rest; the rubber relaxes.

    The program begins at the time `began`.
    """
    attempts: list[Attempt] = []
    model.duration.value = RELAXED
    done, step, taken = 0.0, 1.0 / ASSEMBLY_STEPS, 1.0
    states = [model.state.x.array.copy()]
    while done < 1.0:
        stage = min(1.0, done + step)
        model.stage.value = stage
        # On the line through the last two.
        guess = (
            states[-1] if len(states) < 2 else states[-1] + (states[-1] - states[-2]) * (stage - done) / taken
        )
        begin = time.perf_counter()
        outcome = solver.solve(0.0, guess)
        seconds = time.perf_counter() - begin
        attempts.append(Attempt(0.0, 0.0, outcome.iterations, outcome.reason, seconds))
        if attempts[-1].accepted:
            taken, done = stage - done, stage
            states = [states[-1], model.state.x.array.copy()]
            continue
        step *= 0.5
        if step < SMALLEST_CUT:
            model.stage.value = 1.0
            raise unsolved(outcome.reason, attempts)
    if model.internal is not None:
        sensitivity.follow(solver, 0, 0.0, began)
        model.commit()
    return attempts


class _Shared:
    """Displacement that a bushing takes of what is prescribed to it and a spring: the secant method, step by step."""

    def __init__(self, series: Series, span: float, began: float) -> None:
        self._series, self._close = series, CLOSE * span
        # The last equilibrium, and dq over the prescribed displacement's change there.
        self._q = self._prescribed = 0.0
        self._share = 1.0 / (1.0 + series.compliance * series.carried(0.0, 0.0, began).by_displacement)
        self._trials: list[tuple[float, float]] = []

    def first(self, prescribed: float) -> float:
        """Where to look first."""
        self._trials = []
        return self._q + self._share * (prescribed - self._prescribed)

    def better(self, q: float, force: float, time: float, prescribed: float) -> float | None:
        """A better displacement than this one; None where it is good, NaN where the search is given up."""
        excess = self._series.excess(q, force, time, prescribed)
        self._trials.append((q, excess))
        if len(self._trials) > MOST_TRIALS:
            return math.nan
        if abs(excess) <= self._close:
            if prescribed != self._prescribed:
                share = (q - self._q) / (prescribed - self._prescribed)
                self._share = float(np.clip(share, 1e-3, 1.0))
            self._q, self._prescribed = q, prescribed
            return None
        if len(self._trials) == 1:
            return q - self._share * excess
        (before, over), (now, left) = self._trials[-2:]
        slope = (left - over) / (now - before) if now != before else 1.0
        return now - left / max(slope, 1.0)


class _Derivatives:
    """Derivatives of the force along the march, and of the path with respect to parameters that move it."""

    def __init__(
        self, sensitivity: Sensitivity, path_rates: Mapping[str, Array], series: Series | None = None
    ) -> None:
        self._sensitivity, self._series = sensitivity, series
        self.names = sensitivity.names
        self._targets = {name: np.asarray(path_rates[name]) for name in self.names if name in path_rates}
        self._now = dict.fromkeys(self._targets, 0.0)
        # Of the force, and of the bushing's displacement, with respect to each parameter, after the last step.
        self.at: Array = np.zeros(len(self.names))
        self.rates: Array = np.zeros(len(self.names))

    def follow(self, solver: Equilibrium, number: int, share: float, time: float) -> None:
        """Take the step just found, which went this share of the way left to a target and ended at this time."""
        if not self.names:
            return
        for name, targets in self._targets.items():
            self._now[name] += share * (float(targets[number]) - self._now[name])
        self.at, self.rates = self._sensitivity(solver, self._now, self._series, time)


def _times(program: Program, displacement: Array) -> Array:
    """Time of each recorded point: the program's, and on the way to a target that was not reached a share of it."""
    assert program.time is not None
    count = min(len(displacement), len(program.time))
    reached = program.time[:count].copy()
    last = count - 1
    if last > 0 and displacement[last] != program.displacement[last]:
        way = program.displacement[last] - program.displacement[last - 1]
        share = (displacement[last] - program.displacement[last - 1]) / way
        reached[last] = reached[last - 1] + share * (program.time[last] - reached[last - 1])
    return np.asarray(reached)
