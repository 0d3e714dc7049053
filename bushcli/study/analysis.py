"""Statistics of the designs: spread, worst cases, correlations, Sobol indices, the share within limits, and bands of
curves: quantiles of the force at the same displacements.

References
----------
Saltelli et al. (2010), Variance based sensitivity analysis of model output, Comput. Phys. Commun. 181:259-270,
doi:10.1016/j.cpc.2009.09.018.
Clopper and Pearson (1934), Biometrika 26:404-413, doi:10.1093/biomet/26.4.404.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.case.tolerance import DEFAULT, toleranced_number
from bushcli.errors import InputError, Problem
from bushcli.study.plan import Plan, problem
from bushcli.study.rows import Rows
from bushcli.study.task import DESIGN, KIND, REASON, STATUS
from bushcli.study.variable import Value

Array = NDArray[np.float64]

# Quantiles of the answers in the summary, and of a key for the change of an answer by that key alone.
QUANTILES = (0.05, 0.5, 0.95)
CONFIDENCE = 0.95
# Most curves that are read (evenly chosen), and number of points at which curves with different displacements are
# compared.
MOST_CURVES, POINTS = 2000, 61
LEVELS = (0.0, 0.05, 0.5, 0.95, 1.0)


@dataclass(frozen=True)
class Extreme:
    """A worst case: the design, its answer (in the answer's unit), and the values of the varied keys."""

    design: int
    value: float
    at: Mapping[str, Value]


@dataclass(frozen=True)
class Influence:
    """Influence of one key on one answer."""

    pearson: float  # correlation of values, from -1 to 1
    spearman: float  # and of ranks
    # Change of the answer from its mean, in its unit, when the key goes to its 5 % and to its 95 % quantile and the
    # others stay at their means, by the linear regression on all keys.
    swing: tuple[float, float]
    # Sobol indices, shares of the variance due to the key alone, and with its interactions; half widths of their 95 %
    # intervals. They are nan unless the sampling is Saltelli's.
    first: float = float("nan")
    total: float = float("nan")
    first_error: float = float("nan")
    total_error: float = float("nan")


@dataclass(frozen=True)
class Limits:
    """Limits of an answer, in its unit, and the share of the designs within them, with its 95 % interval."""

    low: float
    high: float
    share: float = float("nan")
    interval: tuple[float, float] = (float("nan"), float("nan"))


@dataclass(frozen=True)
class Summary:
    """One answer over all designs that have it.

    Attributes
    ----------
    mean, std, quantiles : float, float, tuple of float
        In the unit of the answer; quantiles at 5, 50 and 95 %.
    influences : mapping of str to Influence
        By key, for the varied keys whose values are numbers.
    linear : float
        Share of the variance that the linear regression on all keys explains.
    """

    count: int
    mean: float
    std: float
    quantiles: tuple[float, ...]
    lowest: Extreme
    highest: Extreme
    influences: Mapping[str, Influence]
    linear: float
    limits: Limits | None = None


@dataclass(frozen=True)
class Failure:
    """Designs that failed for the same reason: kind of failure, an example of the reason, count, first few designs."""

    kind: str
    reason: str
    count: int
    designs: tuple[int, ...]


@dataclass(frozen=True)
class Columns:
    """The scalar columns of a study, read from its rows.

    Attributes
    ----------
    design : shape (n,)
        Numbers of the designs.
    keys : mapping of str to list
        Values of the varied keys.
    answers : mapping of str to Array
        shape (n,); nan where a design has none.
    status : list of tuple
        Status, kind of the failure, reason.
    """

    design: NDArray[np.int64]
    keys: Mapping[str, Sequence[Value]]
    answers: Mapping[str, Array]
    status: Sequence[tuple[str, str, str]]


def columns(rows: Rows, keys: Sequence[str], answers: Sequence[str]) -> Columns:
    """Read the columns that the statistics need."""
    names = [DESIGN, STATUS, KIND, REASON, *keys, *answers]
    lists: dict[str, list[object]] = {name: [] for name in names}
    for table in rows.tables(names):
        for name in names:
            lists[name] += table[name].to_pylist()
    return Columns(
        np.array(lists[DESIGN], dtype=np.int64),
        {key: lists[key] for key in keys},  # type: ignore[misc]
        {name: np.array([np.nan if v is None else v for v in lists[name]], dtype=float) for name in answers},
        list(zip(lists[STATUS], lists[KIND], lists[REASON], strict=True)),  # type: ignore[arg-type]
    )


def failures(table: Columns) -> tuple[Failure, ...]:
    """Return the reasons of failures, the most frequent first; texts that differ only in numbers are one reason."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i, (status, kind, reason) in enumerate(table.status):
        if status != "ok":
            groups.setdefault((kind, re.sub(r"[-+]?\d[\d.e+-]*", "#", reason)), []).append(i)
    return tuple(
        Failure(kind, table.status[members[0]][2], len(members), tuple(map(int, table.design[members[:10]])))
        for (kind, _), members in sorted(groups.items(), key=lambda group: -len(group[1]))
    )


def summary(
    plan: Plan, table: Columns, name: str, limits: Limits | None = None, seed: int = 0
) -> Summary | None:
    """Return the statistics of one answer over the designs; None where fewer than two have it."""
    values = table.answers[name]
    has_answer = np.isfinite(values) & plan.is_independent[table.design]
    y = values[has_answer]
    if len(y) < 2:
        return None
    numbers = {
        variable.key: np.array(table.keys[variable.key], dtype=float)[has_answer]
        for variable in plan.variables
        if variable.is_numeric
    }
    moving = {key: x for key, x in numbers.items() if np.ptp(x) > 0.0}
    if len(y) <= len(moving):
        moving = {}  # too few designs to separate the influences of the keys
    indices = _sobol(plan, table, values, seed) if plan.sampling == "saltelli" else {}
    influences, linear = _influences(moving, y, indices)
    return Summary(
        count=int(np.count_nonzero(np.isfinite(values))),
        mean=float(y.mean()),
        std=float(y.std(ddof=1)),
        quantiles=tuple(float(q) for q in np.quantile(y, QUANTILES)),
        lowest=_extreme(table, values, int(np.nanargmin(values))),
        highest=_extreme(table, values, int(np.nanargmax(values))),
        influences=influences,
        linear=linear,
        limits=None if limits is None else limits_with_share(limits, y),
    )


def _extreme(table: Columns, values: Array, i: int) -> Extreme:
    at = {key: column[i] for key, column in table.keys.items()}
    return Extreme(int(table.design[i]), float(values[i]), at)


def _influences(
    x: Mapping[str, Array], y: Array, indices: Mapping[str, tuple[float, float, float, float]]
) -> tuple[dict[str, Influence], float]:
    """Return the influence of each key, and the share of the variance that a linear regression on all explains."""
    if not x:
        return {}, 0.0
    from scipy.stats import rankdata

    scales = {key: float(column.std()) for key, column in x.items()}
    matrix = np.column_stack(
        [np.ones(len(y)), *((column - column.mean()) / scales[key] for key, column in x.items())]
    )
    slopes, *_ = np.linalg.lstsq(matrix, y, rcond=None)
    spread = float(np.sum((y - y.mean()) ** 2))
    residual = float(np.sum((y - matrix @ slopes) ** 2))
    influences = {}
    for slope, (key, column) in zip(slopes[1:], x.items(), strict=True):
        low, high = np.quantile(column, (QUANTILES[0], QUANTILES[-1])) - column.mean()
        swing = (float(slope * low / scales[key]), float(slope * high / scales[key]))
        pearson = spearman = 0.0
        if np.ptp(y) > 0.0:
            pearson = float(np.corrcoef(column, y)[0, 1])
            spearman = float(np.corrcoef(rankdata(column), rankdata(y))[0, 1])
        influences[key] = Influence(pearson, spearman, swing, *indices.get(key, ()))
    return influences, 1.0 - residual / spread if spread > 0.0 else 0.0


def _sobol(
    plan: Plan, table: Columns, values: Array, seed: int
) -> dict[str, tuple[float, float, float, float]]:
    """Return the Sobol indices and their half widths by key; a block with a failed design is left out as a whole."""
    from SALib.analyze import sobol

    keys = len(plan.variables)
    answers = np.full(len(plan.rows), np.nan)
    answers[table.design] = values
    blocks = answers.reshape(-1, keys + 2)
    complete = blocks[np.isfinite(blocks).all(axis=1)]
    if len(complete) < 2 or np.ptp(complete) == 0.0:
        return {}
    with np.errstate(all="ignore"):
        indices = sobol.analyze(
            problem(keys), complete.ravel(), calc_second_order=False, conf_level=CONFIDENCE, seed=seed
        )
    return {
        key: tuple(float(indices[name][i]) for name in ("S1", "ST", "S1_conf", "ST_conf"))  # type: ignore[misc]
        for i, key in enumerate(plan.keys)
    }


def limits_with_share(limits: Limits, y: Array) -> Limits:
    """Return the limits with the share of the answers within them."""
    from scipy.special import betaincinv

    n = len(y)
    inside = int(np.count_nonzero((y >= limits.low) & (y <= limits.high)))
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = float(betaincinv(inside, n - inside + 1, tail)) if inside else 0.0
    high = float(betaincinv(inside + 1, n - inside, 1.0 - tail)) if inside < n else 1.0
    return Limits(limits.low, limits.high, inside / n, (low, high))


def limits_of(text: str, percent: float = DEFAULT.percent) -> tuple[str, Limits]:
    """Return answer and limits of ``ANSWER=LOW:HIGH``, ``ANSWER=VALUE +- DEVIATION`` (or percent), ``ANSWER=VALUE``.

    Parameters
    ----------
    text : str
    percent : float
        Deviation from a value that is given alone, %.

    Raises
    ------
    InputError
        The text has none of these forms.
    """
    name, equals, spec = text.rpartition("=")
    tolerance = toleranced_number(spec)
    if equals and name.strip() and tolerance is not None:
        return name.strip(), Limits(tolerance.low, tolerance.high)
    try:
        ends = [float(part) for part in spec.split(":")]
        width = 0.01 * percent * abs(ends[0])
        low, high = (ends[0] - width, ends[0] + width) if len(ends) == 1 else ends
    except ValueError:
        low = high = math.nan
    if not equals or not name.strip() or not low < high:
        expected = 'e.g. "axial.initial=350 +- 15 %" or axial.initial=300:400'
        raise InputError(Problem(f"--limits {text}", "has no limits", "", expected))
    return name.strip(), Limits(low, high)


@dataclass(frozen=True)
class Band:
    """Quantiles of the curves of a channel.

    Attributes
    ----------
    displacement : shape (n,)
        mm or degrees.
    force : shape (5, n)
        N or N mm: smallest, 5 %, 50 %, 95 %, largest.
    count : int
        Number of curves.
    """

    channel: str
    displacement: Array
    force: Array
    count: int


def band(rows: Rows, channel: str) -> Band | None:
    """Return the band of a channel; None where the curves share no range, or are loops of different programs."""
    names = [f"{channel}.displacement", f"{channel}.force"]
    stride = max(1, -(-rows.count // MOST_CURVES))
    pairs: list[tuple[Array, Array]] = []
    seen = 0
    for table in rows.tables(["status", *names]):
        status = table["status"].to_pylist()
        chosen = [i for i in range(len(status)) if status[i] == "ok" and (seen + i) % stride == 0]
        seen += len(status)
        if not chosen:
            continue  # Arrow cannot select rows by an empty list, which has no type
        for q, force in zip(*(table[name].take(chosen).to_pylist() for name in names), strict=True):
            if q and len(q) == len(force):
                pairs.append((np.array(q), np.array(force)))
    if len(pairs) < 2:
        return None
    reference = pairs[0][0]
    if all(len(q) == len(reference) and np.allclose(q, reference, rtol=1e-9, atol=1e-12) for q, _ in pairs):
        forces = np.quantile([force for _, force in pairs], LEVELS, axis=0)
        return Band(channel, reference, forces, len(pairs))
    # By growing displacement; a curve that turns has no band with others.
    curves = [(q, force) if q[-1] > q[0] else (q[::-1], force[::-1]) for q, force in pairs]
    if any((np.diff(q) <= 0).any() for q, _ in curves):
        return None
    low, high = max(q[0] for q, _ in curves), min(q[-1] for q, _ in curves)
    if not low < high:
        return None
    at = np.linspace(low, high, POINTS)
    forces = np.quantile([np.interp(at, q, force) for q, force in curves], LEVELS, axis=0)
    return Band(channel, at, forces, len(curves))
