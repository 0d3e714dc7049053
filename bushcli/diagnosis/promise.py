"""Whether a fit in progress can still matter: a bound of its evidence, to first order about the present parameters.

A full Gauss-Newton step leaves a misfit whose evidence is calculated as for a prediction (`predict`). If that evidence
and its slack would not bring the model to a share of the posterior that matters, with or without the unknown effect,
the fit is ended where it is. What it has found so far is entered: its weight is negligible, as at its minimum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.density import Posterior
from bushcli.diagnosis.evidence import evidence
from bushcli.diagnosis.queued import slack_of
from bushcli.inverse.local import full_step

Array = NDArray[np.float64]

# Share of the posterior below which a model does not matter: a hundred such models would change it by less than the
# search may leave undone (`queue.LEFT`).
NEGLIGIBLE = 5e-4
# Points in a row whose promise is too small before a fit is ended: a single one may lie far off the valley.
TWICE = 2


@dataclass(frozen=True)
class Needed:
    """Natural logarithms of the evidence that a model needs to matter, without and with the unknown effect."""

    log: float
    log_unknown: float


def needed_of(total: float, odds: float, odds_unknown: float) -> Needed:
    """Return the evidence from which on a model matters.

    Parameters
    ----------
    total : float
        Logarithm of the sum of all posterior weights so far.
    odds, odds_unknown : float
        Logarithms of the prior odds of the model without and with the unknown effect, against the plain law.
    """
    least = total + math.log(NEGLIGIBLE)
    return Needed(least - odds, least - odds_unknown)


class Promise:
    """Evidence that a fit promises, compared with the evidence that it needs.

    Parameters
    ----------
    problem : Posterior
        The least-squares problem of the model.
    lower, upper : (p,) array
        Bounds of its parameters, each in its unit.
    off : sequence of float
        Off value of each amplitude, any number for other parameters.
    needed : Needed
    """

    def __init__(
        self, problem: Posterior, lower: Array, upper: Array, off: list[float], needed: Needed
    ) -> None:
        self._problem, self._lower, self._upper = problem, lower, upper
        self._off, self._needed = off, needed
        self._short = 0

    def is_hopeless(self, x: Array) -> bool:
        """Whether the fit cannot matter, seen from the parameters `x` (p,) and those before; not asked twice at one."""
        self._short = self._short + 1 if self._falls_short(x) else 0
        return self._short >= TWICE

    def _falls_short(self, x: Array) -> bool:
        problem = self._problem
        forces = problem.forces(x)
        if forces is None:
            return False
        misfit, slopes = [], []
        for one, channel, (force, slope) in zip(problem.features, problem.channels, forces, strict=True):
            misfit.append(one.of(force - channel.recording.force))
            slopes.append(one.of(slope))
        step, _ = full_step(problem, x, self._lower, self._upper)
        found = evidence(
            problem.likelihood,
            [z + J @ step for z, J in zip(misfit, slopes, strict=True)],
            slopes,
            x + step,
            [problem.known.get(name) for name in problem.names],
            self._off,
        )
        slack = slack_of(found.judged.log - problem.judge(misfit).log)
        return found.log + slack < self._needed.log and found.log_unknown + slack < self._needed.log_unknown
