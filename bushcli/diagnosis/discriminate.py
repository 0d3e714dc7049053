"""Which further recording would tell rivals apart: the cheapest whose curves they cannot both follow.

A rival is fitted again when the new recording is there, and may move to meet it, as far as the recordings that there
are let it. With d the difference of two rivals' predictions in units of noise, J the derivatives of the second one's
prediction by all its parameters (those of its effects included), and M the information that the present recordings
hold about them, what remains is D^2 = min over x of |d - J x|^2 + x' M x. If the first is right, the second one's
misfit will be worse by D^2 on average, with standard deviation 2 D: at D = 4.65 one recording in a hundred decides
wrongly.

References
----------
Atkinson and Fedorov (1975), The design of experiments for discriminating between two rival models, Biometrika
62:57-70, doi:10.1093/biomet/62.1.57 (the distance after refitting as criterion).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.menu import Proposal
from bushcli.diagnosis.rivals import TOLD_APART

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """What a rival expects of a proposed recording.

    Attributes
    ----------
    force : (n,) array
        N, N mm or MPa.
    jacobian : (n, p) array
        Its derivatives by the rival's parameters.
    information : (p, p) array
        J'J of the present recordings, weighted by their noise; with it the parameters are known to its inverse.
    """

    force: Array
    jacobian: Array
    information: Array


@dataclass(frozen=True)
class Separation:
    """How well a proposed recording tells rivals apart.

    Attributes
    ----------
    proposal : Proposal
    worst : float
        Smallest distance of two rivals after refitting, in standard errors.
    pair : (str, str)
        Those two: the right one, and the one that imitates it.
    distances : mapping
        (right, imitating) -> distance, for every ordered pair but those of a special case and what contains it.
    """

    proposal: Proposal
    worst: float
    pair: tuple[str, str]
    distances: Mapping[tuple[str, str], float]

    @property
    def told_apart(self) -> tuple[tuple[str, str], ...]:
        """Pairs that the recording would tell apart, whichever of the two is right."""
        return tuple(
            (a, b)
            for a, b in combinations(sorted({name for pair in self.distances for name in pair}), 2)
            if min(self.distances.get(pair, np.inf) for pair in ((a, b), (b, a))) >= TOLD_APART
        )

    @property
    def decides(self) -> bool:
        """Whether the recording would decide."""
        return self.worst >= TOLD_APART


def distance(right: Prediction, imitating: Prediction, sigma: float) -> float:
    """Return by how many standard errors two rivals' recordings differ, when the second is fitted to the first's."""
    weight = 1.0 / sigma
    gap, slope = (right.force - imitating.force) * weight, imitating.jacobian * weight
    if slope.shape[1] == 0:
        return float(np.linalg.norm(gap))
    scale = np.sqrt(np.diag(slope.T @ slope) + np.diag(imitating.information))
    scale = np.where(scale > 0, scale, 1.0)
    slope, known = slope / scale, imitating.information / np.outer(scale, scale)
    # As least squares with the square root of the information below, which is better conditioned than the sum.
    values, vectors = np.linalg.eigh(0.5 * (known + known.T))
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    rows, target = np.vstack([slope, root]), np.concatenate([gap, np.zeros(len(root))])
    x = np.linalg.lstsq(rows, target, rcond=1e-12)[0]
    return float(np.linalg.norm(target - rows @ x))


def separate(
    proposal: Proposal,
    predictions: Mapping[str, Prediction],
    sigma: float,
    special: Collection[tuple[str, str]] = (),
) -> Separation:
    """Return how well one recording would tell rivals apart.

    Parameters
    ----------
    proposal : Proposal
    predictions : mapping
        Rival -> what it expects, two rivals or more.
    sigma : float
        Noise to be expected, N, N mm or MPa.
    special : collection of (str, str)
        Pairs of which the first is a special case of the second, which can imitate it always: that they are told apart
        depends on the second's being right.
    """
    distances = {
        (a, b): distance(predictions[a], predictions[b], sigma)
        for a, b in permutations(predictions, 2)
        if (a, b) not in special
    }
    pair = min(distances, key=lambda key: (distances[key], key))
    return Separation(proposal, distances[pair], pair, distances)


def next_test(separations: Sequence[Separation]) -> Separation | None:
    """Return the cheapest recording that decides; the one nearest to it where none does; None where nothing differs."""
    deciding = [one for one in separations if one.decides]
    if deciding:
        return min(deciding, key=lambda one: (one.proposal.cost, -one.worst, one.proposal.name))
    seen = [one for one in separations if one.worst > 1.0]
    return max(seen, key=lambda one: (one.worst, -one.proposal.cost), default=None)
