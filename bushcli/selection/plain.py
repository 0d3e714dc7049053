"""Fit the plain law: first before the size of its misfit is known, at the end as `bushcli inverse` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.evidence.density import features_of
from bushcli.inverse.minimum_search import first_minimum, search
from bushcli.likelihood.features import Features
from bushcli.likelihood.noise import NoiseModel
from bushcli.selection.fit import FittedSamples, pose, with_fitted_values, without_parameters
from bushcli.selection.model import Fitted, Model
from bushcli.selection.model_cache import ModelCache

Mask = NDArray[np.bool_]

# Assumed error of a law, as a share of the force, before its misfit is known: what engineers accept of a law.
UNKNOWN = 0.1


def fit_plain(
    cache: ModelCache, case: Case, model: Model, known: Mapping[str, float] | None = None
) -> Fitted | None:
    """Fit the plain law as `bushcli inverse` does; None where it cannot be solved from any start.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
    known : mapping of str to float, optional
        Values that another search has found, each in its unit. Where they describe the recordings better than the end
        of this search, it goes on from there: beside the edge of the law's stability a search may end in a local
        minimum.
    """
    task = model.task(case)
    problem = task.pose(cache.channels(task))
    if not problem.names:
        return with_fitted_values(model, problem, np.zeros(0), True)
    result = first_minimum(problem, task.vectors()[0])
    best = None if result is None else result.minimum
    if known is not None:
        x = problem.bounds.clip(np.array([known[name] for name in problem.names]))
        if problem.cost(x) < (np.inf if best is None else best.cost):
            other = search(problem, x)
            best = other if best is None or other.cost < best.cost else best
    return None if best is None else with_fitted_values(model, problem, best.x, best.converged)


def first_plain_fit(cache: ModelCache, case: Case, model: Model, used: tuple[Mask, ...]) -> Fitted | None:
    """Fit the plain law before the size of its misfit is known; None if it cannot be solved from any start.

    Every channel is weighted as if the law were wrong by `UNKNOWN` of its force.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
    used : tuple of (n,) array of bool
        Samples that count.
    """
    samples = FittedSamples(used, (0.0,) * len(used))

    def variances(features: tuple[Features, ...]) -> tuple[float, ...]:
        return tuple(1.0 + UNKNOWN**2 * feature.signal / max(feature.count, 1) for feature in features)

    task, problem = pose(cache, case, model, samples, failed_steps=None, variances=variances)
    if not problem.names:
        return without_parameters(model, problem)
    result = first_minimum(problem, task.vectors()[0])
    best = None if result is None else result.minimum
    return None if best is None else with_fitted_values(model, problem, best.x, best.converged)


def all_features(
    cache: ModelCache, case: Case, model: Model, used: Sequence[Mask], noises: Sequence[NoiseModel]
) -> tuple[Features, ...]:
    """Features of each channel.

    Parameters
    ----------
    cache : ModelCache
    case : Case
    model : Model
    used : sequence of (n,) array of bool
        Samples that count.
    noises : sequence of NoiseModel
    """
    return features_of(cache.channels(model.task(case)), used, noises)
