"""History of a march: its attempts, the curve, and why it stopped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Attempt:
    """One attempt at a step: its start and stop (mm or rad), corrections of the state, SNES reason by name, seconds."""

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
    """History of a march.

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
        Corrections of the state (Broyden's and Newton's) since the previous target, failed attempts included.
    attempts
        Every attempt at a step, accepted or not.
    states : shape (n, m) or None
        This rank's unknowns at the targets, if they were kept.
    sensitivity : shape (n, parameters) or None
        Derivative of the force with respect to the parameters that `march` was given.
    path_sensitivity : shape (n, parameters) or None
        Derivative of the displacement with respect to the same parameters; zero for those that do not move the path.
    motion, reactions : shape (n, 6) or None
        On a path of six motions: where the sleeve is (mm, rad), and the reactions that hold it there (N, N mm;
        `cases.six`).
    reaction_sensitivity : shape (n, 6, parameters) or None
        Derivative of the reactions with respect to the same parameters.
    stretches : tuple of (p, 3) arrays
        Of a sweep: principal stretches of the rubber on this rank at each end.
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
    motion: Array | None = None
    reactions: Array | None = None
    reaction_sensitivity: Array | None = None
    stretches: tuple[Array, ...] = ()


class NotConverged(RuntimeError):
    """The march could not go on.

    Attributes
    ----------
    history
        The history of the march, at the targets reached.
    target, last
        The target that the march was heading for, and the last displacement in equilibrium, mm or rad.
    reason
        Name of SNES's reason.
    largest
        Where a force was prescribed: displacement and force (N, N mm) of the equilibrium that came nearest to it.
    """

    def __init__(
        self,
        history: History,
        target: float,
        reason: str,
        last: float,
        largest: tuple[float, float] | None = None,
    ) -> None:
        self.history, self.target, self.reason, self.last = history, target, reason, last
        self.largest = largest
        super().__init__(
            f"no equilibrium found beyond displacement {last:.6g} on the way to {target:.6g} ({reason})"
        )

    def with_history(self, history: History) -> NotConverged:
        """Return the same failure with the history of several marches, of which this was one."""
        return NotConverged(history, self.target, self.reason, self.last, self.largest)


def failure_at_start(reason: str, attempts: Sequence[Attempt] = ()) -> NotConverged:
    """Return the exception for a path whose first step already failed.

    Parameters
    ----------
    reason : str
        Reason, in the words of the exception's message.
    attempts : sequence of Attempt
        Steps that were attempted.
    """
    none = np.zeros(0)
    return NotConverged(History(none, none, None, none, none.astype(int), tuple(attempts)), 0.0, reason, 0.0)


Progress = Callable[[int, int, int, float], None]
"""Called after each target with step, number of steps, Newton iterations, displacement."""
Observer = Callable[[Equilibrium], None]
"""Called at each target with the solver, before the rubber's memory is brought up to date."""


class Interrupted(KeyboardInterrupt):
    """The user interrupted the march; attributes as of `NotConverged`."""

    reason = "INTERRUPTED"

    def __init__(self, history: History, target: float, last: float) -> None:
        self.history, self.target, self.last = history, target, last
        super().__init__("the march was interrupted")

    def with_history(self, history: History) -> Interrupted:
        """Return the same interruption with the history of several marches, of which this was one."""
        return Interrupted(history, self.target, self.last)
