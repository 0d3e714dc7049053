"""Recorder of a march: it stores the results at each target, and makes the history from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.history import Attempt, History
from cases.program import Program

Array = NDArray[np.float64]


class Recorder:
    """Record of a march.

    Parameters
    ----------
    program
        Program of the march.
    keep_states
        Whether the unknowns at the targets are kept.
    derivatives
        Whether derivatives are recorded.
    forced
        Whether the program's numbers are forces.

    Attributes
    ----------
    attempts : list of Attempt
        Every attempt so far.
    """

    def __init__(self, program: Program, keep_states: bool, derivatives: bool, forced: bool = False) -> None:
        self._program, self._keep, self._differentiated = program, keep_states, derivatives
        self._forced = forced
        self.attempts: list[Attempt] = []
        self._rows: list[tuple[float, float, float, int]] = []
        self._states: list[Array] = []
        self._force_slopes: list[Array] = []
        self._path_slopes: list[Array] = []
        self._poses: list[Array] = []
        self._reactions: list[Array] = []
        self._reaction_slopes: list[Array] = []

    @property
    def failed_attempts(self) -> int:
        """Attempts that did not converge."""
        return sum(not attempt.accepted for attempt in self.attempts)

    @property
    def complete(self) -> bool:
        """Whether there are two or more points, and everything is recorded at each: no interruption came between."""
        n = len(self._rows)
        needed = (self._states, self._keep), (self._force_slopes, self._differentiated)
        optional = self._poses, self._reactions, self._reaction_slopes
        return (
            n > 1
            and all(len(values) == n * is_needed for values, is_needed in needed)
            and all(len(values) in (0, n) for values in optional)
        )

    def add_attempts(self, *attempts: Attempt) -> None:
        """Record attempts at steps, accepted or not."""
        self.attempts.extend(attempts)

    def point(self, q: float, force: float, energy: float, newton: int, state: Array) -> None:
        """Record an equilibrium.

        Parameters
        ----------
        q
            Displacement, mm or rad.
        force, energy
            N, N mm or MPa of a coupon; stored energy in N mm.
        newton
            Corrections of the state since the last point.
        state
            This rank's unknowns, shape (n,).
        """
        self._rows.append((q, force, energy, newton))
        if self._keep:
            self._states.append(state)

    def last_reached(
        self,
        q: float,
        force: float,
        energy: float,
        newton: int,
        state: Array,
        pose: Array | None = None,
        reactions: Array | None = None,
    ) -> None:
        """Record the last point reached beyond the last target; it belongs to the curve but has no derivatives.

        Parameters
        ----------
        q, force, energy, newton, state
            As in `point`: mm or rad, N or N mm, N mm, number, shape (n,).
        pose, reactions
            As in `six`, on a path of six motions: shape (6,), mm and rad; N and N mm.
        """
        if self._rows and q != self._rows[-1][0] and not self._differentiated:
            self.point(q, force, energy, newton, state)
            if pose is not None and reactions is not None:
                self.six(pose, reactions)

    def six(self, pose: Array, reactions: Array) -> None:
        """Record the six motions and reactions at the last point.

        Parameters
        ----------
        pose, reactions
            Shape (6,), mm and rad; N and N mm.
        """
        self._poses.append(pose)
        self._reactions.append(reactions)

    def slopes(self, force: Array, path: Array, reactions: Array | None) -> None:
        """Record the derivatives at the last point.

        Parameters
        ----------
        force, path
            Derivatives of the force and of the displacement by each parameter, shape (parameters,).
        reactions
            Derivatives of six reactions, shape (6, parameters), on a path of six motions; None elsewhere.
        """
        if reactions is not None:
            self._reaction_slopes.append(reactions)
        self._force_slopes.append(force)
        self._path_slopes.append(path)

    def history(self) -> History:
        """Return the history so far."""
        columns = np.array(self._rows, dtype=float).reshape(-1, 4)
        timed = self._program.time is not None
        return History(
            displacement=columns[:, 0],
            force=columns[:, 1],
            time=_times(self._program, columns[:, 1 if self._forced else 0]) if timed else None,
            energy=columns[:, 2],
            newton=columns[:, 3].astype(int),
            attempts=tuple(self.attempts),
            states=np.array(self._states) if self._keep else None,
            sensitivity=np.array(self._force_slopes) if self._differentiated else None,
            motion=np.array(self._poses) if self._poses else None,
            reactions=np.array(self._reactions) if self._reactions else None,
            reaction_sensitivity=np.array(self._reaction_slopes) if self._reaction_slopes else None,
            path_sensitivity=np.array(self._path_slopes) if self._differentiated else None,
        )


def _times(program: Program, reached: Array) -> Array:
    """Time of each recorded point: the program's, interpolated on the way to a target that was not reached."""
    assert program.time is not None
    targets = program.displacement
    last = min(len(reached), len(program.time)) - 1
    times = program.time[: last + 1].copy()
    if last > 0 and targets[last] != targets[last - 1]:
        share = (reached[last] - targets[last - 1]) / (targets[last] - targets[last - 1])
        # A target that was found by a search is reached to within its tolerance.
        if not np.isclose(share, 1.0, rtol=0.0, atol=1e-5):
            times[last] = times[last - 1] + share * (program.time[last] - times[last - 1])
    return np.asarray(times)
