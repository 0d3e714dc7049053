"""A field of stiffness over the rubber, estimated from a few curves: smooth, no larger than it has to be, and tested.

A curve has far fewer independent samples than the rubber has cells. So the field is a smooth random one a priori, with
the precision V + l^2 L of volumes V and graph Laplacian L: its size and its gradient are penalised. Its standard
deviation is one number, which the marginal likelihood of the misfit decides. Beside it stands a factor on all rubber
alike, which is not penalised, and the parameters that were fitted before. Where the number comes out at zero, the
curves see no more than the uniform factor; how large a likelihood ratio noise alone would make is simulated, since the
limit theorems do not hold at that boundary.

References
----------
Lindgren, Rue and Lindstroem (2011), An explicit link between Gaussian fields and Gaussian Markov random fields,
J. R. Stat. Soc. B 73:423-498, doi:10.1111/j.1467-9868.2011.00777.x (the precision).
Wahba (1985), Ann. Stat. 13:1378-1402, doi:10.1214/aos/1176349743 (marginal likelihood for the degree of smoothing).
Crainiceanu and Ruppert (2004), Likelihood ratio tests in linear mixed models with one variance component,
J. R. Stat. Soc. B 66:165-185, doi:10.1111/j.1467-9868.2004.00438.x (the test, and how to simulate it).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.linearised import OWN, Linearised
from cases.local import Cells

Array = NDArray[np.float64]

# Standard deviations of the field that are tried: up to where half of the rubber's stiffness is in question.
SIZES = np.concatenate([[0.0], np.geomspace(1e-3, 0.5, 28)])
SIMULATED, SEED = 4000, 20260729
# A zone cannot be softer than by all it has, and the first order says nothing about much stiffer ones.
SOFTEST, STIFFEST = -0.95, 3.0


@dataclass(frozen=True)
class Field:
    """What the misfit asks of the rubber's stiffness.

    Attributes
    ----------
    factor : shape (m,)
        Change by cell.
    uniform : float
        Change of all rubber alike that serves best.
    before, after_uniform, after_local : float
        Weighted sum of squares of the misfit, what the fitted parameters can do taken away: as it is, with the
        uniform change, and with the field.
    variance : float
        Of the weighted misfit's noise, by what no plausible field explains; 1 where nothing else is missing.
    p : float
        Probability that a field would help as much, where only the uniform change is true.
    """

    factor: Array
    uniform: float
    before: float
    after_uniform: float
    after_local: float
    variance: float
    p: float


def covariance(cells: Cells, length: float) -> Array:
    """Prior covariance (m, m) of a smooth field whose mean variance is 1.

    Parameters
    ----------
    cells : Cells
    length
        Over which the field varies, mm.
    """
    sharing = 2 ** (cells.points.shape[1] - 1)
    neighbours: dict[tuple[int, int], int] = {}
    of_point: dict[int, list[int]] = {}
    for cell, corners in enumerate(cells.corners):
        for point in corners:
            of_point.setdefault(int(point), []).append(cell)
    for touching in of_point.values():
        for pair in combinations(touching, 2):
            neighbours[pair] = neighbours.get(pair, 0) + 1
    i, j = (
        np.array([pair for pair, count in neighbours.items() if count == sharing], dtype=int).reshape(-1, 2).T
    )
    centres = cells.centres
    # Face over distance, for cells of one size: volume over the square of the distance.
    weight = 0.5 * (cells.volume[i] + cells.volume[j]) / np.sum((centres[i] - centres[j]) ** 2, axis=1)
    precision = np.diag(cells.volume.astype(float))
    np.add.at(precision, (i, i), length**2 * weight)
    np.add.at(precision, (j, j), length**2 * weight)
    np.add.at(precision, (i, j), -(length**2) * weight)
    np.add.at(precision, (j, i), -(length**2) * weight)
    found = np.linalg.inv(precision)
    found *= cells.volume.sum() / float(cells.volume @ np.diag(found))
    return np.asarray(0.5 * (found + found.T))


@dataclass(frozen=True)
class _Beside:
    """Misfit and cells beside the fitted parameters and the uniform factor."""

    whole: Array
    uniform: float
    rest: Array
    columns: Array


def _beside(linear: Linearised, slope: Array) -> _Beside:
    raw = slope.sum(axis=1)
    whole, columns, rest = linear.left(raw), linear.left(slope), linear.rest
    # A factor that the fitted parameters can make as well is theirs.
    if np.linalg.norm(whole) <= OWN * np.linalg.norm(raw):
        return _Beside(np.zeros_like(whole), 0.0, rest, columns)
    uniform = -float(whole @ rest) / float(whole @ whole)
    unit = whole / np.linalg.norm(whole)
    return _Beside(whole, uniform, rest + uniform * whole, columns - np.outer(unit, unit @ columns))


def estimate(linear: Linearised, slope: Array, prior: Array) -> Field:
    """Estimate the field, and test whether it is needed.

    Parameters
    ----------
    linear : Linearised
        Weighted misfit, and what the fitted parameters can do.
    slope : shape (n, m)
        Weighted derivatives by the cells' factors.
    prior : shape (m, m)
        From `covariance`.
    """
    beside = _beside(linear, slope)
    root = np.linalg.cholesky(prior)
    u, d, vt = np.linalg.svd(beside.columns @ root, full_matrices=False)
    z = u.T @ beside.rest

    def fitted(size: float, variance: float) -> Array:
        """Share of each direction that the field takes."""
        return np.asarray(size**2 * d**2 / (variance + size**2 * d**2))

    largest = beside.rest - u @ (fitted(float(SIZES[-1]), 1.0) * z)
    variance = linear.inflation(largest)
    likelihoods = _likelihoods(z[None, :] ** 2 / variance, d**2 / variance)[0]
    size = float(SIZES[int(np.argmax(likelihoods))])
    share = fitted(size, variance)
    local = -root @ (vt.T @ (size**2 * d / (variance + size**2 * d**2) * z))
    power = float(beside.whole @ beside.whole)
    # What of the uniform factor the field does already.
    own = float(beside.whole @ linear.left(slope @ local)) / power if power > 0 else 0.0
    rest = beside.rest - u @ (share * z)
    return Field(
        factor=beside.uniform - own + local,
        uniform=beside.uniform,
        before=float(linear.rest @ linear.rest),
        after_uniform=float(beside.rest @ beside.rest),
        after_local=float(rest @ rest),
        variance=variance,
        p=_probability(
            float(likelihoods.max()), d**2 / variance, min(linear.freedom, linear.samples / variance)
        ),
    )


def _likelihoods(squares: NDArray[np.floating], signal: NDArray[np.floating]) -> Array:
    """Twice the logarithm of the likelihood ratio to no field, shape (simulations, sizes)."""
    found: Array = np.zeros((len(squares), len(SIZES)))
    for i, size in enumerate(SIZES):
        gain = size**2 * signal
        found[:, i] = squares @ (gain / (1.0 + gain)) - np.log1p(gain).sum()
    return found


def _probability(observed: float, signal: Array, freedom: float) -> float:
    """How often noise alone gives as large a ratio; its size is known with so many degrees of freedom."""
    if observed <= 0.0:
        return 1.0
    rng = np.random.default_rng(SEED)
    squares = rng.standard_normal((SIMULATED, len(signal))) ** 2
    if np.isfinite(freedom):
        squares /= (rng.chisquare(max(freedom, 1.0), SIMULATED) / max(freedom, 1.0))[:, None]
    reached = _likelihoods(squares, signal).max(axis=1) >= observed
    return float((1 + reached.sum()) / (1 + SIMULATED))


def zone_drops(linear: Linearised, slope: Array, zones: Array, variance: float) -> tuple[Array, Array]:
    """What a change in one zone alone, beside a uniform one, would do.

    Parameters
    ----------
    linear, slope
        As in `estimate`.
    zones : shape (m, k)
        1 where a cell belongs to the zone, else 0.
    variance
        Of `Field`.

    Returns
    -------
    change, drop : shape (k,)
        Best possible change of stiffness, and fall of the sum of squares in units of the noise's variance.
    """
    beside = _beside(linear, slope)
    columns = beside.columns @ zones
    power = np.sum(columns**2, axis=0)
    towards = -columns.T @ beside.rest
    best = np.divide(towards, power, out=np.zeros_like(power), where=power > 0)
    change = np.clip(best, SOFTEST, STIFFEST)
    return change, (2 * change * towards - change**2 * power) / variance
