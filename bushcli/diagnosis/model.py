"""A law with effects, fitted to the recordings: what a diagnosis compares.

A model is data and can be sent to another process; a fit of it holds the forces, their derivatives and the weighed sums
of squares by which models are judged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.active import ActiveEffect, told_apart
from bushcli.casefile import Case
from bushcli.diagnosis import kept, weighing
from bushcli.diagnosis.linearised import Linearised
from bushcli.diagnosis.likelihood.noise import Compared, NoiseModel, noise_model
from bushcli.diagnosis.start import begin
from bushcli.diagnosis.usual import admitted
from bushcli.inverse.begin import first_point
from bushcli.inverse.channel import Channel
from bushcli.inverse.local import inside
from bushcli.inverse.problem import Problem
from bushcli.inverse.search import search
from bushcli.inverse.task import Task
from cases.march import NotConverged

Array = NDArray[np.float64]

# Relative change of the sum of squares that ends a fit: BIC sees no smaller difference.
TOLERANCE = 3e-4
# The same far from the noise, where no decision hangs on it.
ROUGH = 2e-3
# A fit has an end, too, where so many evaluations bring less than this share.
VALLEY = 10, 5e-3
# The same of a fit that begins where another one ended.
AGAIN = 3, 2e-2
# No search takes more evaluations: one that has not met the recordings by then does not, and BIC sees it.
MOST = 40
# Nor does one in three dimensions that could not solve so many trials; each takes as long as five others.
FAILURES = 6
# Searches after which unstable states that were reached join the problem.
ROUNDS = 1
# Misfit over noise below which the common factors of the forces take part in a fit.
NEAR = 3.0
# No simulation is trusted to better than this share of the force range.
FLOOR = 1e-3


@dataclass(frozen=True)
class Hope:
    """A weighed sum of squares, and the channels' common factors with which it was found."""

    chi_square: float
    factors: tuple[float, ...]


@dataclass(frozen=True)
class Model:
    """A law, its start values, and effects.

    Attributes
    ----------
    law : str
    start : mapping
        Of the law's parameters.
    fixed : bool
        Whether the law keeps them, as one that comes from coupons.
    effects : tuple of ActiveEffect
        With start values; one that is in several rigs gets its names here.
    terms : int, optional
        Of a law with optional terms.
    anchor : mapping, optional
        Of the law alone: with it, solid bodies that remember get a coarse mesh, whose force is brought to that of the
        usual one at these parameters (`kept`). A march in three dimensions takes a minute otherwise.
    retreats : tuple of mapping
        Start values by full names that stand in for those of effects where these cannot be solved, in their order.
    hoped : Hope, optional
        What a start has to reach, or it is compared with the law's own (`start`).
    """

    law: str
    start: Mapping[str, float]
    fixed: bool = False
    effects: tuple[ActiveEffect, ...] = ()
    terms: int | None = None
    anchor: Mapping[str, float] | None = None
    retreats: tuple[Mapping[str, float], ...] = ()
    hoped: Hope | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", told_apart(self.effects))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(one.name for one in self.effects)

    @property
    def identities(self) -> tuple[str, ...]:
        """Names of the effects that do not depend on what else the model has: to compare models by."""
        return tuple(one.identity for one in self.effects)

    def without(self, name: str) -> Model:
        """The model that lacks an effect."""
        return replace(self, effects=tuple(one for one in self.effects if one.name != name))

    def task(self, case: Case) -> Task:
        """The identification of it."""
        held = tuple(self.start) if self.fixed else ()
        bare = replace(case, effects=self.effects)
        return Task(bare, self.law, start=dict(self.start), fixed=held, terms=self.terms)


# Of the scaled normal matrix: eigenvalues below this share of the largest are those of combinations that are left open,
# and a parameter that has such a part in one is left open, too.
OPEN, PART = 1e-14, 1e-6


