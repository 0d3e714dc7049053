"""One step of the march: its length, its initial guess, and what follows from its success or failure.

Each step starts from an extrapolation of the last states, the first one from the tangent; `cases.equilibrium` does the
rest. A step that does not converge is cut back and grows again.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.history import Attempt
from cases.model import FiniteElementModel
from cases.newton import Outcome
from cases.predictor import RecentPoints
from cases.program import Program
from cases.settling import settle
from cases.stiffening import solve_with_softer_contact

Array = NDArray[np.float64]

# A step cut back to this share of the program's largest step is given up.
SMALLEST_CUT = 1.0 / 256
# Before that, a whole step is tried this many times per target, from the last state without extrapolation.
LEAPS = 1
# Steps that may fail on the way to a target. Rubber at the end of what its elements can follow advances by ever smaller
# steps of which every other one fails: a plain 12/22/40 bushing went from 5.2 to 5.6 mm in minutes. No target that is
# reached in tests/unit/test_march.py, test_settling.py and tests/verification/test_load.py needs more than four.
MOST_FAILED = 30
# If a step cut back to this share of the program's largest one still fails, the rubber flows (`cases.settling`).
SETTLING = 1.0 / 8
# Steps begin with a soft contact until this many in a row have failed. In the kidney STEP's void a step of 0.3 mm
# failed like this after 25 iterations, and half of it took 27; with the actual contact first it would have taken more.
FAILURES = 2
# With at most this many Newton iterations in SNES a step was easy, and the next may be longer.
EASY_NEWTON = 4


@dataclass(frozen=True)
class AttemptedStep:
    """A step that was attempted.

    Attributes
    ----------
    goal : float
        Displacement that it went to, mm or rad.
    share : float
        Share of the remaining way to the target, and of the remaining time.
    duration : float
        s.
    newton : int
        Iterations of Newton's method, by SNES.
    attempt : Attempt
        Its record.
    settled : bool
        Whether the rubber flowed there, so that earlier states say nothing about what lies ahead.
    """

    goal: float
    share: float
    duration: float
    newton: int
    attempt: Attempt
    settled: bool = False


class Stepper:
    """Goes from one equilibrium to the next.

    Parameters
    ----------
    model
        Its state is the unloaded one, assembled if it has to be.
    solver
        Solver of the model.
    began
        Time of the program's beginning, s.
    widest
        Largest step of the program, mm or rad.
    flows
        Whether the rubber may flow where a short step fails, which takes up to a hundred solutions.
    program
        Has the temperature at each time, if it changes.

    Attributes
    ----------
    q, time : float
        Displacement (mm or rad) and time (s) of the last accepted step.
    force, energy : float
        Generalised force (N, N mm; MPa for a coupon) and stored energy (N mm) there.
    six, pose : shape (6,) or None
        Reactions (N, N mm) and pose (mm, rad) of the sleeve there; None except on a path of six motions.
    """

    def __init__(
        self,
        model: FiniteElementModel,
        solver: Equilibrium,
        start_time: float,
        widest: float,
        flows: bool = True,
        program: Program | None = None,
    ) -> None:
        self._model, self._solver, self._widest, self._program = model, solver, widest, program
        model.parameters.begin_step(None)
        self._flows = flows and solver.border is None
        self._known = RecentPoints()
        self._known.add(0.0, solver.unknowns())
        self.q, self.time = 0.0, start_time
        self.force = self.energy = 0.0
        self.six, self.pose = solver.six, solver.pose
        self._rate: Array | None = None
        self._length = np.inf
        self._leaps = 0
        # How many more steps begin with a soft contact although that fails.
        self._stiffens = 0
        # Whether the last step was rejected.
        self._rejected = False
        # Whether a flow did not come to rest on the way to this target. Another is not tried before the next one: in a
        # plain 12/22/40 bushing at 65 % of its thickness three of them took 72 of 100 s, 0.01 mm from each other.
        self._restless = False
        # Steps that failed on the way to this target.
        self._failed = 0

    @property
    def state(self) -> Array:
        """Unknowns of this rank at the last accepted step."""
        return self._known.x[-1][: len(self._model.state.x.array)]

    def begin(self, corner: bool = False) -> None:
        """Start towards the next target.

        Parameters
        ----------
        corner
            Whether the path turns here, so that earlier states say nothing about what lies ahead.
        """
        self._leaps = self._failed = 0
        self._restless = False
        if corner:
            self._known.forget()
            self._rate = None

    def attempt(self, target: float, end_time: float) -> AttemptedStep:
        """Attempt a step towards a target; the state of the model is then the end of the step.

        Parameters
        ----------
        target
            mm or rad.
        until
            Time at the target, s.
        """
        q, model = self.q, self._model
        reaches_target = abs(target - q) <= self._length * (1 + 1e-9)
        goal = target if reaches_target else q + float(np.copysign(self._length, target - q))
        guess = self._guess(goal)
        share = 1.0 if target == q else (goal - q) / (target - q)
        model.duration.value = duration = share * (end_time - self.time)
        self._warm(self.time, self.time + duration)
        start = time.perf_counter()
        outcome = self._find_equilibrium(goal, guess)
        settled = False
        if not outcome.found and self._may_settle(goal):
            flow_outcome = settle(self._solver, goal, self._known.x[-1])
            settled = flow_outcome.found
            self._restless = not settled
            outcome = replace(flow_outcome, iterations=outcome.iterations + flow_outcome.iterations)
        seconds = time.perf_counter() - start
        attempt = Attempt(q, goal, outcome.iterations, outcome.reason, seconds)
        return AttemptedStep(goal, share, duration, outcome.newton, attempt, settled)

    def _warm(self, start: float, end: float) -> None:
        """Set the temperatures at the ends of the step, if they change along the program."""
        temperature = None if self._program is None else self._program.temperature_at(end)
        if temperature is not None and "temperature" in self._model.constants:
            assert self._program is not None
            self._model.parameters.begin_step(self._program.temperature_at(start))
            self._model.constants["temperature"].value = temperature

    def _find_equilibrium(self, goal: float, guess: Array) -> Outcome:
        """Bring the model into equilibrium, with a soft contact first where it fails with the actual one."""
        solver, surfaces, outcome = self._solver, self._model.surfaces, Outcome(0, 0, "DIVERGED_MAX_IT")
        if surfaces.apart or self._stiffens == 0:
            outcome = solver.solve(goal, guess, again=False)
        if not outcome.found and not surfaces.apart:
            outcome = solve_with_softer_contact(solver, goal, guess, outcome.iterations)
            # If it ended well, the next steps begin like this, because their guesses will be as deep.
            self._stiffens = FAILURES if outcome.found else max(self._stiffens - 1, 0)
        return outcome

    def _may_settle(self, goal: float) -> bool:
        """Whether a step that failed is short enough for a flow."""
        short = abs(goal - self.q) <= SETTLING * self._widest
        return short and self._flows and not self._restless

    def accept(self, step: AttemptedStep) -> None:
        """Accept a step: the state of the model is an equilibrium at its end."""
        if abs(step.goal - self.q) > 0 and step.newton <= EASY_NEWTON:
            self._length = 2.0 * self._length
        self.q, self.time = step.goal, self.time + step.duration
        self.force, self.energy = self._solver.force, self._solver.energy
        self.six, self.pose = self._solver.six, self._solver.pose
        self._known.add(self.q, self._solver.unknowns())
        self._rejected = False
        if step.settled:
            self._known.forget()
            self._rate = None

    def take_rate(self, rate: Array) -> None:
        """Use dx/dq at the accepted state, shape (n,), for the guesses of the next steps."""
        self._known.take_rate(rate)

    def reject(self, step: AttemptedStep) -> None:
        """Make the next step half as long."""
        self._failed += 1
        self._length, self._rejected = 0.5 * abs(step.goal - self.q), True

    def can_go_on(self) -> bool:
        """Whether another step can be tried: a shorter one, or a longer one across a fold."""
        if self._failed > MOST_FAILED:
            return False
        if self._length >= SMALLEST_CUT * self._widest:
            return True
        if self._leaps == LEAPS:
            return False
        # A fold of the free surface has no equilibrium near this one: try a step beyond it, from this state.
        self._leaps += 1
        self._length = self._widest
        self._known.forget()
        self._rate = None
        return True

    def _guess(self, goal: float) -> Array:
        states = self._known
        is_soft = self._stiffens > 0 and not self._model.surfaces.apart
        if is_soft and not self._rejected and goal != self.q:
            # The tangent moves surfaces in contact along each other; a parabola moves them into each other. After a
            # step that failed from one guess, the other is used.
            return states.x[-1] + (goal - self.q) * self._solver.ahead(self.q, states.x[-1])
        if len(states.q) > 1:
            return states.extrapolate(goal)
        if self._rate is None and goal != self.q:
            self._rate = self._solver.ahead(self.q, states.x[-1])
            states.take_rate(self._rate)
        return states.x[-1] + (0.0 if self._rate is None else (goal - self.q) * self._rate)
