"""How well the curves determine the parameters: covariance from the remaining misfit, directions in words, leverage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from bushcli.curve.misfit import correlation_time
from bushcli.inverse.autoregression import errors_of
from bushcli.inverse.problem import LeastSquaresProblem, weighted_misfits
from bushcli.inverse.result import NORMAL, Combination

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A singular value of the weighted Jacobian (per relative change of each parameter) below this share of the largest
# marks a combination that the curves leave open.
UNDETERMINED = 1e-3
# Weights of parameters in a combination up to this are not named: judgement; words only.
_SHOWN = 0.1
# Eigenvalues of the scaled information below this share of the largest are rounding: derivatives have seven digits.
RESOLVED = 1e-14
# Recordings with fewer independent samples beyond the parameters have intervals as wide as with this many: with the
# number itself, intervals held the truth in 98 to 99.9 % of drawn recordings instead of 97 to 99.7 %.
LEAST_FREEDOM = 3.0


@dataclass(frozen=True)
class Uncertainty:
    """How well the curves determine the parameters."""

    # Shape (p, p), in the units of the parameters; infinite variances of those that the curves leave open.
    covariance: Array
    # Independent samples less parameters: degrees of freedom of Student's distribution.
    freedom: float

    @property
    def quantile(self) -> float:
        """Number of standard errors to each side of a value that hold 95 %."""
        return NORMAL if not np.isfinite(self.freedom) else float(stdtrit(self.freedom, 0.975))

    @property
    def deviations(self) -> Array | None:
        """A root (p, p) of the covariance, times the quantile; None if the curves leave a parameter open."""
        if not np.isfinite(self.covariance).all():
            return None
        values, axes = np.linalg.eigh(self.covariance)
        return np.asarray(self.quantile * axes * np.sqrt(np.maximum(values, 0.0)))


def uncertainty(problem: LeastSquaresProblem, x: Array) -> Uncertainty:
    """Return the uncertainty of the parameters from the misfit that remains.

    The estimator weights channels evenly, so its covariance is a sandwich (White 1980, doi:10.2307/1912934): each
    channel contributes that of its own errors, whose neighbours are correlated (`bushcli.inverse.autoregression`).
    """
    forces = problem.forces(x)
    if forces is None:
        return Uncertainty(np.full((len(x), len(x)), np.nan), np.inf)
    middle, independent = np.zeros((len(x), len(x))), 0.0
    channels = weighted_misfits(problem.channels, forces)
    for residual, rows in channels:
        errors = errors_of(residual, rows, len(x) / len(channels))
        middle += errors.covariance_of_sums(rows)
        independent += len(residual) / errors.time
    every = np.vstack([rows for _, rows in channels])
    bread, is_open = invert_information(every.T @ every)
    covariance = np.asarray(bread @ middle @ bread)
    covariance[is_open, is_open] = np.inf
    return Uncertainty(covariance, max(independent - len(x), LEAST_FREEDOM))


def invert_information(information: Array) -> tuple[Array, Mask]:
    """Return the inverse of an information matrix (p, p), and the parameters (p,) that it leaves open.

    The parameters have units of their own, and information that differs by many orders of magnitude: each is scaled by
    its own. Directions without information in double precision are left out of the inverse.
    """
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    determined = values > RESOLVED * values[-1]
    undetermined = vectors[:, ~determined]
    inverse = (vectors[:, determined] / values[determined]) @ vectors[:, determined].T
    return inverse / np.outer(size, size), np.asarray((undetermined**2).sum(axis=1) > RESOLVED**0.5)


def leverage(problem: LeastSquaresProblem, x: Array) -> dict[str, dict[str, float]]:
    """Return, by channel and parameter, the relative change of the parameter when the channel's force is 1 % larger.

    A recording's noise is not its only error: a load cell out of calibration, a coarse mesh or missing physics shift a
    whole curve, and no statistics of the misfit show that. The change is computed to first order.
    """
    forces = problem.forces(x)
    if forces is None:
        return {}
    rows = [slope for _, slope in weighted_misfits(problem.channels, forces)]
    every = np.vstack(rows)
    bread, _ = invert_information(every.T @ every)
    changes = {}
    for channel, row, (force, _) in zip(problem.channels, rows, forces, strict=True):
        error = 0.01 * force / (channel.scale * np.sqrt(len(force)))
        change = bread @ row.T @ error / np.where(x == 0, 1.0, x)
        changes[channel.name] = dict(zip(problem.names, map(float, change), strict=True))
    return changes


def autocorrelation_time(error: Array) -> float:
    """Return how many neighbouring samples carry the information of one independent sample; 1 for white noise.

    A mean of the error is subtracted, because a force offset does not correlate neighbours.
    """
    return correlation_time(error - error.mean())


def directions(problem: LeastSquaresProblem, x: Array) -> tuple[Array, tuple[Combination, ...]]:
    """Return the relative singular values, per relative change of each parameter, and what the curves leave open.

    Parameters of which every combination is open come first, together; the combinations of the others follow.
    """
    jacobian = problem.jacobian(x)[: problem.samples]
    scaled = jacobian * np.where(x == 0, 1.0, np.abs(x))
    _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    relative = singular / max(float(singular[0]), 1e-300)
    is_open = relative < UNDETERMINED
    free = np.sum(rows[is_open] ** 2, axis=0) > 1.0 - _SHOWN**2
    names, left_open = np.array(problem.names), []
    if free.any():
        left_open.append(_undetermined([*map(str, names[free])], float(relative[is_open][0])))
    if not free.all():
        _, others, rows = np.linalg.svd(scaled[:, ~free], full_matrices=False)
        sizes = others / max(float(singular[0]), 1e-300)
        pairs = zip(rows[sizes < UNDETERMINED], sizes[sizes < UNDETERMINED], strict=True)
        left_open += [
            _combination([*map(str, names[~free])], x[~free], row, float(size)) for row, size in pairs
        ]
    return relative, tuple(left_open)


def _undetermined(names: Sequence[str], size: float) -> Combination:
    weights = dict.fromkeys(names, 1.0)
    if len(names) == 1:
        return Combination(weights, size, f"{names[0]} is not determined by these curves")
    text = f"{', '.join(names[:-1])} and {names[-1]} are not determined by these curves, alone or jointly"
    return Combination(weights, size, text)


def _combination(names: Sequence[str], x: Array, row: Array, size: float) -> Combination:
    row = row * np.sign(row[np.argmax(np.abs(row))])
    signed = zip(names, row, x, strict=True)
    parts = {
        name: float(weight * np.sign(value or 1.0)) for name, weight, value in signed if abs(weight) > _SHOWN
    }
    *others, last = parts
    if not others:
        return _undetermined([last], size)
    ratio = ", ".join(f"{name} by {100 * weight:+.0f} %" for name, weight in parts.items())
    text = f"{', '.join(others)} and {last} can only be determined jointly: changing {ratio} of their values at once "
    return Combination(parts, size, f"{text}hardly changes the curves")