@dataclass(frozen=True)
class Fitted:
    """A model at its best.

    Attributes
    ----------
    model : Model
        With the identified values.
    names : tuple of str
        Of the parameters that were identified.
    x : shape (p,)
    channels : tuple of Compared
        Recorded and simulated.
    jacobians : tuple of array, shape (n, p) each
    factors, used : tuple of float
        Standard deviation of each channel's common factor (`weighing`), and the one that the fit was made with: beside
        a misfit far above the noise the factor is known as much better, or it would be stretched to hide some of it.
    converged : bool
    solves, failed : int
        Simulations of a channel, and evaluations that failed.
    """

    model: Model
    names: tuple[str, ...]
    x: Array
    channels: tuple[Compared, ...]
    jacobians: tuple[Array, ...]
    factors: tuple[float, ...]
    used: tuple[float, ...]
    converged: bool
    solves: int = 0
    failed: int = 0
    linear: Linearised = field(init=False, repr=False)

    def __post_init__(self) -> None:
        made = weighing.linear_fit(self.channels, self.used, self.jacobians)
        object.__setattr__(self, "linear", made)

    @property
    def chi_square(self) -> float:
        """Weighed sum of squares of the misfit."""
        return chi_square(self.channels, self.factors)

    @property
    def samples(self) -> float:
        """Effective number of independent samples."""
        return self.linear.samples

    @property
    def size(self) -> float:
        """Root mean square misfit over the noise."""
        return float(np.sqrt(self.chi_square / max(self.samples - len(self.x), 1.0)))

    def bic(self) -> float:
        """Bayesian information criterion; the less the better."""
        return self.chi_square + len(self.x) * float(np.log(max(self.samples, 2.0)))

    @property
    def judged(self) -> tuple[Compared, ...]:
        """The channels with their common factors taken out, as they are looked at."""
        return tuple(weighing.calibrated(c, f) for c, f in zip(self.channels, self.factors, strict=True))

    def covariance(self) -> Array:
        """Of the parameters, shape (p, p), the misfit's own size and memory allowed for.

        The variance of what the recordings leave open, alone or in a combination, is infinite.
        """
        J = self.linear.jacobian
        spread = self.linear.inflation(self.linear.rest)
        size = np.linalg.norm(J, axis=0)
        size = np.where(size > 0, size, 1.0)
        values, vectors = np.linalg.eigh((J / size).T @ (J / size))
        known = values > OPEN * values.max(initial=0.0)
        inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
        found = np.asarray(spread * inverse / np.outer(size, size))
        found[np.diag_indices(len(size))] = np.where(
            np.any(np.abs(vectors[:, ~known]) > PART, axis=1), np.inf, np.diag(found)
        )
        return found

    def standard_errors(self) -> dict[str, float]:
        """Of each identified parameter, by full name; infinite where the recordings leave it open."""
        spread = np.sqrt(np.maximum(np.diag(self.covariance()), 0.0))
        return dict(zip(self.names, map(float, spread), strict=True))


class Weighed(Problem):
    """The least-squares problem whose sum of squares is that by which models are compared."""

    noises: tuple[NoiseModel, ...]
    factors: tuple[float, ...]
    masks: tuple[Array, ...]

    def compared(self, x: Array) -> tuple[Compared, ...] | None:
        """The channels at x, samples held out unknown; None where a march did not converge."""
        forces = self.forces(x)
        if forces is None:
            return None
        return tuple(
            Compared(channel.recording, np.where(mask, np.nan, force), noise)
            for channel, (force, _), noise, mask in zip(
                self.channels, forces, self.noises, self.masks, strict=True
            )
        )

    def _rows(self, x: Array) -> tuple[Array, Array]:
        forces, channels = self.forces(x), self.compared(x)
        if forces is None or channels is None:
            size = self.samples + len(self.states)
            return np.full(size, np.nan), np.full((size, len(x)), np.nan)
        fit = weighing.linear_fit(channels, self.factors, [slope for _, slope in forces])
        # Of the order of one, so that the law's stability weighs what it does elsewhere.
        unit = np.sqrt(len(self.channels) / max(fit.samples, 1.0))
        value, slope = self._stability(x)
        return np.concatenate([unit * fit.misfit, value]), np.concatenate([unit * fit.jacobian, slope])


def pose(case: Case, model: Model, masks: Sequence[Array] | None = None) -> tuple[Task, Weighed]:
    """The least-squares problem of a model; `masks` say which samples of each channel are held out."""
    task = model.task(case)
    coarse: kept.Coarse = "never" if model.anchor is None else "memory"
    channels = kept.channels(task, coarse=coarse, anchor=model.anchor)
    plain = task.pose(channels)
    problem = Weighed(channels, plain.law, plain.names, plain.fixed, (0.9, 1.1))
    problem.states, problem.tolerance, problem.valley = plain.states, TOLERANCE, VALLEY
    problem.rounds, problem.walls, problem.most = ROUNDS, False, MOST
    if any(not channel.coupon and channel.model.mesh.dimension == 3 for channel in channels):
        problem.failures = FAILURES
    problem.noises = tuple(_noise(channel) for channel in channels)
    problem.factors = tuple(weighing.factor_of(channel) for channel in channels)
    none = [np.zeros(len(channel.recording.force), dtype=bool) for channel in channels]
    problem.masks = tuple(none if masks is None else masks)
    return task, problem


