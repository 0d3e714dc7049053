"""Linearisation of a fit at its minimum: changes that the fitted parameters can make, and the rest of other changes.

Everything is weighted so that one independent sample of noise has unit variance (`Compared.weights`). The part of a
change of the curves that the fitted parameters could make as well is projected out: a recording says nothing about it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.misfit import correlation_time
from bushcli.likelihood.noise import Compared

Array = NDArray[np.float64]

# Relative singular value below which a combination of fitted parameters counts as changing nothing. Rounding.
_RANK = 1e-10
# Least share of a column that the fitted parameters and the other columns cannot make. Other values change
# probabilities by less than 0.002 (`benchmarks/constants.md`).
OWN = 1e-3


@dataclass(frozen=True)
class Linearised:
    """A fit at its minimum.

    Attributes
    ----------
    misfit : (n,) array
        Weighted simulated minus recorded force of all channels, one after the other.
    jacobian : (n, p) array
        Derivatives of the misfit by the fitted parameters.
    blocks : tuple of (int, int)
        Index of each channel's first sample, and of its last plus 1.
    samples : float
        Effective number of independent samples.
    freedom : float
        Degrees of freedom of the noise's variance.
    """

    misfit: Array
    jacobian: Array
    blocks: tuple[tuple[int, int], ...]
    samples: float
    freedom: float

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis (n, r) of the changes that the fitted parameters can make."""
        size = np.linalg.norm(self.jacobian, axis=0)
        u, s, _ = np.linalg.svd(self.jacobian / np.where(size > 0, size, 1.0), full_matrices=False)
        return np.asarray(u[:, s > _RANK * max(float(s.max(initial=0.0)), 1e-300)])

    def left(self, columns: Array) -> Array:
        """Return the part of columns (n, ...) that the fitted parameters cannot make."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    @cached_property
    def rest(self) -> Array:
        """Misfit (n,) after one more linear step of the fit."""
        return self.left(self.misfit)

    def inflation(self, rest: Array) -> float:
        """Variance of a sum over the misfit, from its own size and correlation, over that of noise; at least 1.

        Parameters
        ----------
        rest : (n,) array
            The misfit, or the misfit that a candidate leaves.
        """
        parts = [rest[a:b] for a, b in self.blocks]
        samples = sum(len(part) for part in parts)
        return max(1.0, sum(correlation_time(part) * float(part @ part) for part in parts) / max(samples, 1))


def linearise(channels: Sequence[Compared], jacobians: Sequence[Array]) -> Linearised:
    """Return the misfit and derivatives of all channels, weighted and stacked.

    Parameters
    ----------
    channels : sequence of Compared
    jacobians : sequence of (n, p) array
        Derivatives of each channel's simulated force by the fitted parameters.
    """
    ends = np.cumsum([0, *(len(channel.misfit) for channel in channels)])
    return Linearised(
        misfit=np.concatenate([np.where(c.known, c.misfit, 0.0) * c.weights for c in channels]),
        jacobian=weigh(channels, jacobians),
        blocks=tuple((int(a), int(b)) for a, b in pairwise(ends)),
        samples=sum(channel.effective_samples for channel in channels),
        # The channel whose noise is known least decides.
        freedom=min(channel.noise.freedom for channel in channels),
    )


def weigh(channels: Sequence[Compared], columns: Sequence[Array]) -> Array:
    """Return derivatives of the channels' simulated forces, weighted and stacked: shape (all samples, k).

    Parameters
    ----------
    channels : sequence of Compared
    columns : sequence of (n, k) array
        Derivatives of each force.
    """
    return np.concatenate(
        [
            np.where(channel.known[:, None], column, 0.0) * channel.weights[:, None]
            for channel, column in zip(channels, columns, strict=True)
        ]
    )


def cone_fit(gram: Array, score: Array, signs: Sequence[int]) -> tuple[Array, float]:
    """Least squares with signs: minimise a' G a - 2 a' s where sign_i a_i >= 0 for sign_i of +1 and -1.

    All supports are tried, the whole one first, which is exact and feasible for few unknowns: the minimum with signs is
    the unconstrained minimum on its own support, and no support reaches lower than one that contains it.

    Parameters
    ----------
    gram : (k, k) array
    score : (k,) array
    signs : sequence of {1, 0, -1}
        0: both signs.

    Returns
    -------
    a : (k,) array
    drop : float
        Negative of the minimum, >= 0.

    References
    ----------
    Silvapulle and Sen (2005), Constrained statistical inference, Wiley, doi:10.1002/9781118165614, chapter 3.
    """
    k = len(score)
    if k == 1:
        a = score / gram[0]
        return (a, float(a[0] * score[0])) if a[0] * signs[0] >= 0.0 else (np.zeros(1), 0.0)
    direction = np.asarray(signs)
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    unit, scaled = gram / np.outer(scale, scale), score / scale
    best, drop = np.zeros(k), 0.0
    for support in chain.from_iterable(combinations(range(k), size) for size in range(k, 0, -1)):
        chosen = np.array(support)
        block = unit[np.ix_(chosen, chosen)]
        # Nearly collinear columns would be combined with huge amplitudes of opposite sign.
        if len(chosen) > 1 and _smallest(block) < OWN**2:
            continue
        a = np.linalg.solve(block, scaled[chosen])
        gain = float(a @ scaled[chosen])
        if gain > drop and (a * direction[chosen] >= 0).all():
            best, drop = np.zeros(k), gain
            best[chosen] = a / scale[chosen]
            if len(chosen) == k:
                break
    return best, drop


def _smallest(block: Array) -> float:
    """Smallest eigenvalue of a correlation matrix; of two columns in closed form."""
    return float(1.0 - abs(block[0, 1]) if len(block) == 2 else np.linalg.eigvalsh(block)[0])
