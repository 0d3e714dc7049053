"""Parts of a result: parameters with their uncertainty, the identified rubber and effects, ends of all searches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Material
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect
from bushcli.inverse import certainty
from bushcli.inverse.local import Minimum
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.profile import interval
from bushcli.inverse.result import EndPoint, Estimate, Profile
from bushcli.inverse.task import Task

Array = NDArray[np.float64]

# A bound counts as reached within this share of the parameter's size.
AT_BOUND = 1e-6


def estimates(
    task: Task,
    problem: LeastSquaresProblem,
    x: Array,
    profiles: Sequence[Profile],
) -> tuple[dict[str, Estimate], Array]:
    """Return each parameter with its uncertainty, and their correlation, shape (parameters, parameters)."""
    uncertainty = certainty.uncertainty(problem, x)
    covariance = uncertainty.covariance
    spread = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    intervals = {profile.name: interval(profile) for profile in profiles}
    limits = {profile.name: profile.limits for profile in profiles}
    logarithmic = np.broadcast_to(problem.bounds.logarithmic, x.shape)
    by_name = {}
    for i, name in enumerate(task.names):
        value, lower, upper = float(x[i]), float(problem.bounds.lower[i]), float(problem.bounds.upper[i])
        by_name[name] = Estimate(
            value,
            float(spread[i]),
            lower,
            upper,
            min(value - lower, upper - value) <= AT_BOUND * max(abs(value), 1e-3),
            intervals.get(name),
            limits.get(name, ("misfit", "misfit")),
            uncertainty.quantile,
            bool(logarithmic[i]),
        )
    # A parameter that the curves leave open has no correlation.
    scale = np.where(np.isfinite(spread), np.maximum(spread, 1e-150), 1.0)
    return by_name, np.where(np.isfinite(covariance), covariance, 0.0) / np.outer(scale, scale)


def material(task: Task, problem: LeastSquaresProblem, x: Array) -> Material:
    """Return the identified rubber."""
    bulk, compliance = task.material.bulk_modulus, problem.parameters(x).get("compliance")
    if compliance is not None:
        bulk = 1.0 / compliance if compliance > 0 else float("inf")
    density = DENSITY * problem.parameters(x).get("density", task.material.density / DENSITY)
    return replace(task.material, bulk_modulus=bulk, parameters=problem.law_parameters(x), density=density)


def effects(task: Task, problem: LeastSquaresProblem, x: Array) -> tuple[ActiveEffect, ...]:
    """Return the effects with their identified values."""
    values = problem.parameters(x)
    return tuple(active.with_values(values) for active in task.effects)


def end_points(task: Task, minima: Sequence[Minimum]) -> tuple[EndPoint, ...]:
    """Return where each search began and ended, the one with the smallest misfit first."""
    named = [
        EndPoint(
            dict(zip(task.names, map(float, m.start), strict=True)),
            dict(zip(task.names, map(float, m.x), strict=True)),
            m.cost,
            m.message,
        )
        for m in minima
    ]
    return tuple(sorted(named, key=lambda end: end.cost))
