"""Predict to first order what a fit in progress can still gain, and end it where that is too little to matter.

A full Gauss-Newton step leaves a misfit whose evidence is calculated as for a prediction (`selection.predict`). A fit
ends in its minimum if the step would hardly lower the misfit: one more solution would only confirm this. It is given up
if that evidence, with its slack, would hardly change the model's share of the posterior, with or without the unknown
effect: what it has found so far is entered then. A search near its minimum also ends where the variances of the misfit
have changed, since the next one begins with these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.evidence.density import SETTLED, Posterior
from bushcli.evidence.laplace import Evidence
from bushcli.inverse.local import HeldBack, Hopeless, Settled, Stopped, full_step

Array = NDArray[np.float64]

# Share of the posterior below which a model does not matter: a hundred such models would change it by less than the
# search may leave undone (`selection.queue.LEFT`).
NEGLIGIBLE = 5e-4
# Points in a row from which too little can be gained before a fit is given up, or that gained too little of what was
# predicted. A single one may lie far off the valley.
TWICE = 2
# A search whose trials the law's stability rejects, and whose steps lower the misfit by less than this share of what a
# full step predicts, goes on along the edge of stability: in practice p04 twelve steps towards a debonded bond gained
# 1 to 4 % of that each, and five along the edge nearly all of it.
LEAST_RATIO = 0.1
# A fit ends where a full step would gain less than this many nats: no parameter is then further from its best value
# than a fifth of its standard deviation.
NOTHING = 0.02
# The same beside parameters that cannot be solved, where trials fail and take three times as long: a gain that would
# not make an effect visible (`selection.prediction.FAINT`).
NOTHING_AT_WALL = 0.5
# A model of a small share of the posterior need not be known as well: its fit ends where a full step would change the
# posterior by less than this. Probabilities that differ by less count as the same (`benchmarks/constants.md`).
UNCHANGED = 0.002
# Gain (nats) below which a fit goes on with the variances of its misfit, if they have changed: their change moves the
# optimum by more. Judgement.
ROUGH = 1.0
# Possible error of the predicted evidence, in nats: a constant, by which the evidence changed in fits of a coupon while
# the variances settled (1.3 at most), and a share of the gain, however large: from far starts a step predicted
# 17,600 nats where 17,850 were found. It is smaller than that of a prediction (`selection.queued`): the effect
# is in the model.
SLACK, SHARE_SLACK = 2.0, 0.15


@dataclass(frozen=True)
class Needed:
    """Natural logarithms of the evidence that a model needs to matter, without and with the unknown effect."""

    log: float
    log_unknown: float


def needed_of(total: float, odds: float, odds_unknown: float) -> Needed:
    """Return the least evidence with which a model still matters.

    Parameters
    ----------
    total : float
        Natural logarithm of the sum of all posterior weights so far, dimensionless.
    odds, odds_unknown : float
        Natural logarithms of the prior odds of the model without and with the unknown effect, against the plain law.
    """
    least = total + math.log(NEGLIGIBLE)
    return Needed(least - odds, least - odds_unknown)


class StoppingRule:
    """Decides when a fit ends, from the gain predicted for a full Gauss-Newton step.

    Parameters
    ----------
    problem : Posterior
        The least-squares problem of the model.
    off : list of float
        Off value of each amplitude, any number for other parameters.
    needed : Needed, optional
        None if the model matters in any case.
    """

    def __init__(self, problem: Posterior, off: list[float], needed: Needed | None) -> None:
        self._problem, self._off, self._needed = problem, off, needed
        self._short = self._slow = 0
        # Variances, sum of squares and gain at the last point.
        self._last: tuple[tuple[float, ...], float, float] = ((), 0.0, 0.0)

    def ends(
        self, x: Array, failed: bool = False, rejected: bool = False, last: bool = True
    ) -> Stopped | None:
        """Return why the fit ends at a point of its search, or None.

        Parameters
        ----------
        x : (p,) array
            Parameters, each in its unit; the points of the search are asked for in turn.
        failed : bool
            Whether a trial from the last point could not be solved.
        rejected : bool
            Whether trials of the search were rejected because the law is unstable there.
        last : bool
            Whether no search with other variances follows.
        """
        step, gain = self._step(x)
        slow = self._is_slow(x, gain)
        self._slow = self._slow + 1 if slow and rejected else 0
        if self._slow >= TWICE:
            return HeldBack("the law's stability limits the search")
        if gain < (NOTHING_AT_WALL if failed else NOTHING):
            return Settled("no step lowers the misfit")
        self._short = self._short + 1 if self._change(x, step, gain) < UNCHANGED else 0
        if self._short >= (TWICE if gain > ROUGH else 1):
            return Hopeless("a lower misfit would not change the posterior")
        if not last and gain < ROUGH and self._problem.variance_change(x)[0] > SETTLED:
            return Settled("the variances of the misfit have changed")
        return None

    def is_at_wall(self, x: Array) -> bool:
        """Whether a search that ended at `x` (p,) might have gone on to a visibly better fit."""
        return self._step(x)[1] > NOTHING_AT_WALL

    def _is_slow(self, x: Array, gain: float) -> bool:
        """Whether the last step gained much less than predicted; `gain` is the predicted gain of the next."""
        rows = self._problem.residual(x)
        now = (self._problem.variances, float(rows @ rows), gain)
        (variances, before, predicted), self._last = self._last, now
        gained = 0.5 * (before - now[1]) / self._problem.unit**2
        return variances == now[0] and gained < LEAST_RATIO * predicted

    def _step(self, x: Array) -> tuple[Array, float]:
        """Return the full step (p,) from solvable parameters, and its predicted gain in nats."""
        problem = self._problem
        value = problem.residual(x)
        step, left = full_step(problem, x)
        return step, 0.5 * (float(value @ value) - left) / problem.unit**2

    def _change(self, x: Array, step: Array, gain: float) -> float:
        """Return by how much a step (p,) that gains so many nats may change the model's share of the posterior.

        Far from the minimum it is the whole share, because what the model has there says nothing.
        """
        if self._needed is None:
            return math.inf
        problem, needed = self._problem, self._needed
        forces = problem.forces(x)
        assert forces is not None
        slopes = [feature.of(slope) for feature, (_, slope) in zip(problem.features, forces, strict=True)]
        known = [problem.known.get(name) for name in problem.names]
        misfit = problem.misfit(forces)
        after = [z + J @ step for z, J in zip(misfit, slopes, strict=True)]
        now, then = (
            max(evidence.log - needed.log, evidence.log_unknown - needed.log_unknown)
            for evidence in (
                Evidence(problem.likelihood, rows, slopes, at, known, self._off)
                for rows, at in ((misfit, x), (after, x + step))
            )
        )
        # A prior may be steeper than the step takes it for: the evidence now counts if it is higher.
        most = max(now, then) + SLACK * min(gain / ROUGH, 1.0) + SHARE_SLACK * gain
        # The exponential overflows at 709.
        had = 0.0 if gain > ROUGH else math.exp(min(now, 699.0))
        return NEGLIGIBLE * (math.exp(min(most, 700.0)) - had)
