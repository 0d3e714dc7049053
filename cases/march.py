"""The march along a program: the only place where a load is applied.

The stepper goes from one equilibrium to the next (`cases.stepper`), the recorder stores the results at the targets
(`cases.recorder`); this module says what happens at each target, and after an accepted or a rejected step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.assembling import assemble
from cases.equilibrium import Equilibrium
from cases.history import Attempt, History, Interrupted, NotConverged, Observer, Progress, failure_at_start
from cases.interrupt import is_interrupt
from cases.limit import limit
from cases.load import LIMIT_POINT, ForceSearch, PrescribedForce
from cases.model import FiniteElementModel
from cases.motion import PoseMotion
from cases.program import Program
from cases.recorder import Recorder
from cases.rigid import NoFactorisation
from cases.sensitivity import Sensitivity
from cases.series import SeriesSpring, Shared
from cases.six_sensitivity import SixSensitivity
from cases.stepper import AttemptedStep, Stepper

__all__ = [
    "TOLERANCE",
    "Attempt",
    "History",
    "NotConverged",
    "Observer",
    "Progress",
    "failure_at_start",
    "march",
]

Array = NDArray[np.float64]

# Out-of-balance force over the norm of the reactions. The force, a first integral of the energy, is then within 1e-8
# of what it is at 1e-12 (measured in all four modes), so that differences between neighbouring parameters make sense.
TOLERANCE = 1e-8


def march(
    model: FiniteElementModel,
    program: Program,
    *,
    tolerance: float = TOLERANCE,
    keep_states: bool = False,
    sensitivity: Sequence[str] = (),
    path_rates: Mapping[str, Array] | None = None,
    drive: SeriesSpring | PrescribedForce | None = None,
    progress: Progress | None = None,
    observer: Observer | None = None,
    failure_limit: int | None = None,
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
        Largest out-of-balance force of an equilibrium, as a share of the norm of the reactions.
    keep_states
        Keep this rank's unknowns at every target.
    sensitivity
        Parameters of which the force's derivative is wanted.
    path_rates
        Parameter -> derivative of the program's displacements with respect to it, shape (n,), for parameters that move
        the path.
    drive
        What the program prescribes where that is not the bushing's own displacement, which the history has: with a
        spring in series the displacement of both together, with a prescribed force the force.
    progress
        Called after each target.
    observer
        Called at each target; leaves the model's state as it is.
    failure_limit
        Largest number of failed steps before the march is given up, without any flow (`cases.settling`); None = it is
        given up only when the step cannot be cut back any more.

    Raises
    ------
    NotConverged
        The step was cut back to the smallest length and still failed, more steps failed than `failure_limit`, or no
        travel carries a prescribed force (`cases.load`). Carries the history so far.
    """
    solver = Equilibrium(model, tolerance, limit(failure_limit))
    try:
        kind = SixSensitivity if isinstance(model.motion, PoseMotion) else Sensitivity
        derivatives = _Derivatives(kind(model, sensitivity), path_rates or {}, drive)
        forced = isinstance(drive, PrescribedForce)
        recorder = Recorder(program, keep_states, bool(derivatives.names), forced)
        run = _begin_march(model, solver, program, derivatives, recorder, drive, observer, failure_limit)
        return run.to_end(progress)
    finally:
        solver.destroy()


def _begin_march(
    model: FiniteElementModel,
    solver: Equilibrium,
    program: Program,
    derivatives: _Derivatives,
    recorder: Recorder,
    drive: SeriesSpring | PrescribedForce | None,
    observer: Observer | None,
    failure_limit: int | None,
) -> _March:
    """Assemble the bushing, and return the march at the beginning of its program."""
    model.put(np.zeros_like(solver.unknowns()))
    if model.internal is not None:
        model.internal.reset()
    start_time = 0.0 if program.time is None else float(program.time[0])
    if model.has_assembly:
        recorder.add_attempts(*assemble(model, solver))
        if model.internal is not None:
            derivatives.follow(solver, 0, 0.0, start_time)
            model.commit()
    span = float(np.abs(program.displacement).max())
    widest = max(float(np.abs(np.diff(program.displacement, prepend=0.0)).max()), 1e-12)
    search: Shared | ForceSearch | None = None
    if isinstance(drive, PrescribedForce):
        stiffness = Sensitivity(model, ()).stiffness(solver)
        search = ForceSearch(drive, span, start_time, solver.force, stiffness)
        widest /= abs(stiffness)
    elif drive is not None:
        search = Shared(drive, span, start_time)
    stepper = Stepper(model, solver, start_time, widest, flows=failure_limit is None, program=program)
    return _March(model, solver, program, derivatives, recorder, stepper, search, observer, failure_limit)


