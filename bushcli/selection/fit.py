"""Fit a model to the recordings: the maximum a posteriori under the likelihood, from several starts.

All models are fitted to the smooth part of the misfit (`likelihood.features`) together with the priors of the effects'
values; the plain law is also fitted as by `bushcli inverse` (`plain`). The error of form that the likelihood allows
depends on the remaining misfit, so that solving the least-squares problem alternates with an update of its variances
(an EM algorithm): the first solution assumes the median error of form, the next ones the variances that the likelihood
has at the previous solution.

If a model ends worse than a fitted model that it contains, it is fitted again from the optimum of that model, with the
further effect switched off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.evidence.density import SETTLED, Posterior, features_of
from bushcli.evidence.prior import known_parameters
from bushcli.evidence.stopping_rule import Needed, StoppingRule
from bushcli.inverse.channel import StepLimit
from bushcli.inverse.local import Hopeless
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem, Stopping
from bushcli.inverse.start_values import fit_scale, fit_sizes, own_start
from bushcli.inverse.task import Task
from bushcli.likelihood.features import Features
from bushcli.likelihood.form import Likelihood
from bushcli.likelihood.noise import NoiseModel
from bushcli.runtime.workers import end_if_abandoned
from bushcli.selection.model import Fitted, Model
from bushcli.selection.model_cache import COMPARED, Coarse, ModelCache
from cases.march import NotConverged

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Relative change of the sum of squares that ends a fit: some hundredths of a nat.
TOLERANCE = 1e-3
# A fit also ends when this many evaluations reduce the sum of squares by less than this share. Other values change
# probabilities by less than 0.002 (`benchmarks/constants.md`).
VALLEY = 8, 5e-3
# Largest number of alternations between variances and parameters. Other values change probabilities by less than 0.002
# (`benchmarks/constants.md`).
TURNS = 3
# Largest number of evaluations of a fit. Other values change probabilities by less than 0.002
# (`benchmarks/constants.md`).
MOST_EVALUATIONS = 40
# A fit in three dimensions ends when this many of its evaluations have failed; each takes as long as five others.
FAILURES = 6
STOPPING = Stopping(TOLERANCE, VALLEY, rounds=1, evaluations=MOST_EVALUATIONS)
# A model whose objective exceeds that of a model that it contains by more than this is fitted again, and the variances
# take no further turn after one that gains less: a tenth of a nat.
WORSE = 0.2
# Failed steps after which the march of a trial is given up: of 64 marches of fits in which a step had failed, none
# reached its end (practice p04 and one of the development deck). The start from a model that it contains has no limit.
FAILED_STEPS = 1


@dataclass(frozen=True)
class FittedSamples:
    """Recordings as the fit uses them, by channel.

    Attributes
    ----------
    used : tuple of array of bool, shape (n,) each
        Samples that count.
    plain : tuple of float
        Sum of squares of the plain law's misfit features beyond noise; it sets how much formulas may err.
    noises : tuple of NoiseModel, optional
        If empty, the noise is estimated from each recording.
    """

    used: tuple[Mask, ...]
    plain: tuple[float, ...]
    noises: tuple[NoiseModel, ...] = ()


@dataclass(frozen=True)
class _End:
    """Where a search ended, with parameters x (p,); `<` compares the objectives."""

    objective: float
    x: Array
    converged: bool
    # Next to parameters for which the simulation fails.
    at_wall: bool = False
    # It was ended because it could not matter.
    hopeless: bool = False

    def __lt__(self, other: _End) -> bool:
        return self.objective < other.objective

    @property
    def is_stuck(self) -> bool:
        """Whether the search ended beside a failure, or before a minimum without being given up."""
        return self.at_wall or not (self.converged or self.hopeless)


# -- any model -----------------------------------------------------------------------------------------------------


def fit(
    cache: ModelCache,
    case: Case,
    model: Model,
    measured: FittedSamples,
    contained: Model | None = None,
    least: float = float("inf"),
    needed: Needed | None = None,
) -> Fitted | None:
    """Fit a model; None where it cannot be solved from any start.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
        With start values; those of its effects are the first-order amplitudes.
    measured : FittedSamples
    contained : Model, optional
        The best fitted model that it contains, whose optimum is a further start.
    least : float
        `Posterior.objective` of that one, dimensionless, which this model should not exceed.
    needed : Needed, optional
        Evidence below which the model does not matter, so that its fit may be ended; None where it always matters.
    """
    task, problem = pose(cache, case, model, measured)
    start = task.vectors()[0]
    rule = StoppingRule(problem, model.off_values(problem.names), needed)
    if not problem.names:
        return without_parameters(model, problem)
    given = problem.bounds.inside(start)
    initial = given if np.isfinite(problem.residual(given)).all() else _own_law_start(problem, start)
    best = None if initial is None else _search_from(problem, initial, rule)
    exponents = [name for name in model.start if name in problem.names and name not in task.law.linear]
    has_minima = len(model.effects) > 0 and len(exponents) > 1
    if best is not None and (
        (has_minima and not best.hopeless) or (best.is_stuck and rule.is_at_wall(best.x))
    ):
        # With its parameters from the fit without effects, the law may be hardly solvable wherever the search goes
        # (foreign 027: from its own start the plain law ends 89 nats higher). And beside them a law of several
        # exponents may stay in the minimum in which it has imitated the effects (own 087).
        own = _own_law_start(problem, start)
        if own is not None:
            own = fit_sizes(problem, own)
            best = min(best, _search_from(problem, own, rule))
    if contained is not None and (best is None or best.objective > least + WORSE):
        problem.lift_limits()
        at = _values_of_contained(problem, model, contained, start)
        if np.isfinite(problem.residual(at)).all():
            # The optimum of the contained model itself, too: it lies on a bound, where a search cannot begin.
            inner = _End(problem.objective(at), at, True)
            best = inner if best is None else min(best, inner)
            if not isinstance(rule.ends(at), Hopeless):
                best = min(best, _search_from(problem, problem.bounds.inside(at), rule))
    if best is None:
        return None
    # A search that ended in a valley has converged, too, if a full step would not make a visible difference.
    ended = best.converged or not (best.hopeless or rule.is_at_wall(best.x))
    return with_fitted_values(model, problem, best.x, ended)


def pose(
    cache: ModelCache,
    case: Case,
    model: Model,
    measured: FittedSamples,
    failed_steps: int | None = FAILED_STEPS,
    variances: Callable[[tuple[Features, ...]], tuple[float, ...]] | None = None,
) -> tuple[Task, Posterior]:
    """Return the least-squares problem of a model.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
    measured : FittedSamples
    failed_steps : int, optional
        Failed steps after which a march is given up; no limit where None.
    variances : callable, optional
        Features of the channels -> their variances with which the fit begins, dimensionless; those of the likelihood if
        not given.
    """
    task = model.task(case, cache.recorded_tables(case))
    coarse: Coarse = "never" if model.anchor is None else "memory"
    channels = cache.channels(task, coarse=coarse, anchor=model.anchor, tolerance=COMPARED)
    identification = task.pose(channels)
    solid = any(not channel.coupon and channel.model.mesh.dimension == 3 for channel in channels)
    likelihood = Likelihood(features_of(channels, measured.used, measured.noises), measured.plain)
    shear = float(task.law.shear_modulus(**model.start))
    sound = [
        channel.recording.with_gaps_interpolated(m)
        for channel, m in zip(channels, measured.used, strict=True)
    ]
    problem = Posterior(
        identification,
        likelihood,
        tuple(map(float, likelihood.variances())) if variances is None else variances(likelihood.features),
        known_parameters(case, task.effects, shear, sound),
        replace(STOPPING, failures=FAILURES) if solid else STOPPING,
        [StepLimit(failed_steps) for _ in channels],
        end_if_abandoned,
    )
    return task, problem


def refine_mesh(cache: ModelCache, case: Case, fitted: Fitted) -> Fitted | None:
    """Return the fit with forces of the default mesh in place of a coarse one; None if that fails.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    fitted : Fitted
    """
    forces = []
    for channel, before in zip(cache.channels(fitted.model.task(case)), fitted.simulated, strict=True):
        try:
            force, _ = channel.at_samples(channel.solve(fitted.values, ()))
        except NotConverged:
            return None
        forces.append(np.where(np.isfinite(before), force, np.nan))
    return replace(fitted, simulated=tuple(forces))


def _values_of_contained(problem: Posterior, model: Model, contained: Model, start: Array) -> Array:
    """Return the parameters (p,) of a model at the optimum of one that it contains.

    Parameters that the contained model lacks have the values of `start` (p,).
    """
    values = model.values_as(contained)
    at = np.array([values.get(name, value) for name, value in zip(problem.names, start, strict=True)])
    for i, name in enumerate(problem.names):
        known = problem.known.get(name)
        if known is not None and known.prior.is_logarithmic and at[i] == 0.0:
            # The smallest size that the prior admits.
            at[i] = known.prior.range(known.scales)[0]
    return at


def _own_law_start(problem: Posterior, start: Array) -> Array | None:
    """Return the law's own start scaled to the stiffness, with the effects of `start`; None if it cannot be solved."""
    own = problem.bounds.inside(own_start(problem, problem.bounds.clip(start)))
    return fit_scale(problem, own) if np.isfinite(problem.residual(own)).all() else None


