"""How well the curves determine the parameters: covariance from the misfit left, directions in words, profiles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bushcli.inverse.local import TOLERANCE, inside
from bushcli.inverse.problem import Problem
from bushcli.inverse.result import Combination, Profile

Array = NDArray[np.float64]

# Singular values of the weighted Jacobian per relative change of each parameter, below this share of the largest: a
# combination that the curves leave open.
UNDETERMINED = 1e-3
# A standard error above this share of the value: poorly determined, worth a profile.
POOR = 0.2
# Rise of the cost, in units of the noise seen, at the ends of a 95 % interval: chi square of one degree of freedom.
RISE_95 = 3.841
PROFILE_POINTS = 5


def covariance(problem: Problem, x: Array) -> Array:
    """Covariance of the parameters, shape (p, p), from the noise actually seen.

    The estimator weighs channels evenly, so its covariance is a sandwich: each channel brings its own variance of the
    misfit, enlarged by the misfit's autocorrelation along the recording, since neighbouring samples that err
    together count less.

    References
    ----------
    White (1980), Econometrica 48:817-838, doi:10.2307/1912934 (sandwich estimator).
    Sokal (1997), Monte Carlo methods in statistical mechanics, doi:10.1007/978-1-4899-0319-8_6 (autocorrelation time).
    """
    forces = problem.forces(x)
    if forces is None:
        return np.full((len(x), len(x)), np.nan)
    slopes, middle = [], np.zeros((len(x), len(x)))
    freedom = len(x) / len(problem.channels)
    for channel, (force, slope) in zip(problem.channels, forces, strict=True):
        weight = 1.0 / (channel.scale * np.sqrt(len(force)))
        error, rows = (force - channel.recording.force) * weight, slope * weight[:, None]
        variance = float(error @ error) / max(len(error) - freedom, 1.0)
        middle += variance * autocorrelation_time(error) * rows.T @ rows
        slopes.append(rows)
    bread = np.linalg.pinv(sum(rows.T @ rows for rows in slopes), rcond=1e-14)
    return np.asarray(bread @ middle @ bread)


def leverage(problem: Problem, x: Array) -> dict[str, dict[str, float]]:
    """Channel -> parameter -> relative change of the parameter when the channel's force is 1 % larger.

    A recording's noise is not its only error: a load cell out of calibration, a coarse mesh or missing physics shift a
    whole curve, and no statistics of the misfit shows that. To first order.
    """
    forces = problem.forces(x)
    if forces is None:
        return {}
    rows = [
        slope / (c.scale * np.sqrt(len(c.scale)))[:, None]
        for c, (_, slope) in zip(problem.channels, forces, strict=True)
    ]
    bread = np.linalg.pinv(sum(r.T @ r for r in rows), rcond=1e-14)
    found = {}
    for channel, row, (force, _) in zip(problem.channels, rows, forces, strict=True):
        error = 0.01 * force / (channel.scale * np.sqrt(len(channel.scale)))
        change = bread @ row.T @ error / np.where(x == 0, 1.0, x)
        found[channel.name] = dict(zip(problem.names, map(float, change), strict=True))
    return found


def autocorrelation_time(error: Array) -> float:
    """How many neighbouring samples count as one: 1 for white noise.

    Sum of the autocorrelation up to the first window that is five times the sum so far (Sokal's rule).
    """
    n = len(error)
    centred = error - error.mean()
    power = float(centred @ centred)
    if n < 8 or power == 0.0:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * n)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum))[: n // 2] / power
    total = 1.0
    for lag in range(1, len(correlation)):
        total += 2.0 * float(correlation[lag])
        if lag >= 5.0 * total:
            break
    return float(np.clip(total, 1.0, n / 4))


def directions(problem: Problem, x: Array) -> tuple[Array, tuple[Combination, ...]]:
    """Singular values per relative change of each parameter, over the largest, and the combinations left open."""
    jacobian = problem.jacobian(x)[: problem.samples]
    scaled = jacobian * np.where(x == 0, 1.0, np.abs(x))
    _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    relative = singular / max(float(singular[0]), 1e-300)
    open_ones = [
        _combination(problem.names, x, row, float(size))
        for size, row in zip(relative, rows, strict=True)
        if size < UNDETERMINED
    ]
    return relative, tuple(open_ones)


def _combination(names: Sequence[str], x: Array, row: Array, size: float) -> Combination:
    row = row * np.sign(row[np.argmax(np.abs(row))])
    parts = {
        name: float(w * np.sign(v or 1.0)) for name, w, v in zip(names, row, x, strict=True) if abs(w) > 0.1
    }
    if len(parts) == 1:
        text = f"{next(iter(parts))} is not determined by these curves"
    else:
        ratio = ", ".join(f"{name} by {100 * w:+.0f} %" for name, w in parts.items())
        text = (
            f"{' and '.join(parts)} are only determined together: changing {ratio} of their values at once hardly "
            "changes the curves"
        )
    return Combination(parts, size, text)


def profile(problem: Problem, x: Array, index: int, spread: float, lower: Array, upper: Array) -> Profile:
    """Cost along one parameter with all others refitted, in units of the noise seen, to beyond its 95 % interval."""
    best = problem.cost(x)
    channels = len(problem.channels)
    # The sum of squares that one standard deviation of the noise seen would add, autocorrelation included.
    forces = problem.forces(x)
    assert forces is not None
    samples = 0.0
    for channel, (force, _) in zip(problem.channels, forces, strict=True):
        samples += len(force) / autocorrelation_time((force - channel.recording.force) / channel.scale)
    unit = best / max(samples - len(x), 1.0)
    rest = np.arange(len(x)) != index
    reach = np.clip(x[index] + 2.5 * spread * np.linspace(-1, 1, PROFILE_POINTS), lower[index], upper[index])
    values, rise = [], []
    for value in np.unique(np.append(reach, x[index])):
        if value == x[index]:
            cost = best
        else:
            cost = _refitted(problem, x, index, float(value), rest, lower, upper)
        values.append(float(value))
        rise.append((cost - best) * channels / (unit * channels) if unit > 0 else 0.0)
    return Profile(problem.names[index], np.array(values), np.array(rise))


def _refitted(
    problem: Problem, x: Array, index: int, value: float, rest: NDArray[np.bool_], lower: Array, upper: Array
) -> float:
    if not rest.any():
        moved = x.copy()
        moved[index] = value
        return problem.cost(moved)

    def whole(y: Array) -> Array:
        full = x.copy()
        full[rest], full[index] = y, value
        return full

    start = inside(x[rest], lower[rest], upper[rest])
    if not np.isfinite(problem.residual(whole(start))).all():
        return float("nan")
    result = least_squares(
        lambda y: problem.residual(whole(y)),
        start,
        jac=lambda y: problem.jacobian(whole(y))[:, rest],
        bounds=(lower[rest], upper[rest]),
        x_scale="jac",
        ftol=1e-4,
        xtol=TOLERANCE,
        max_nfev=8,
    )
    return problem.cost(whole(result.x))


def interval(found: Profile) -> tuple[float, float] | None:
    """95 % interval where the profile crosses the limit; None where it does not on either side."""
    good = np.isfinite(found.rise)
    values, rise = found.values[good], found.rise[good]
    if len(values) < 3:
        return None
    middle = int(np.argmin(rise))
    left = _crossing(values[: middle + 1][::-1], rise[: middle + 1][::-1])
    right = _crossing(values[middle:], rise[middle:])
    return (
        None
        if left is None and right is None
        else (
            float("-inf") if left is None else left,
            float("inf") if right is None else right,
        )
    )


def _crossing(values: Array, rise: Array) -> float | None:
    above = np.flatnonzero(rise >= RISE_95)
    if not len(above) or above[0] == 0:
        return None
    i = int(above[0])
    # The profile is close to a parabola: interpolate its root linearly.
    roots = np.sqrt(np.maximum(rise[[i - 1, i]], 0.0))
    share = (np.sqrt(RISE_95) - roots[0]) / (roots[1] - roots[0])
    return float(values[i - 1] + share * (values[i] - values[i - 1]))
