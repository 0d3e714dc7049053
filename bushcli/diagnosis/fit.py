"""Fit a model to the recordings: the maximum a posteriori under the likelihood, from several starts.

The plain law is fitted as `bushcli inverse` fits it, to the same number. All models are fitted to the smooth part of
the misfit (`likelihood.features`) together with the priors of the effects' values. How much the likelihood lets the
formulas err depends on what a model leaves, so the least-squares problem is solved in turns with that (an EM
algorithm): first as if formulas were as wrong as they are in the median, then with the variances that the likelihood
gives the result.

No model ends worse than one that it contains: where it does, it begins again from that one's optimum, with the further
effect switched off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.diagnosis import model_cache
from bushcli.diagnosis.density import Posterior, features_of
from bushcli.diagnosis.likelihood.form import Likelihood
from bushcli.diagnosis.likelihood.noise import NoiseModel
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.prior import known_parameters
from bushcli.inverse.begin import own_start, scaled
from bushcli.inverse.local import inside
from bushcli.inverse.problem import Problem
from bushcli.inverse.search import search
from bushcli.inverse.task import Task
from cases.march import NotConverged

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Relative change of the sum of squares that ends a fit: some hundredths of a nat.
TOLERANCE = 1e-3
# A fit has an end, too, where so many evaluations bring less than this share.
VALLEY = 8, 5e-3
# Turns of variances and parameters at most, and factor below which a change of the variances is none.
TURNS, SETTLED = 3, 1.3
# No fit takes more evaluations.
MOST = 40
# Nor does one in three dimensions that could not solve so many trials; each takes as long as five others.
FAILURES = 6
# A model that ends worse by more than this than one that it contains begins again from there: a tenth of a nat.
WORSE = 0.2
# Shares of the first-order amplitude that are tried where that cannot be solved.
RETREATS = (0.5, 0.2, 0.05)
# Failed steps after which a march of a trial is given up. The last start has all the patience there is.
PATIENCE = 2


@dataclass(frozen=True)
class Measured:
    """Recordings as the fit uses them, by channel.

    Attributes
    ----------
    used : tuple of array of bool, shape (n,) each
        Samples that count.
    plain : tuple of float
        Sum of squares of the features that the plain law leaves beyond noise; it sets how much formulas may err.
    noises : tuple of NoiseModel, optional
        As each recording shows it, without.
    """

    used: tuple[Mask, ...]
    plain: tuple[float, ...]
    noises: tuple[NoiseModel, ...] = ()


@dataclass(frozen=True)
class _End:
    """Where a search ended; less means a lower objective.

    Attributes
    ----------
    objective : float
    x : shape (p,)
    converged : bool
    at_wall : bool
        Better parameters could not be solved.
    """

    objective: float
    x: Array
    converged: bool
    at_wall: bool = False

    def __lt__(self, other: _End) -> bool:
        return self.objective < other.objective


# -- any model -----------------------------------------------------------------------------------------------------


def fit(
    case: Case, model: Model, measured: Measured, contained: Sequence[Model] = (), least: float = float("inf")
) -> Fitted | None:
    """Fit a model; None where it cannot be solved from any start.

    Parameters
    ----------
    case : Case
    model : Model
        With start values: the first-order ones of its effects.
    measured : Measured
    contained : sequence of Model
        Fitted models that it contains, the best first: their optima are starts, too.
    least : float
        `Posterior.objective` of the best of these, dimensionless, which this one must not exceed.
    """
    task, problem = pose(case, model, measured)
    start, lower, upper = task.vectors()
    if not problem.names:
        return (
            fitted(model, problem, np.zeros(0), True)
            if np.isfinite(problem.residual(np.zeros(0))).all()
            else None
        )
    initial = _first_solved(problem, model, start, lower, upper)
    best = None if initial is None else _searched(problem, initial, lower, upper)
    if best is not None and best.at_wall:
        # What the law alone is fitted to may be a law that can hardly be solved, and no way leads from there.
        own = _own(problem, start, lower, upper)
        best = best if own is None else min(best, _searched(problem, own, lower, upper))
    for other in contained[:1] if best is None or best.objective > least + WORSE else ():
        for channel in problem.channels:
            model_cache.set_patience(channel, None)
        at = _admitted(problem, _vector(problem, model.off(other), start))
        if not np.isfinite(problem.residual(at)).all():
            continue
        # The optimum of what it contains, as it is: at a bound, where a search cannot begin.
        found = _End(problem.objective(at), at, True)
        again = _searched(problem, inside(at, lower, upper), lower, upper)
        best = min(one for one in (best, found, again) if one is not None)
    return None if best is None else fitted(model, problem, best.x, best.converged)


def pose(
    case: Case, model: Model, measured: Measured, patience: int | None = PATIENCE
) -> tuple[Task, Posterior]:
    """Return the least-squares problem of a model.

    Parameters
    ----------
    case : Case
    model : Model
    measured : Measured
    patience : int, optional
        Failed steps after which a march is given up; no limit where None.
    """
    task = model.task(case)
    coarse: model_cache.Coarse = "never" if model.anchor is None else "memory"
    channels = model_cache.channels(task, coarse=coarse, anchor=model.anchor, patience=patience)
    plain = task.pose(channels)
    problem = Posterior(channels, plain.law, plain.names, plain.fixed, (0.9, 1.1))
    problem.states, problem.tolerance, problem.valley = plain.states, TOLERANCE, VALLEY
    problem.rounds, problem.walls, problem.most = 1, False, MOST
    if any(not channel.coupon and channel.model.mesh.dimension == 3 for channel in channels):
        problem.failures = FAILURES
    problem.likelihood = Likelihood(features_of(channels, measured.used, measured.noises), measured.plain)
    problem.variances = tuple(map(float, problem.likelihood.variances()))
    shear = float(task.law.shear_modulus(**model.start))
    problem.known = known_parameters(case, task.effects, shear, [c.recording for c in channels])
    return task, problem


def exact(case: Case, fitted: Fitted) -> Fitted | None:
    """Return the fit with forces of the default mesh in place of a coarse one; None if that fails.

    Parameters
    ----------
    case : Case
    fitted : Fitted
    """
    found = []
    for channel, before in zip(model_cache.channels(fitted.model.task(case)), fitted.simulated, strict=True):
        try:
            force, _ = channel.at_samples(channel.solve(fitted.values, ()))
        except NotConverged:
            return None
        found.append(np.where(np.isfinite(before), force, np.nan))
    return Fitted(
        fitted.model,
        fitted.names,
        fitted.x,
        tuple(found),
        fitted.jacobians,
        fitted.converged,
        fitted.solves,
        fitted.failed,
    )


def _first_solved(problem: Posterior, model: Model, start: Array, lower: Array, upper: Array) -> Array | None:
    """Return the first start that can be solved: as given, with smaller effects, or with the law's own start scaled."""
    for point in _starts(problem, model, start):
        initial = inside(np.clip(point, lower, upper), lower, upper)
        if np.isfinite(problem.residual(initial)).all():
            return initial
    return _own(problem, start, lower, upper)


