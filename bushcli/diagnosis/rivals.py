"""Which effects, alone or in pairs, explain the misfit best.

All on the linearised problem: a pair of effects costs no simulation beyond those of the two alone. A number of effects
is compared with another by the Bayesian information criterion.

References
----------
Kass and Raftery (1995), Bayes factors, J. Am. Stat. Assoc. 90:773-795, doi:10.1080/01621459.1995.10476572.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from bushcli.diagnosis.criterion import bic_change
from bushcli.diagnosis.linearised import Linearised, cone_fit
from bushcli.diagnosis.score import Candidate, untestable

# Difference of BIC from which on evidence is called strong (Kass and Raftery).
STRONG = 6.0
# Standard errors by which two explanations have to differ for one recording in a hundred to decide wrongly.
TOLD_APART = 4.65


@dataclass(frozen=True)
class Combination:
    """Effects that act together.

    Attributes
    ----------
    names : tuple of str
    points : tuple of int
        Point of each effect's grid.
    amplitude : tuple of mapping
        First-order estimates of each effect's amplitudes.
    drop : float
        Expected fall of the sum of squares, in units of the noise's variance.
    bic : float
        Expected change of BIC against none of them; the more negative, the better.
    """

    names: tuple[str, ...]
    points: tuple[int, ...]
    amplitude: tuple[Mapping[str, float], ...]
    drop: float
    bic: float


def combine(fit: Linearised, candidates: Sequence[Candidate]) -> tuple[Combination, ...]:
    """Return single effects and pairs of them, at the best points of their grids, by the expected change of BIC.

    All are tried at all points; a pair one of which takes no part at any is left out.

    Parameters
    ----------
    fit : Linearised
    candidates : sequence of Candidate
        Those that cannot be tested are left out.
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
        parts = [slice(a, b) for a, b in pairwise(ends)]
        return Combination(
            names=tuple(one.name for one, _ in members),
            points=tuple(i for _, i in members),
            amplitude=tuple(
                dict(zip(one.amplitudes, map(float, amplitude[part]), strict=True))
                for (one, _), part in zip(members, parts, strict=True)
            ),
            drop=drop,
            bic=bic_change(drop, unknowns, fit.samples),
        )

    singles = _best(joint(((one, i),)) for one, i in columns)
    pairs = _best(joint(pair) for pair in combinations(columns, 2) if pair[0][0] is not pair[1][0])
    return tuple(sorted(singles + pairs, key=lambda one: (one.bic, one.names)))


def _best(combined: Iterable[Combination]) -> list[Combination]:
    """Keep the best points of the grids of every set of effects in which all of them take part."""
    best: dict[frozenset[str], Combination] = {}
    for one in combined:
        # An effect whose amplitudes are all zero takes no part.
        takes_part = all(any(value != 0.0 for value in values.values()) for values in one.amplitude)
        key = frozenset(one.names)
        if takes_part and (key not in best or one.drop > best[key].drop):
            best[key] = one
    return list(best.values())
