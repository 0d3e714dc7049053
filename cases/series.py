"""A bushing driven through a spring: the prescribed displacement is that of both together.

The program is then not the path of the bushing's sleeve. At each target q + u(P) has to be found, u the extension of
the spring and P the force that it carries: the bushing's force Q, scaled, and that of stops beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Largest deviation of the two together from the prescribed displacement, as a share of the program's largest one.
CLOSE = 1e-7
MOST_TRIALS = 12


@dataclass(frozen=True)
class Extension:
    """Extension of the spring in one state, and its derivatives.

    Attributes
    ----------
    length : float
        mm or rad.
    by_displacement, by_force : float
        By the bushing's displacement at fixed force, and by its force: mm/mm and mm/N, or rad/rad and rad/(N mm).
    by_parameter : mapping
        Parameter -> derivative at fixed displacement and force.
    """

    length: float
    by_displacement: float
    by_force: float
    by_parameter: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SeriesSpring:
    """A spring in series with a bushing.

    Attributes
    ----------
    extension : callable
        ``extension(q, Q, time) -> Extension``: of the spring, with the bushing's displacement q (mm or rad) and force Q
        (N or N mm), and the time in s as in the program.
    """

    extension: Callable[[float, float, float], Extension]

    def excess(self, q: float, force: float, time: float, prescribed: float) -> float:
        """How far bushing and spring together go beyond the prescribed displacement, mm or rad.

        Parameters
        ----------
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        prescribed
            Displacement of both together, mm or rad.
        """
        return q + self.extension(q, force, time).length - prescribed

    def rate(
        self, name: str, q: float, force: float, time: float, stiffness: float, prescribed: float, work: float
    ) -> float:
        """dq/dc of the bushing with respect to a parameter.

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
            Derivative of the prescribed displacement by c, mm or rad per unit of c.
        work
            Derivative of the bushing's force by c at fixed q, N or N mm per unit of c.
        """
        extension = self.extension(q, force, time)
        taken = extension.by_force * work + extension.by_parameter.get(name, 0.0)
        return (prescribed - taken) / (1.0 + extension.by_displacement + extension.by_force * stiffness)


class Shared:
    """Share of a prescribed displacement that the bushing takes beside a spring, by the secant method, step by step.

    Parameters
    ----------
    series
        The spring.
    span
        Largest prescribed displacement, mm or rad.
    began
        Time of the program's beginning, s.
    """

    def __init__(self, series: SeriesSpring, span: float, start_time: float) -> None:
        self._series, self._close = series, CLOSE * span
        # The last equilibrium, and dq over the prescribed displacement's change there.
        self._q = self._prescribed = 0.0
        self._share = 1.0 / (1.0 + series.extension(0.0, 0.0, start_time).by_displacement)
        self._trials: list[tuple[float, float]] = []

    reason = "DIVERGED_SERIES"

    def first_trial(self, prescribed: float) -> float:
        """Return the first displacement to try."""
        self._trials = []
        return self._q + self._share * (prescribed - self._prescribed)

    def better(self, q: float, force: float, time: float, prescribed: float) -> float | None:
        """Return a better displacement; None if this one is good enough, NaN to give up the search.

        Parameters
        ----------
        q, force
            Displacement and force of the bushing: mm or rad, N or N mm.
        time
            s, as in the program.
        prescribed
            Displacement of both together, mm or rad.
        """
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
        (previous_q, previous_excess), (current_q, current_excess) = self._trials[-2:]
        slope = (
            (current_excess - previous_excess) / (current_q - previous_q) if current_q != previous_q else 1.0
        )
        return current_q - current_excess / max(slope, 1.0)
