"""A field of stiffness over the rubber, estimated from a few curves: smooth, no larger than necessary, and tested.

A curve has far fewer independent samples than the rubber has cells. The prior of the field is therefore a smooth random
field with the precision V + l^2 L of volumes V and graph Laplacian L, which penalises its size and its gradient. Its
standard deviation is one number, found by the marginal likelihood of the misfit. A uniform factor on all rubber and the
parameters that were fitted before are estimated beside it, without penalty. If the standard deviation is found to be
zero, the curves show no more than the uniform factor. The likelihood ratios that noise alone would cause are simulated,
since the limit theorems do not hold at that boundary.

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

from bushcli.likelihood.linearisation import OWN, Linearised
from cases.local import Cells

Array = NDArray[np.float64]

# Standard deviations of the field that are tried: up to half of the rubber's stiffness.
SIZES = np.concatenate([[0.0], np.geomspace(1e-3, 0.5, 28)])
# Simulations of the likelihood ratio.
SIMULATED, SEED = 4000, 20260729
# Bounds of a change of the logarithm of a zone's stiffness: no rubber varies by more within one bushing.
SOFTEST, STIFFEST = np.log(0.1), np.log(3.0)


@dataclass(frozen=True)
class Field:
    """Field of stiffness changes that reduces the misfit.

    Attributes
    ----------
    change : shape (m,)
        Change of the logarithm of the stiffness by cell, beside the uniform change, to first order.
    variance : float
        Of the noise in the weighted misfit, from the misfit that the largest field leaves; 1 if that is only noise.
    p : float
        Probability that a field would help as much if only the uniform change were true.
    """

    change: Array
    variance: float
    p: float


def covariance(cells: Cells, length: float) -> Array:
    """Prior covariance (m, m) of a smooth field whose mean variance is 1 and that varies over `length`, mm."""
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
    prior = np.linalg.inv(precision)
    prior *= cells.volume.sum() / float(cells.volume @ np.diag(prior))
    return np.asarray(0.5 * (prior + prior.T))


def _without_uniform_factor(linear: Linearised, slope: Array) -> tuple[Array, Array]:
    """Return misfit (n,) and derivatives (n, m) less what the fitted parameters and a uniform factor can change."""
    raw = slope.sum(axis=1)
    whole, columns, rest = linear.left(raw), linear.left(slope), linear.rest
    size = float(np.linalg.norm(whole))
    # The fitted parameters already include a uniform factor.
    if size <= OWN * float(np.linalg.norm(raw)):
        return rest, columns
    unit = whole / size
    return rest - unit * float(unit @ rest), columns - np.outer(unit, unit @ columns)


def uniform(linear: Linearised, slope: Array, change: Array | float = 0.0) -> float:
    """The best uniform change of stiffness, beside a change (m,) by cell; 0 if the fitted parameters include it."""
    raw = slope.sum(axis=1)
    whole = linear.left(raw)
    power = float(whole @ whole)
    if power <= OWN**2 * float(raw @ raw):
        return 0.0
    rest = linear.rest + linear.left(slope @ np.broadcast_to(change, slope.shape[1]))
    return -float(whole @ rest) / power


def estimate(linear: Linearised, slope: Array, prior: Array) -> Field:
    """Estimate the field, and test whether it is needed.

    `linear` has the weighted misfit and the changes that the fitted parameters can make, `slope` (n, m) the weighted
    derivatives by the cells' factors, and `prior` (m, m) is from `covariance`.
    """
    rest, columns = _without_uniform_factor(linear, slope)
    root = np.linalg.cholesky(prior)
    u, d, vt = np.linalg.svd(columns @ root, full_matrices=False)
    z = u.T @ rest

    def absorbed_share(size: float, variance: float) -> Array:
        """Share of the misfit in each direction that the field absorbs."""
        return np.asarray(size**2 * d**2 / (variance + size**2 * d**2))

    largest = rest - u @ (absorbed_share(float(SIZES[-1]), 1.0) * z)
    variance = linear.inflation(largest)
    likelihoods = _likelihoods(z[None, :] ** 2 / variance, d**2 / variance)[0]
    size = float(SIZES[int(np.argmax(likelihoods))])
    taken = size**2 * d / (variance + size**2 * d**2) * z
    observed, p = float(likelihoods.max()), 1.0
    if observed > 0.0:
        # How often noise alone gives as large a ratio; its variance is known with so many degrees of freedom.
        freedom, rng = min(linear.freedom, linear.samples / variance), np.random.default_rng(SEED)
        squares = rng.standard_normal((SIMULATED, len(d))) ** 2
        if np.isfinite(freedom):
            squares /= (rng.chisquare(max(freedom, 1.0), SIMULATED) / max(freedom, 1.0))[:, None]
        reached = _likelihoods(squares, d**2 / variance).max(axis=1) >= observed
        p = float((1 + reached.sum()) / (1 + SIMULATED))
    return Field(change=-root @ (vt.T @ taken), variance=variance, p=p)


def _likelihoods(squares: NDArray[np.floating], signal: NDArray[np.floating]) -> Array:
    """Twice the logarithm of the likelihood ratio against no field, shape (simulations, sizes)."""
    ratios: Array = np.zeros((len(squares), len(SIZES)))
    for i, size in enumerate(SIZES):
        gain = size**2 * signal
        ratios[:, i] = squares @ (gain / (1.0 + gain)) - np.log1p(gain).sum()
    return ratios


@dataclass(frozen=True)
class Zones:
    """Effect of a change in one zone alone, beside a uniform change.

    Attributes
    ----------
    change : shape (k,)
        Best change of the logarithm of the stiffness.
    drop : shape (k,)
        Decrease of the weighted sum of squares.
    variance : float
        Of the weighted misfit that the best change leaves, allowing for its correlation; at least 1.
    """

    change: Array
    drop: Array
    variance: float


def estimate_zones(linear: Linearised, slope: Array, zones: Array) -> Zones:
    """Change one zone at a time; `zones` (m, k) is 1 where a cell belongs to the zone, else 0."""
    rest, columns = _without_uniform_factor(linear, slope)
    columns = columns @ zones
    power = np.sum(columns**2, axis=0)
    towards = -columns.T @ rest
    best = np.divide(towards, power, out=np.zeros_like(power), where=power > 0)
    change = np.clip(best, SOFTEST, STIFFEST)
    drop = 2 * change * towards - change**2 * power
    first = int(np.argmax(drop))
    return Zones(change, drop, linear.inflation(rest + columns[:, first] * change[first]))
