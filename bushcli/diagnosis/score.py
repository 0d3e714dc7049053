"""Score test of an effect at its off value: what it would bring, from derivatives alone, without a refit.

With r the weighted misfit at the minimum, J its derivatives by the fitted parameters and g that by an effect's
amplitude, let g' be the part of g that J cannot make. The misfit falls by (g'.r)^2 / g'.g' when the amplitude and all
parameters are refitted, to first order, and by noise alone this is chi square of one degree of freedom (Rao). Where
the amplitude cannot be negative, neither can be what counts. An effect of several amplitudes takes several columns at
once. Shape parameters have no meaning at the off value: the largest fall over their grid counts, and its probability
is that of the largest of several correlated variables.

That every effect is significant beside the noise does not mean much while something large is missing: whatever
resembles it a little is. `p_misfit` takes the misfit that is left, with its own size and memory, for noise; it names
what stands out among all that is wrong.

References
----------
Rao (1948), Large sample tests of statistical hypotheses concerning several parameters, Proc. Camb. Philos. Soc.
44:50-57, doi:10.1017/S0305004100023987.
Silvapulle and Silvapulle (1995), A score test against one-sided alternatives, J. Am. Stat. Assoc. 90:342-349,
doi:10.1080/01621459.1995.10476518.
Davies (1987), Hypothesis testing when a nuisance parameter is present only under the alternative, Biometrika
74:33-43, doi:10.1093/biomet/74.1.33.
Worsley (1982), An improved Bonferroni inequality and applications, Biometrika 69:297-302,
doi:10.1093/biomet/69.2.297.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.special import owens_t
from scipy.stats import chi2, f, norm

from bushcli.active import identity
from bushcli.diagnosis.linearised import OWN, Linearised, cone_fit
from bushcli.effect import effect_name, effects

Array = NDArray[np.float64]

# An amplitude of usual size that changes the curves by less than one standard error cannot be seen, unless the misfit
# asks for a larger one by such a fall of the sum of squares, and that is no more than so many times the usual.
_SEEN, _ASKED, _UNUSUAL = 1.0, 10.0, 100.0
# Share of its change that has to be its own then: far from its usual size, first order says nothing of a sliver.
_SLIVER = 0.1


@dataclass(frozen=True)
class Candidate:
    """An effect to be tested.

    Attributes
    ----------
    name : str
    amplitudes : tuple of str
        Their names, k of them.
    columns : tuple of (n, k) array
        For each point of the grid, the weighted derivative of all channels' force by each amplitude (see `weighed`).
        Where it vanishes at the off value by symmetry (a misalignment to either side is the same), the change of the
        force over a typical amplitude, divided by that, serves as well.
    points : tuple of mapping
        Shape parameters at each point of the grid; one empty mapping where there are none.
    signs : tuple of {1, 0, -1}
        1 for an amplitude that cannot be less than its off value, 0 for one that can be either.
    typical : tuple of tuple of float, optional
        For each point of the grid, an ordinary size of each amplitude's difference from its off value: what is usual
        for a stop goes by the channels that have it.
    said : tuple of str, optional
        The same in words.
    sizes : tuple of float or None, optional
        For each point of the grid, the first amplitude's finite size over which the change was taken.
    untestable : str
        Why it cannot be tested at all, such as a recording without time; no columns are needed then.
    channels : tuple, optional
        For each point of the grid, names of the channels that have the effect there, None where all have it.
    """

    name: str
    amplitudes: tuple[str, ...]
    columns: tuple[Array, ...]
    points: tuple[Mapping[str, float], ...]
    signs: tuple[int, ...]
    typical: tuple[tuple[float, ...], ...] | None = None
    said: tuple[str, ...] | None = None
    sizes: tuple[float | None, ...] | None = None
    untestable: str = ""
    channels: tuple[tuple[str, ...] | None, ...] | None = None

    def channels_at(self, point: int) -> tuple[str, ...] | None:
        """Names of the channels that have the effect at a point of the grid; None where all have it."""
        return None if self.channels is None else self.channels[point]

    def identity(self, point: int) -> str:
        """Name of the effect at a point of the grid that does not depend on what else there is."""
        return identity(effects()[effect_name(self.name)], self.channels_at(point))

    @property
    def unknowns(self) -> int:
        """Number of amplitudes and shape parameters."""
        return len(self.amplitudes) + (len(self.points[0]) if self.points else 0)


@dataclass(frozen=True)
class Score:
    """What the score test says about an effect.

    Attributes
    ----------
    name : str
    testable : bool
    reason : str
        Why it cannot be tested; empty when it can.
    point : int
        The point of the grid with the largest fall.
    shape : mapping
        Shape parameters there.
    amplitude : mapping
        First-order estimate of each amplitude's difference from its off value.
    drop : float
        Expected fall of the sum of squares, in units of the noise's variance.
    z : float
        Root of the fall with the sign of the amplitude (of several amplitudes: positive); negative too where the
        misfit asks for a sign that the amplitude cannot have, and the fall is zero.
    p : float
        Probability of such a fall, anywhere on the grid, by noise alone; an upper bound.
    p_misfit : float
        The same with the misfit that is left for noise.
    drops : (points,) array
        The fall at every point of the grid.
    hidden : float
        Size of the first amplitude that stands out by 3 standard errors, over what is usual of it, at the point of the
        grid where that is largest.
    channels : tuple of str, optional
        Names of the channels that have the effect at the point; None where all have it.
    """

    name: str
    testable: bool
    reason: str
    point: int
    shape: Mapping[str, float]
    amplitude: Mapping[str, float]
    drop: float
    z: float
    p: float
    p_misfit: float
    drops: Array
    hidden: float
    channels: tuple[str, ...] | None = None


def score(fit: Linearised, candidate: Candidate) -> Score:
    """Test an effect.

    Parameters
    ----------
    fit : Linearised
    candidate : Candidate

    Returns
    -------
    Score
        Not testable where the recordings do not respond to the effect, or the fitted parameters respond for it.
    """
    reason = candidate.untestable or untestable(fit, candidate)
    if reason:
        return _untested(candidate, reason)
    rest, one = fit.rest, len(candidate.amplitudes) == 1
    own = [fit.left(columns) for columns in candidate.columns]
    fits = [cone_fit(g.T @ g, -(g.T @ rest), candidate.signs) for g in own]
    drops = np.array([drop for _, drop in fits])
    # Where no amplitude of the right sign helps, the point that asks most for the wrong one is shown.
    point = int(np.argmax(drops if drops.any() else [float(np.abs(_unsigned(g, rest)).max()) for g in own]))
    amplitude, drop = fits[point]
    g = own[point]
    after = rest + g @ amplitude
    wanted = float(_unsigned(g, rest)[0])
    p, p_misfit = (
        _probability(own, drop / size, candidate.signs, fit.freedom) for size in (1.0, fit.inflation(after))
    )
    return Score(
        name=candidate.name,
        testable=True,
        reason="",
        point=point,
        shape=candidate.points[point],
        amplitude=dict(zip(candidate.amplitudes, map(float, amplitude), strict=True)),
        drop=drop,
        z=float(np.sign(amplitude[0]) * np.sqrt(drop))
        if one and drop > 0
        else (wanted if one else drop**0.5),
        p=p,
        p_misfit=p_misfit,
        drops=drops,
        hidden=float(
            3.0 * max(_std(g)[0] / usual[0] for g, usual in zip(own, _usual(candidate), strict=True))
        ),
        channels=candidate.channels_at(point),
    )


def screen(fit: Linearised, candidates: Sequence[Candidate]) -> tuple[Score, ...]:
    """Test effects, the largest fall first; those that cannot be tested last."""
    scores = [score(fit, candidate) for candidate in candidates]
    return tuple(sorted(scores, key=lambda one: (not one.testable, -one.drop, one.name)))


def untestable(fit: Linearised, candidate: Candidate) -> str:
    """Return why an effect cannot be tested with these recordings; empty when it can."""
    typical = _usual(candidate)
    sizes = [
        (np.linalg.norm(c * usual, axis=0).max(), np.linalg.norm(fit.left(c) * usual, axis=0).max())
        for c, usual in zip(candidate.columns, typical, strict=True)
    ]
    whole, own = (float(max(part)) for part in zip(*sizes, strict=True))
    if whole == 0.0:
        return "these recordings do not respond to it"
    size = _size(candidate, typical, int(np.argmax([part for _, part in sizes])))
    if own < OWN * whole:
        return "all that it would change, the fitted parameters can change as well"
    if (
        candidate.typical is None
        or own >= _SEEN
        or (own > _SLIVER * whole and _asked(fit, candidate, typical))
    ):
        return ""
    if whole < _SEEN:
        return f"{size} would change these recordings by {whole:.1g} standard errors only"
    taken = 100 * (1.0 - (own / whole) ** 2)
    return f"the fitted parameters can imitate it ({taken:.3g} %); what is left of {size} is {own:.1g} standard errors"


def _asked(fit: Linearised, candidate: Candidate, typical: Array) -> bool:
    """Whether the misfit asks for an effect that is larger than usual, but not beyond reason."""
    for columns, usual in zip(candidate.columns, typical, strict=True):
        g = fit.left(columns)
        amplitude, drop = cone_fit(g.T @ g, -(g.T @ fit.rest), candidate.signs)
        if drop > _ASKED and bool(np.all(np.abs(amplitude) <= _UNUSUAL * usual)):
            return True
    return False


def _usual(candidate: Candidate) -> Array:
    """Typical amplitudes at every point of the grid, shape (points, k); ones where they are not known."""
    if candidate.typical is None:
        return np.ones((len(candidate.columns), len(candidate.amplitudes)))
    return np.abs(np.asarray(candidate.typical, dtype=float))


def _size(candidate: Candidate, typical: Array, point: int) -> str:
    """A typical amplitude in words."""
    if candidate.said is not None:
        return candidate.said[point]
    values = zip(candidate.amplitudes, typical[point], strict=True)
    return ", ".join(f"{name} = {value:.3g}" for name, value in values)


def largest_of_normals(z: float, correlation: Array, two_sided: bool) -> float:
    """Upper bound of the probability that one of several standard normal variables exceeds z > 0.

    Those of neighbouring points of a grid hardly differ. Worsley's inequality takes off what the pairs of a tree have
    in common; on a fine grid of one parameter it is Davies's bound.

    Parameters
    ----------
    z : float
    correlation : (points, points) array
    two_sided : bool
        Whether the sizes of the variables count.
    """
    r = np.clip(np.abs(correlation) if two_sided else correlation, -1.0, 1.0)
    # Of two variables with correlation r, P(one of them > z) = P(first > z) + 2 T(z, a), T Owen's function.
    apart = 2.0 * owens_t(z, np.sqrt((1.0 - r) / np.maximum(1.0 + r, 1e-12)))
    # An entry of zero would be no edge.
    tree = float(minimum_spanning_tree(np.maximum(apart, 1e-300)).sum())
    tail = float(norm.sf(z)) + tree
    return min(1.0, 2.0 * tail if two_sided else tail)


def _probability(own: Sequence[Array], drop: float, signs: Sequence[int], freedom: float) -> float:
    """Probability of a fall of that size anywhere on the grid; that the noise is estimated is allowed for."""
    if drop <= 0.0:
        return 1.0
    k = len(signs)
    if np.isfinite(freedom):
        drop = float(chi2.isf(f.sf(drop / k, k, freedom), k))
    if k == 1:
        columns = np.column_stack([g[:, 0] for g in own])
        size = np.linalg.norm(columns, axis=0)
        unit = columns[:, size > 0] / size[size > 0]
        return largest_of_normals(float(np.sqrt(drop)), unit.T @ unit, signs[0] == 0)
    single = float(chi2.sf(drop, k))
    if any(signs):
        # Perlman (1969), doi:10.1214/aoms/1177697723: the largest tail that any cone has.
        single = 0.5 * (single + float(chi2.sf(drop, k - 1)))
    return min(1.0, len(own) * single)


def _unsigned(g: Array, rest: Array) -> Array:
    """What the misfit asks of each amplitude alone, in standard errors, whatever its sign."""
    size = np.linalg.norm(g, axis=0)
    return np.asarray(-(g.T @ rest) / np.where(size > 0, size, 1.0))


def _std(g: Array) -> Array:
    """Standard error of each amplitude, by noise; inf for one that those before it can stand for."""
    std = np.full(g.shape[1], np.inf)
    kept: list[int] = []
    for i in range(g.shape[1]):
        trial = g[:, [*kept, i]] / np.maximum(np.linalg.norm(g[:, [*kept, i]], axis=0), 1e-300)
        if np.linalg.svd(trial, compute_uv=False)[-1] >= OWN:
            kept.append(i)
    if kept:
        std[kept] = np.sqrt(np.diag(np.linalg.inv(g[:, kept].T @ g[:, kept])))
    return std


def _untested(candidate: Candidate, reason: str) -> Score:
    nothing = dict.fromkeys(candidate.amplitudes, float("nan"))
    return Score(
        name=candidate.name,
        testable=False,
        reason=reason,
        point=0,
        shape={},
        amplitude=nothing,
        drop=0.0,
        z=float("nan"),
        p=1.0,
        p_misfit=1.0,
        drops=np.zeros(len(candidate.columns)),
        hidden=float("nan"),
    )