def fit(
    case: Case,
    model: Model,
    masks: Sequence[Array] | None = None,
    rescale: bool = False,
    factors: tuple[float, ...] | None = None,
) -> Fitted | None:
    """Fit a model to the recordings of a case; None where it cannot be solved from its start values.

    Parameters
    ----------
    masks
        True for samples of each channel that are held out.
    rescale
        Take the scale out of the law's start values first.
    factors
        Standard deviation of each channel's common factor, where it is known from another fit how near the model
        comes (`Fitted.used`).
    """
    task, problem = pose(case, model, masks)
    if not problem.names:
        return _fitted(task, model, problem, np.zeros(0), True, problem.factors)
    start, lower, upper = _within(model, problem, *task.vectors())
    begun = _begun(problem, model, rescale, start, lower, upper)
    if begun is None or not np.isfinite(problem.residual(begun)).all():
        return None
    if any(not channel.coupon for channel in problem.channels):
        try:
            problem.watch(begun)
        except NotConverged:
            return None
    real = problem.factors
    if factors is not None:
        # Another fit has been nearly here.
        problem.factors, problem.valley = factors, AGAIN
        end = search(problem, begun, lower, upper)
        return _fitted(task, model, problem, end.x, end.converged, real)
    problem.factors, problem.tolerance = tuple(0.0 for _ in real), ROUGH
    end = search(problem, begun, lower, upper)
    channels = problem.compared(end.x)
    if channels is not None:
        size = np.sqrt(chi_square(channels, real) / max(sum(c.effective_samples for c in channels), 1.0))
        problem.factors = tuple(factor / max(1.0, float(size)) for factor in real)
        if size < NEAR:
            problem.tolerance = TOLERANCE
            end = search(problem, end.x, lower, upper)
    return _fitted(task, model, problem, end.x, end.converged, real)


def _within(
    model: Model, problem: Weighed, start: Array, lower: Array, upper: Array
) -> tuple[Array, Array, Array]:
    """Start and bounds as far as an effect is what it is called."""
    lower, upper = lower.copy(), upper.copy()
    for one in model.effects:
        there = [channel.recording for channel in problem.channels]
        having = [recording for recording in there if one.acts_on(recording.name, recording.mode)]
        for parameter in one.parameters:
            if one.full_name(parameter) in problem.names:
                i = problem.names.index(one.full_name(parameter))
                lower[i], upper[i] = admitted(one.effect, parameter, having)
    return np.clip(start, lower, upper), lower, upper


def _begun(
    problem: Weighed, model: Model, rescale: bool, start: Array, lower: Array, upper: Array
) -> Array | None:
    """Start of the search, None where there is none that can be solved."""
    if rescale:
        return first_point(problem, start, lower, upper)[0]
    if model.hoped is None:
        return inside(start, lower, upper)
    hoped = model.hoped

    def is_enough(x: Array) -> bool:
        channels = problem.compared(x)
        return channels is not None and chi_square(channels, hoped.factors) <= hoped.chi_square

    return begin(problem, start, lower, upper, model.retreats, is_enough)


def predicted(case: Case, fitted: Fitted) -> tuple[Compared, ...] | None:
    """All samples, held-out ones included, with the parameters of a fit; None where a march did not converge."""
    _, problem = pose(case, fitted.model)
    return problem.compared(fitted.x)


def exact(case: Case, fitted: Fitted) -> Fitted | None:
    """The fit with the forces of the usual mesh, where they were those of a coarse one; None where that fails."""
    task, found = fitted.model.task(case), []
    for channel, compared in zip(kept.channels(task), fitted.channels, strict=True):
        values = {**fitted.model.start, **dict(zip(fitted.names, map(float, fitted.x), strict=True))}
        for one in fitted.model.effects:
            values |= {one.full_name(p): one.values[p.name] for p in one.parameters}
        try:
            force, _ = channel.at_samples(channel.solve(values, ()))
        except NotConverged:
            return None
        found.append(replace(compared, simulated=np.where(compared.known, force, np.nan)))
    return replace(fitted, channels=tuple(found))


def chi_square(channels: Sequence[Compared], factors: Sequence[float]) -> float:
    """Weighed sum of squares of the misfit of all channels."""
    total = 0.0
    for channel, factor in zip(channels, factors, strict=True):
        rows = weighing.whitened(np.where(channel.known, channel.misfit, 0.0), channel, factor)
        total += float(rows @ rows)
    return total


def _fitted(
    task: Task, model: Model, problem: Weighed, x: Array, converged: bool, factors: tuple[float, ...]
) -> Fitted | None:
    channels, forces = problem.compared(x), problem.forces(x)
    if channels is None or forces is None:
        return None
    values = problem.parameters(x)
    effects = tuple(
        replace(one, values={p.name: values[one.full_name(p)] for p in one.parameters})
        for one in task.effects
    )
    law_parameters = problem.law_parameters(x) or dict(model.start)
    found = replace(model, start=law_parameters, effects=effects, retreats=(), hoped=None)
    return Fitted(
        model=found,
        names=problem.names,
        x=x,
        channels=channels,
        jacobians=tuple(slope for _, slope in forces),
        factors=factors,
        used=problem.factors,
        converged=converged,
        solves=problem.forward_solves,
        failed=problem.failed_solves,
    )


def _noise(channel: Channel) -> NoiseModel:
    return noise_model(channel.recording, FLOOR)