def _own(problem: Posterior, start: Array, lower: Array, upper: Array) -> Array | None:
    """Return the law's own start brought to scale, with the effects of the start; None where it cannot be solved."""
    own = inside(own_start(problem, np.clip(start, lower, upper)), lower, upper)
    return scaled(problem, own, lower, upper) if np.isfinite(problem.residual(own)).all() else None


def _starts(problem: Posterior, model: Model, start: Array) -> list[Array]:
    found = [start]
    amplitudes = {
        one.full_name(p): float(p.off or 0.0) for one in model.effects for p in one.effect.amplitudes
    }
    for share in RETREATS if amplitudes else ():
        less = [
            amplitudes[n] + share * (v - amplitudes[n]) if n in amplitudes else v
            for n, v in zip(problem.names, start, strict=True)
        ]
        found.append(np.array(less))
    return found


def _searched(problem: Posterior, initial: Array, lower: Array, upper: Array) -> _End:
    if any(not channel.coupon for channel in problem.channels):
        try:
            problem.watch(initial)
        except NotConverged:
            return _End(problem.objective(initial), initial, False)
    end = search(problem, initial, lower, upper)
    for _ in range(TURNS):
        if problem.rescale(end.x) < SETTLED:
            break
        end = search(problem, inside(end.x, lower, upper), lower, upper)
    return _End(problem.objective(end.x), end.x, end.converged, end.beside_failure)


def _vector(problem: Problem, values: Mapping[str, float], start: Array) -> Array:
    return np.array([values.get(name, value) for name, value in zip(problem.names, start, strict=True)])


def _admitted(problem: Posterior, x: Array) -> Array:
    """Return the point with zero amplitudes raised to the smallest size that their priors admit."""
    found = x.copy()
    for i, name in enumerate(problem.names):
        known = problem.known.get(name)
        if known is not None and known.prior.is_logarithmic and found[i] == 0.0:
            found[i] = known.prior.range(known.scales)[0]
    return found


def fitted(model: Model, problem: Problem, x: Array, converged: bool) -> Fitted:
    """Return a model at its best.

    Parameters
    ----------
    model : Model
    problem : Problem
    x : (p,) array
        Values of its parameters, each in its unit.
    converged : bool
    """
    forces = problem.forces(x)
    assert forces is not None
    values = dict(zip(problem.names, map(float, x), strict=True))
    return Fitted(
        model.at(values),
        problem.names,
        x,
        tuple(force for force, _ in forces),
        tuple(slope for _, slope in forces),
        converged,
        problem.forward_solves,
        problem.failed_solves,
    )
