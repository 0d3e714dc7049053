"""The least-squares problem: weighted misfit of all channels, its exact Jacobian, and the law's stability.

Each channel counts by the mean square of its misfit in units of its own scale, so that neither a longer nor a stiffer
channel dominates. Instability of the law at the relevant stretches adds to the misfit, smoothly from the edge of
stability on. The misfit of a trial that cannot be solved is not a number, which the trust region takes as a step too
far.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import ChannelForces, FitChannel, StepLimit
from bushcli.inverse.journal import Journal
from bushcli.inverse.result import Evaluation
from bushcli.runtime.interrupt import meet
from cases.march import NotConverged
from cases.stability import moduli, paths
from forms.law import Law

Array = NDArray[np.float64]

# A relative change of the cost or of the parameters below this ends the search: far below what noise can resolve.
TOLERANCE = 1e-7
# A search ends on the floor of a valley when this many evaluations lower the cost by less than this share, a tenth of a
# unit of chi square. Nothing else ends it if the curves leave a combination of parameters open (Ogden, one recording).
VALLEY = 8, 3e-4
# Largest number of evaluations of one search.
MOST_EVALUATIONS = 200
# Largest number of times that states reached by a search are added to the problem: one is usual, three have occurred.
ROUNDS = 5
# States between rest and the largest stretch of a channel in which the law has to be stable: judgement, the moduli
# of a law vary smoothly between them.
STABILITY_STATES = 24
# The smallest eigenvalue of the tangent moduli may fall to this share of the initial shear modulus.
STABILITY_MARGIN = 0.01
# Misfit, in units of scale, for a state whose smallest modulus is one shear modulus below the margin: far more than
# any channel can gain by it.
STABILITY_WEIGHT = 1e3
# Width of the penalty's smooth onset, in shear moduli: a search that met a sharp edge without warning would end there.
STABILITY_EDGE = 0.005
# A row of the penalty above this holds the search back.
ACTIVE = 1e-3

Progress = Callable[[Evaluation], None]


@dataclass(frozen=True)
class Stopping:
    """When the searches of a problem end.

    Attributes
    ----------
    tolerance : float
        Relative change of parameters and misfit that counts as none.
    valley : (int, float)
        Evaluations, in which a run of failed ones counts once, and the share of the misfit that they have to gain
        together.
    rounds : int
        Searches after which the stability in the states reached is required once more.
    evaluations, failures : int
        Largest numbers of evaluations, and of those that fail.
    """

    tolerance: float = TOLERANCE
    valley: tuple[int, float] = VALLEY
    rounds: int = ROUNDS
    evaluations: int = MOST_EVALUATIONS
    failures: int = MOST_EVALUATIONS


STOPPING = Stopping()


class LeastSquaresProblem:
    """Misfit and Jacobian of a set of channels as a function of the law's parameters.

    Parameters
    ----------
    channels, law
        What is fitted together; the law's stability is part of the problem.
    names, bounds
        Parameters that are identified, in the order of the vectors.
    fixed
        Parameters that keep their value.
    states : shape (n, 3)
        Principal stretches in which the law has to be stable; more may be watched later.
    journal
        Where evaluations are saved, so that a run can be resumed.
    progress
        Called after each evaluation.
    stopping
        When searches end.
    start
        Number of the start whose search it is.
    limits
        Failed steps after which marches are given up, by channel, as an earlier search left them; if empty, there is no
        limit at first.
    """

    def __init__(
        self,
        channels: Sequence[FitChannel],
        law: Law,
        names: Sequence[str],
        fixed: Mapping[str, float],
        bounds: Bounds,
        states: Array,
        journal: Journal | None = None,
        progress: Progress | None = None,
        stopping: Stopping = STOPPING,
        start: int = 0,
        limits: Sequence[StepLimit] = (),
    ) -> None:
        self.stopping, self.bounds = stopping, bounds
        self.channels, self.law, self.names, self.fixed = list(channels), law, tuple(names), dict(fixed)
        self.journal, self.progress, self.states = journal, progress, states
        self.evaluations: list[Evaluation] = []
        self.forward_solves = self.failed_solves = 0
        self.best: tuple[float, Array] | None = None
        # Recorded with each evaluation.
        self._start = start
        self._stage: Literal["search", "profile"] = "search"
        self.limits = [replace(limit) for limit in limits] or [StepLimit() for _ in channels]
        self._known: dict[bytes, list[ChannelForces] | None] = {}

    @property
    def posed(
        self,
    ) -> tuple[Sequence[FitChannel], Law, Sequence[str], Mapping[str, float], Bounds, Array]:
        """What is fitted, and by which parameters: arguments of another problem that weighs the misfit otherwise."""
        return self.channels, self.law, self.names, self.fixed, self.bounds, self.states

    def watch(self, states: Array, best: Array | None = None) -> None:
        """Also require the law's stability in further states.

        Parameters
        ----------
        states : shape (n, 3)
            Principal stretches.
        best : shape (parameters,)
            Best point so far, where the states may change its cost.
        """
        self.states = np.concatenate([self.states, states])
        if best is not None:
            self.best = (self.cost(best), best.copy())

    def begin_profiles(self, states: Array) -> None:
        """End the searches: the profiles require stability in the states, shape (n, 3), of the best search."""
        self._stage, self.states = "profile", states

    def lift_limits(self) -> None:
        """Give up no further march before one has reached its end, whatever limit was given."""
        self.limits = [StepLimit() for _ in self.channels]

    def reached_stretches(self, x: Array) -> Array:
        """Principal stretches, shape (n, 3), that the rubber of the bushings reaches; none where `x` has no solution.

        Those of swept curves are stored in the answer: near the edge of stability a second march may end on another
        branch.
        """
        states: list[Array] = [np.zeros((0, 3))]
        for channel, limit, answer in zip(self.channels, self.limits, self.answers(x) or (), strict=False):
            with suppress(NotConverged):
                states.append(channel.reached_stretches(self.parameters(x), answer, limit))
        return np.concatenate(states)

    def instability(self, x: Array, states: Array | None = None) -> Array:
        """Return the penalty of instability, one row per state; this needs no solution of the model.

        Parameters
        ----------
        x : shape (parameters,)
        states : shape (n, 3)
            Principal stretches; None for those that the problem watches.
        """
        return penalty(self._smallest_eigenvalues(x, self.states if states is None else states))

    def penalty_and_margins(self, x: Array) -> tuple[Array, Array]:
        """`instability` in the states watched, and their margins (MPa), negative beyond the edge.

        In MPa, margins are concave in the parameters that the energy is linear in, and finite in rubber whose initial
        shear modulus vanishes.
        """
        smallest, parameters = self._smallest_eigenvalues(x, self.states), self.law_parameters(x)
        return penalty(smallest), _positive_modulus(self.law, parameters) * (smallest - STABILITY_MARGIN)

    # -- what an optimiser asks for ------------------------------------------------------------------------------

    @property
    def samples(self) -> int:
        """Number of measured rows of all channels."""
        return sum(len(channel.measured) for channel in self.channels)

    @property
    def sweeps(self) -> int:
        """Evaluations of all channels so far."""
        return len(self.evaluations)

    def residual(self, x: Array) -> Array:
        """Weighted misfit, shape (samples + states,); NaN where a march did not converge."""
        return self._rows(x)[0]

    def jacobian(self, x: Array) -> Array:
        """Derivative of `residual`, shape (samples + states, parameters)."""
        return self._rows(x)[1]

    def cost(self, x: Array) -> float:
        """Mean over the channels of the mean square misfit in units of scale, instability included."""
        return float(np.sum(self.residual(x) ** 2)) / len(self.channels)

    def forces(self, x: Array) -> list[tuple[Array, Array]] | None:
        """Force and derivatives at the samples of each channel; None where a march did not converge."""
        answers = self.answers(x)
        if answers is None:
            return None
        return [channel.at_samples(answer) for channel, answer in zip(self.channels, answers, strict=True)]

    def parameters(self, x: Array) -> dict[str, float]:
        """All parameters of the law and of effects by name, fixed ones included."""
        return {**self.fixed, **dict(zip(self.names, map(float, x), strict=True))}

    def law_parameters(self, x: Array) -> dict[str, float]:
        """Parameters of the law alone, by name."""
        names_of_law = {parameter.name for parameter in self.law.parameters}
        return {name: value for name, value in self.parameters(x).items() if name in names_of_law}

    def stiffness_shares(self, x: Array) -> tuple[Array, Array]:
        """Return the derivatives (p,) of the initial shear modulus by parameters, and their derivatives (p, p).

        They are zero for all parameters that the energy is not linear in.
        """
        free = [name in self.law.linear for name in self.names]
        linear, parameters = self.law.linear, self.law_parameters(x)
        off = {name: 0.0 if name in linear else value for name, value in parameters.items()}
        shares, slopes = np.zeros(len(x)), np.zeros((len(x), len(x)))
        for i in np.flatnonzero(free):
            alone = off | {self.names[i]: 1.0}
            shares[i] = self.law.shear_modulus(**alone)
            for j, name in enumerate(self.names):
                if name in off and not free[j]:
                    # A complex step, which `shear_modulus` allows, is exact.
                    stepped = self.law.shear_modulus(**alone | {name: alone[name] + 1e-30j})
                    slopes[i, j] = np.imag(stepped) / 1e-30
        return shares, slopes

    # -- evaluation ----------------------------------------------------------------------------------------------

    def _rows(self, x: Array) -> tuple[Array, Array]:
        forces = self.forces(x)
        if forces is None:
            size = self.samples + len(self.states)
            return np.full(size, np.nan), np.full((size, len(x)), np.nan)
        values, slopes = zip(*weighted_misfits(self.channels, forces), strict=True)
        value, slope = self._stability(x)
        return np.concatenate([*values, value]), np.concatenate([*slopes, slope])

    def known_answers(self, x: Array) -> list[ChannelForces] | None:
        """Return the solved curves at parameters that have been evaluated already, otherwise None."""
        return self._known.get(_key(x))

    def count_evaluations(self, evaluations: Sequence[Evaluation], solves: int, failed: int) -> None:
        """Add the evaluations of another start, numbered after the own ones.

        Parameters
        ----------
        evaluations : sequence of Evaluation
        solves, failed
            Numbers of its solved curves, and of its evaluations that failed.
        """
        before = self.sweeps
        self.evaluations += [
            replace(evaluation, number=before + evaluation.number) for evaluation in evaluations
        ]
        self.forward_solves += solves
        self.failed_solves += failed

    def learn(self, x: Array, answers: list[ChannelForces]) -> None:
        """Take over solved curves from another problem with the same channels.

        Parameters
        ----------
        x : shape (parameters,)
        answers
            One for each channel.
        """
        self._known.setdefault(_key(x), answers)

    def answers(self, x: Array, iteration: int = 0) -> list[ChannelForces] | None:
        """Solved curves of all channels; None where a march did not converge, or where a number is not finite.

        Parameters
        ----------
        x : shape (parameters,)
        iteration
            The optimiser's, which is recorded with a new evaluation.
        """
        key = _key(x)
        if key not in self._known:
            answers = self.journal.find(x) if self.journal is not None else None
            if answers is None:
                meet(self.channels[0].comm)
                try:
                    answers = [
                        channel.solve(self.parameters(x), self.names, limit)
                        for channel, limit in zip(self.channels, self.limits, strict=True)
                    ]
                except NotConverged:
                    answers = []
                if self.journal is not None:
                    self.journal.add(x, answers)
            if not all(answer.is_finite for answer in answers):
                answers = []
            self._known[key] = answers or None
            self.forward_solves += len(answers) or 1
            self._report(x, iteration)
        return self._known[key]

    def _report(self, x: Array, iteration: int) -> None:
        cost = self.cost(x)
        if not np.isfinite(cost):
            self.failed_solves += 1
        best = bool(np.isfinite(cost) and (self.best is None or cost < self.best[0]))
        if best:
            self.best = (cost, x.copy())
        number, values = self.sweeps + 1, self.parameters(x)
        evaluation = Evaluation(number, values, cost, best, self._stage, self._start, iteration)
        self.evaluations.append(evaluation)
        if self.progress is not None:
            self.progress(evaluation)

    def _stability(self, x: Array) -> tuple[Array, Array]:
        """Return rows that are zero where the law is stable with a margin and grow linearly beyond; and derivatives."""
        value = self.instability(x)
        return value, differences(self.instability, x) if value.any() else np.zeros((len(value), len(x)))

    def _smallest_eigenvalues(self, x: Array, states: Array) -> Array:
        """Smallest eigenvalue of the tangent moduli in each state, in initial shear moduli; -1 if not finite."""
        parameters = self.law_parameters(x)
        return smallest_moduli(self.law, parameters, states) if parameters else np.ones(len(states))


def _key(x: Array) -> bytes:
    return np.ascontiguousarray(x, dtype=float).tobytes()


def weighted_misfits(
    channels: Sequence[FitChannel], forces: Sequence[tuple[Array, Array]]
) -> list[tuple[Array, Array]]:
    """Return the misfit (n,) and its derivatives (n, parameters) of each channel, which counts by its mean square."""
    rows = []
    for channel, (force, slope) in zip(channels, forces, strict=True):
        weight = 1.0 / (channel.scale * np.sqrt(len(force)))
        rows.append(((force - channel.measured) * weight, slope * weight[:, None]))
    return rows


def differences(function: Callable[[Array], Array], x: Array) -> Array:
    """Return the derivative of a cheap, smooth function by forward differences, shape (values, parameters).

    Parameters
    ----------
    function
        Returns an array, shape (values,).
    x : shape (parameters,)
    """
    base, steps = function(x), 1e-6 * np.maximum(np.abs(x), 1e-3)
    if not len(x):
        return np.zeros((len(base), 0))
    return np.column_stack([(function(x + step) - base) / step.sum() for step in np.diag(steps)])


def smallest_moduli(law: Law, parameters: Mapping[str, float], states: Array) -> Array:
    """Return the smallest tangent modulus in each state, shape (n,), in initial shear moduli; -1 where not finite.

    Parameters
    ----------
    law : Law
    parameters : mapping of str to float
        The law's parameters, each in its unit.
    states : Array
        Principal stretches, shape (n, 3).
    """
    shear = _positive_modulus(law, parameters)
    tangents = moduli(law, parameters, states)
    finite = np.isfinite(tangents).all(axis=(1, 2))
    smallest = np.full(len(states), -1.0)
    smallest[finite] = np.linalg.eigvalsh(tangents[finite])[:, 0] / shear
    return smallest


def _positive_modulus(law: Law, parameters: Mapping[str, float]) -> float:
    """Magnitude of the initial shear modulus, MPa, never zero; 1 where the rubber has no law."""
    return max(abs(float(law.shear_modulus(**parameters))), 1e-12) if parameters else 1.0


def penalty(smallest: Array) -> Array:
    """Return the rows of the misfit (n,) by the smallest moduli in each state (n,), in shear moduli."""
    excess = (STABILITY_MARGIN - smallest) / STABILITY_EDGE
    lacking = np.where(excess > -12.0, STABILITY_EDGE * np.logaddexp(0.0, excess), 0.0)
    return np.asarray(STABILITY_WEIGHT / np.sqrt(max(len(smallest), 1)) * lacking)


def coupon_states(stretches: tuple[float, float]) -> Array:
    """Principal stretches, shape (n, 3), of the coupon modes within the stretches that matter."""
    (low, high), half = stretches, STABILITY_STATES // 2
    logs = np.log([*np.linspace(low, 1.0, half, endpoint=False), *np.linspace(1.0, high, half)])
    states = []
    for first, second in paths().values():
        e = np.column_stack([first * logs, second * logs, -(first + second) * logs])
        # A state counts only where none of its stretches leaves the range.
        inside = (np.exp(e) >= low - 1e-9).all(axis=1) & (np.exp(e) <= high + 1e-9).all(axis=1)
        states.append(np.exp(e[inside]))
    return np.concatenate(states)
