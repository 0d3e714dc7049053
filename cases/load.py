"""A prescribed force: the program's numbers are forces, and the march finds the travel at each.

At each target the travel q has to be found at which the bushing carries the force F. The march solves for the rubber at
a travel, so that q is the root of one equation, Q(q) = F: by the secant method, within a bracket as soon as trials lie
on both sides. Every trial starts from the last accepted equilibrium, with the memory that the rubber has there.

Past a limit point the force falls with the travel: no travel near it carries more, and the bushing would snap to a
distant equilibrium. The search ends there with the largest force that it found.

References
----------
Dowell and Jarratt (1971), A modified regula falsi method for computing the root of an equation, BIT 11:168-174,
doi:10.1007/BF01934364 (the halved value of an end of the bracket that stays).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cases.history import History

# Largest deviation from the prescribed force, as a share of the program's largest one: ten times the deviation of the
# force that the march's tolerance leaves.
CLOSE = 1e-7
# The method needs 3 to 5 trials where the curve is smooth, and a dozen where contact begins on the way.
MOST_TRIALS = 40
# Without a bracket a trial goes at most this many times as far as the last one, so that a limit point is not jumped
# over: with 4, the snap of a Yeoh law whose force falls by a third was (axial, 8 steps); with 1.5 it was found.
FURTHER = 1.5
LIMIT_POINT = "LIMIT_POINT"


@dataclass(frozen=True)
class PrescribedForce:
    """A force is prescribed instead of a displacement.

    Attributes
    ----------
    carried : callable, optional
        ``carried(q, Q, time)``: the force that is prescribed, with the bushing's displacement q (mm or rad) and force
        Q (N or N mm), and the time in s as in the program; the bushing's own force where absent.
    """

    carried: Callable[[float, float, float], float] | None = None

    def force(self, q: float, force: float, time: float) -> float:
        """Return the force that is prescribed, N or N mm.

        Parameters
        ----------
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        """
        return force if self.carried is None else self.carried(q, force, time)

    def with_prescribed_force(self, history: History) -> History:
        """Return a history with the force that is prescribed in place of the bushing's own."""
        times = np.zeros_like(history.force) if history.time is None else history.time
        points = zip(history.displacement, history.force, times, strict=True)
        return replace(history, force=np.array([self.force(*map(float, point)) for point in points]))

    def rate(
        self, name: str, q: float, force: float, time: float, stiffness: float, prescribed: float, work: float
    ) -> float:
        """dq/dc of the bushing with respect to a parameter, where its own force is prescribed.

        Parameters
        ----------
        name
            The parameter c.
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        stiffness
            dQ/dq at fixed memory, N/mm or N mm/rad.
        prescribed
            Derivative of the prescribed force by c, N or N mm per unit of c.
        work
            Derivative of the bushing's force by c at fixed q, N or N mm per unit of c.
        """
        return (prescribed - work) / stiffness


class ForceSearch:
    """Search for the travel at a prescribed force, target by target.

    Parameters
    ----------
    load
        What is prescribed.
    span
        Largest prescribed force, N or N mm.
    began
        Time of the program's beginning, s.
    force, stiffness
        Force and tangent stiffness of the bushing at rest: N, N/mm or N mm, N mm/rad.

    Attributes
    ----------
    reason : str
        Why the search was given up.
    largest : (float, float)
        Travel and force of the equilibrium that came nearest to the prescribed force.
    """

    def __init__(
        self, load: PrescribedForce, span: float, start_time: float, force: float, stiffness: float
    ) -> None:
        self._load, self._close = load, CLOSE * span
        # Travel and force at the last target, and the stiffness there.
        self._q, self._force, self._stiffness = 0.0, load.force(0.0, force, start_time), stiffness
        # Travel and excess of force of the trials for this target, and the ends of the bracket: too little, too much.
        self._trials: list[tuple[float, float]] = []
        self._less: tuple[float, float] | None = None
        self._more: tuple[float, float] | None = None
        self.reason, self.largest = "", (0.0, self._force)

    def first_trial(self, prescribed: float) -> float:
        """Return the first travel to try, mm or rad."""
        self._trials, self._less, self._more = [], None, None
        self.largest = self._q, self._force
        return self._q + (prescribed - self._force) / self._stiffness

    def has_passed(self, q: float, force: float, time: float, prescribed: float) -> bool:
        """Whether an equilibrium on the way to a trial is already beyond the prescribed force.

        Parameters
        ----------
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        prescribed
            Force that is prescribed, N or N mm.
        """
        carried_force = self._load.force(q, force, time)
        self._remember_nearest(q, carried_force, prescribed)
        return (carried_force - prescribed) * (q - self._q) > 0.0

    def falls(self, previous: tuple[float, float], current: tuple[float, float], time: float) -> bool:
        """Whether the force falls on the way, past a limit point.

        Parameters
        ----------
        before, now
            Displacement and force of the bushing at two equilibria: mm or rad, N or N mm.
        time
            s, as in the program.
        """
        gained = self._load.force(*current, time) - self._load.force(*previous, time)
        return gained * (current[0] - previous[0]) < 0.0

    def better(self, q: float, force: float, time: float, prescribed: float) -> float | None:
        """Return a better travel; None if this one is good enough, NaN to give up the search.

        Parameters
        ----------
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        prescribed
            Force that is prescribed, N or N mm.
        """
        carried_force = self._load.force(q, force, time)
        excess = carried_force - prescribed
        slope = self._slope(q, excess)
        self._remember_nearest(q, carried_force, prescribed)
        if abs(excess) <= self._close:
            self._q, self._force = q, carried_force
            self._stiffness = slope if slope > 0.0 else self._stiffness
            return None
        self._trials.append((q, excess))
        if len(self._trials) > MOST_TRIALS:
            self.reason = "DIVERGED_LOAD"
            return math.nan
        self._bracket(q, excess)
        if self._less is not None and self._more is not None:
            (a, low), (b, high) = self._less, self._more
            return (a * high - b * low) / (high - low)
        if slope <= 0.0:
            self.reason = LIMIT_POINT
            return math.nan
        target = q - excess / slope
        # While rubber relaxes under a constant force, the last trial may have moved nothing.
        furthest = FURTHER * max(abs(q - self._q), abs(excess) / self._stiffness)
        return self._q + math.copysign(min(abs(target - self._q), furthest), target - self._q)

    def _remember_nearest(self, q: float, carried_force: float, prescribed: float) -> None:
        """Remember the equilibrium that came nearest to the prescribed force."""
        if abs(carried_force - prescribed) < abs(self.largest[1] - prescribed):
            self.largest = q, carried_force

    def _slope(self, q: float, excess: float) -> float:
        """Return the stiffness between the last two trials; that at the last target where there is one alone."""
        if not self._trials or self._trials[-1][0] == q:
            return self._stiffness
        previous_q, previous_excess = self._trials[-1]
        return (excess - previous_excess) / (q - previous_q)

    def _bracket(self, q: float, excess: float) -> None:
        """Narrow the bracket by a trial; an end that stays twice in a row counts half (Illinois)."""
        same_side = len(self._trials) > 1 and self._trials[-2][1] * excess > 0.0
        if excess < 0.0:
            self._less = q, excess
            if same_side and self._more is not None:
                self._more = self._more[0], 0.5 * self._more[1]
        else:
            self._more = q, excess
            if same_side and self._less is not None:
                self._less = self._less[0], 0.5 * self._less[1]