def _search_from(problem: Posterior, initial: Array, rule: StoppingRule) -> _End:
    if any(not channel.coupon for channel in problem.channels):
        try:
            problem.watch(problem.reached_stretches(initial), initial)
        except NotConverged:
            return _End(problem.objective(initial), initial, False)
    best, point = _End(float("inf"), initial, False), initial
    for turn in range(1 + TURNS):
        # A little inside the bounds a model may fail that can be solved on them.
        if not np.isfinite(problem.residual(point)).all():
            break
        end = search(problem, point, ends=partial(rule.ends, last=turn == TURNS))
        result = _End(problem.objective(end.x), end.x, end.converged, end.beside_failure, end.hopeless)
        # Variances and parameters may take turns about the optimum instead of settling.
        better = result.objective < best.objective - WORSE
        best = min(best, result)
        if end.hopeless:
            return replace(best, converged=False, hopeless=True)
        if problem.rescale(end.x) < SETTLED or not better:
            break
        point = problem.bounds.inside(end.x)
    return best


def with_fitted_values(model: Model, problem: LeastSquaresProblem, x: Array, converged: bool) -> Fitted:
    """Return a model with its best-fitting values `x` (p,)."""
    forces = problem.forces(x)
    assert forces is not None
    return Fitted(
        model.at(dict(zip(problem.names, map(float, x), strict=True))),
        problem.names,
        x,
        tuple(force for force, _ in forces),
        tuple(slope for _, slope in forces),
        converged,
        problem.forward_solves,
        problem.failed_solves,
        problem.states,
    )


def without_parameters(model: Model, problem: LeastSquaresProblem) -> Fitted | None:
    """Return a model without parameters that could be fitted; None where it cannot be solved."""
    solved = np.isfinite(problem.residual(np.zeros(0))).all()
    return with_fitted_values(model, problem, np.zeros(0), True) if solved else None
