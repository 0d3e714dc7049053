"""Which effects these recordings cannot tell apart, and which combinations of effects explain the misfit best.

All on the linearised problem: a pair of effects costs no simulation beyond those of the two alone. A number of effects
is compared with another by the Bayesian information criterion.

References
----------
Chen, Billings and Luo (1989), Orthogonal least squares methods and their application to non-linear system
identification, Int. J. Control 50:1873-1896, doi:10.1080/00207178908953472 (forward selection).
Björck and Golub (1973), Numerical methods for computing angles between linear subspaces, Math. Comput. 27:579-594,
doi:10.1090/S0025-5718-1973-0348991-3 (principal angles).
Kass and Raftery (1995), Bayes factors, J. Am. Stat. Assoc. 90:773-795, doi:10.1080/01621459.1995.10476572.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import subspace_angles

from bushcli.diagnosis.criterion import bic_change
from bushcli.diagnosis.linearised import OWN, Linearised, cone_fit
from bushcli.diagnosis.score import Candidate, Score, untestable

Array = NDArray[np.float64]

# Difference of BIC from which on evidence is called strong (Kass and Raftery).
STRONG = 6.0
# Standard errors by which two explanations have to differ for one recording in a hundred to decide wrongly.
TOLD_APART = 4.65


@dataclass(frozen=True)
class Pairing:
    """How alike two effects are in these recordings, beside the fitted parameters.

    Attributes
    ----------
    first, second : str
    cosine : float
        Of the smallest principal angle between what is their own, each at the best point of its grid; 1 = collinear.
    separation : float
        What the first effect, of the size estimated, does that the second and the fitted parameters cannot imitate
        wherever on its grid; in standard errors.
    """

    first: str
    second: str
    cosine: float
    separation: float

    @property
    def told_apart(self) -> bool:
        """Whether the recordings hold the difference."""
        return self.separation >= TOLD_APART


@dataclass(frozen=True)
class Combination:
    """Effects that act together.

    Attributes
    ----------
    names : tuple of str
    points : tuple of int
        Point of each effect's grid.
    amplitude, std : tuple of mapping
        First-order estimates of each effect's amplitudes, and their standard errors by noise.
    drop : float
        Expected fall of the sum of squares, in units of the noise's variance.
    bic : float
        Expected change of BIC against none of them; the more negative, the better.
    """

    names: tuple[str, ...]
    points: tuple[int, ...]
    amplitude: tuple[Mapping[str, float], ...]
    std: tuple[Mapping[str, float], ...]
    drop: float
    bic: float


def pairings(
    fit: Linearised, candidates: Sequence[Candidate], scores: Sequence[Score]
) -> tuple[Pairing, ...]:
    """Return how alike testable effects are, for every ordered pair of them."""
    by_name = {one.name: one for one in scores}
    tested = [one for one in candidates if by_name[one.name].testable]
    own = {one.name: [fit.left(column) for column in one.columns] for one in tested}
    found = []
    for first in tested:
        best = by_name[first.name]
        g = own[first.name][best.point]
        change = g @ np.array([best.amplitude[name] for name in first.amplitudes])
        for second in tested:
            if second is first:
                continue
            h = own[second.name][by_name[second.name].point]
            imitated = max(cone_fit(c.T @ c, c.T @ change, second.signs)[1] for c in own[second.name])
            found.append(
                Pairing(
                    first.name,
                    second.name,
                    cosine=float(np.cos(subspace_angles(g, h)).max()),
                    separation=float(np.sqrt(max(float(change @ change) - imitated, 0.0))),
                )
            )
    return tuple(found)


def rival_sets(combined: Sequence[Combination], margin: float = STRONG) -> tuple[tuple[str, ...], ...]:
    """Return the sets of effects that explain the misfit nearly as well as the best, the best first.

    A set that only adds to another one of them is no rival of it.

    Parameters
    ----------
    combined : sequence of Combination
        As of `forward`.
    margin : float
        Difference of BIC.
    """
    near = [one for one in combined if one.bic <= combined[0].bic + margin]
    names = [one.names for one in sorted(near, key=lambda one: one.bic)]
    return tuple(one for one in names if not any(set(other) < set(one) for other in names))


def forward(
    fit: Linearised, candidates: Sequence[Candidate], most: int = 2, width: int = 6, inflation: float = 1.0
) -> tuple[Combination, ...]:
    """Return the best combinations of up to `most` effects, by the expected change of BIC.

    All single effects and all pairs are tried, at all points of their grids; from three effects on, the best `width`
    combinations are each extended by every further effect.

    Parameters
    ----------
    fit : Linearised
    candidates : sequence of Candidate
        Those that cannot be tested are left out.
    most, width : int
    inflation : float
        Variance of the misfit over that of noise that no candidate is expected to explain, see `criterion.inflation`.
    """
    tested = [one for one in candidates if not (one.untestable or untestable(fit, one))]
    columns = [(one, i) for one in tested for i in range(len(one.columns))]
    own = [fit.left(one.columns[i]) for one, i in columns]
    cuts = np.cumsum([0, *(g.shape[1] for g in own)])
    stacked = np.column_stack(own) if own else np.zeros((len(fit.rest), 0))
    gram, wanted = stacked.T @ stacked, -(stacked.T @ fit.rest)
    places = {
        (one.name, i): np.arange(a, b) for (one, i), a, b in zip(columns, cuts[:-1], cuts[1:], strict=True)
    }

    def joint(members: tuple[tuple[Candidate, int], ...]) -> Combination:
        where = np.concatenate([places[one.name, i] for one, i in members])
        signs = [sign for one, _ in members for sign in one.signs]
        block = gram[np.ix_(where, where)]
        amplitude, drop = cone_fit(block, wanted[where], signs)
        unknowns = sum(one.unknowns for one, _ in members)
        ends = np.cumsum([0, *(len(one.amplitudes) for one, _ in members)])
        std = _std(block)
        parts = [slice(a, b) for a, b in pairwise(ends)]
        return Combination(
            names=tuple(one.name for one, _ in members),
            points=tuple(i for _, i in members),
            amplitude=tuple(
                dict(zip(one.amplitudes, map(float, amplitude[part]), strict=True))
                for (one, _), part in zip(members, parts, strict=True)
            ),
            std=tuple(
                dict(zip(one.amplitudes, map(float, std[part]), strict=True))
                for (one, _), part in zip(members, parts, strict=True)
            ),
            drop=drop,
            bic=bic_change(drop / inflation, unknowns, fit.samples),
        )

    singles = _best(joint(((one, i),)) for one, i in columns)
    found = list(singles)
    if most >= 2:
        pairs = (((a, i), (b, j)) for (a, i), (b, j) in combinations(columns, 2) if a is not b)
        level = _best(joint(pair) for pair in pairs)
        found += level
        by_name = {one.name: one for one in tested}
        for _ in range(most - 2):
            extended = (
                joint((*_members(known, by_name), (one, i)))
                for known in level[:width]
                for one, i in columns
                if one.name not in known.names
            )
            level = _best(extended)
            found += level
    return tuple(sorted(found, key=lambda one: (one.bic, one.names)))


def _members(known: Combination, by_name: Mapping[str, Candidate]) -> tuple[tuple[Candidate, int], ...]:
    return tuple((by_name[name], i) for name, i in zip(known.names, known.points, strict=True))


def _best(combined: Iterable[Combination]) -> list[Combination]:
    """Keep the best points of the grids of every set of effects in which all of them take part, the best set first."""
    best: dict[frozenset[str], Combination] = {}
    for one in combined:
        # An effect whose amplitudes are all zero takes no part.
        takes_part = all(any(value != 0.0 for value in values.values()) for values in one.amplitude)
        key = frozenset(one.names)
        if takes_part and (key not in best or one.drop > best[key].drop):
            best[key] = one
    return sorted(best.values(), key=lambda one: (one.bic, one.names))


def _std(block: Array) -> Array:
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    unit = block / np.outer(scale, scale)
    if np.linalg.eigvalsh(unit)[0] < OWN**2:
        return np.full(len(block), np.inf)
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(unit))) / scale)