@dataclass
class _March:
    """State of a march in progress."""

    model: FiniteElementModel
    solver: Equilibrium
    program: Program
    derivatives: _Derivatives
    recorder: Recorder
    stepper: Stepper
    search: Shared | ForceSearch | None
    observer: Observer | None
    failure_limit: int | None

    def to_end(self, progress: Progress | None) -> History:
        """Go from target to target, and return the recorded history."""
        count = len(self.program.displacement)
        number = 0
        try:
            for number in range(count):
                newton = self.reach(number)
                self.record(number, newton)
                if progress is not None:
                    progress(number + 1, count, newton, self.stepper.q)
        except NoFactorisation:
            # No derivatives there.
            target = float(self.program.displacement[number])
            raise self._failure(target, "DIVERGED_LINEAR_SOLVE") from None
        except Exception as error:
            if isinstance(error, NotConverged) or not is_interrupt(error):
                raise
            raise self._interruption(number) from error
        except KeyboardInterrupt as error:
            raise self._interruption(number) from error
        return self.recorder.history()

    def _interruption(self, number: int) -> KeyboardInterrupt:
        """Return the interruption with the history so far, where at least one target was reached."""
        if not self.recorder.complete:
            return KeyboardInterrupt()
        return Interrupted(self.recorder.history(), float(self.program.displacement[number]), self.stepper.q)

    def reach(self, number: int) -> int:
        """Go to the target with this number; return how many corrections of the state it took."""
        prescribed = float(self.program.displacement[number])
        end_time = 0.0 if self.program.time is None else float(self.program.time[number])
        target = prescribed if self.search is None else self.search.first_trial(prescribed)
        newton = 0
        self.stepper.begin(corner=number > 0 and self.program.turns(number - 1))
        while True:
            step = self.stepper.attempt(target, end_time)
            self.recorder.add_attempts(step.attempt)
            newton += step.attempt.newton
            if not step.attempt.accepted:
                self._reject(step, target, newton)
                continue
            step_end = step.goal, self.solver.force, end_time, prescribed
            if self.search is not None and (step.goal == target or self._has_passed(*step_end)):
                better_target = self.search.better(*step_end)
                if better_target is not None and math.isnan(better_target):
                    raise self._failure(target, self.search.reason)
                if better_target is not None:
                    # Not yet what the program prescribes: repeat the step.
                    target = better_target
                    continue
                target = step.goal
            self._accept(step, number, arrived=step.goal == target)
            if step.goal == target:
                return newton

    def _has_passed(self, q: float, force: float, time: float, prescribed: float) -> bool:
        """Whether an equilibrium on the way to a trial already carries more than the prescribed force."""
        if not isinstance(self.search, ForceSearch):
            return False
        previous = self.stepper.q, self.stepper.force
        # Rubber that relaxes may carry less although it is stiff.
        if self.program.time is None and self.search.falls(previous, (q, force), time):
            raise self._failure(q, LIMIT_POINT)
        return self.search.has_passed(q, force, time, prescribed)

    def record(self, number: int, newton: int) -> None:
        """Record a target that was reached."""
        stepper = self.stepper
        self.recorder.point(stepper.q, stepper.force, stepper.energy, newton, stepper.state)
        if stepper.six is not None and stepper.pose is not None:
            self.recorder.six(stepper.pose, stepper.six)
        if self.derivatives.names:
            if self.model.internal is None:
                self.derivatives.follow(self.solver, number, 1.0, stepper.time)
            self.recorder.slopes(self.derivatives.at, self.derivatives.rates, self.derivatives.reactions)

    def _accept(self, step: AttemptedStep, number: int, arrived: bool) -> None:
        """Accept a step: call the observer, advance the derivatives and, last, the memory of the rubber."""
        self.stepper.accept(step)
        if self.observer is not None and arrived:
            self.observer(self.solver)
        if self.model.internal is not None:
            rate = self.derivatives.follow(self.solver, number, step.share, self.stepper.time)
            if rate is not None:
                self.stepper.take_rate(rate)
            self.model.commit()

    def _reject(self, step: AttemptedStep, target: float, newton: int) -> None:
        """Cut the step back, or end the march."""
        stepper = self.stepper
        stepper.reject(step)
        if self.failure_limit is not None and self.recorder.failed_attempts > self.failure_limit:
            raise self._failure(target, step.attempt.reason)
        if not stepper.can_go_on():
            self.recorder.last_reached(
                stepper.q, stepper.force, stepper.energy, newton, stepper.state, stepper.pose, stepper.six
            )
            raise self._failure(target, step.attempt.reason)

    def _failure(self, target: float, reason: str) -> NotConverged:
        largest = self.search.largest if isinstance(self.search, ForceSearch) else None
        return NotConverged(self.recorder.history(), target, reason, self.stepper.q, largest)


class _Derivatives:
    """Derivatives of the force along the march, and of the path with respect to parameters that move it."""

    def __init__(
        self,
        sensitivity: Sensitivity,
        path_rates: Mapping[str, Array],
        drive: SeriesSpring | PrescribedForce | None,
    ) -> None:
        self._sensitivity, self._drive = sensitivity, drive
        self.names = sensitivity.names
        self._targets = {name: np.asarray(path_rates[name]) for name in self.names if name in path_rates}
        self._now = dict.fromkeys(self._targets, 0.0)
        # Derivatives of the force and of the bushing's displacement by each parameter, after the last step.
        self.at: Array = np.zeros(len(self.names))
        self.rates: Array = np.zeros(len(self.names))
        # Derivatives of six reactions, (6, names); None except on a path of six motions.
        self.reactions: Array | None = None

    def follow(self, solver: Equilibrium, number: int, share: float, time: float) -> Array | None:
        """Advance the derivatives by the step just solved, which covered `share` of the remaining way to a target.

        Return dx/dq there, shape (n,), where it was computed on the way.
        """
        if not self.names:
            return None
        for name, targets in self._targets.items():
            self._now[name] += share * (float(targets[number]) - self._now[name])
        self.at, self.rates = self._sensitivity(solver, self._now, self._drive, time)
        if isinstance(self._sensitivity, SixSensitivity):
            self.reactions = self._sensitivity.reactions
        return self._sensitivity.rate
