"""From target rates to a design: bounded least squares, and what tolerances do to the answer.

The residuals are the relative deviations from the targets, or the deviations over those allowed; the unknowns are
scaled to their bounds. Starts beyond the first come from a Latin hypercube and are solved side by side.

References
----------
Branch, Coleman and Li (1999), SIAM J. Sci. Comput. 21:1-23, doi:10.1137/S1064827595289108 (bounded trust region).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.case.tolerance import Toleranced
from bushcli.errors import InputError, Problem
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import Condition
from bushcli.runtime.digits import with_digits
from bushcli.runtime.executor import Pool
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.study.rates import TargetRates, rates
from bushcli.study.target import Target
from bushcli.study.task import DesignCache, StudyTask
from bushcli.study.variable import SIGMAS, Variable
from cases.march import NotConverged
from cases.mode import modes
from geometry.errors import GeometryError

Array = NDArray[np.float64]

# Relative deviation within which a target counts as reached, unless the user allows another one.
REACHED = 1e-3
# Distance from a bound, as a share of the range, within which a value counts as at the bound; ratio of the smallest to
# the largest singular value of the scaled derivatives above which the keys count as determined.
AT_BOUND, DETERMINED = 1e-6, 1e-4
# Relative step of the scaled unknowns, and relative change of the cost, below which the search has converged.
XTOL, FTOL = 1e-8, 1e-10
MOST_EVALUATIONS = 60


@dataclass(frozen=True)
class Dimension:
    """A key of the design: its value, its bounds, and whether it is at one of them; in the unit of the key."""

    value: float
    lower: float
    upper: float
    start: float

    @property
    def at_bound(self) -> bool:
        """Whether the value is at a bound."""
        margin = AT_BOUND * (self.upper - self.lower)
        return self.value - self.lower <= margin or self.upper - self.value <= margin


@dataclass(frozen=True)
class Spread:
    """Effect of tolerances on a target, in the displayed unit.

    Attributes
    ----------
    contributions : mapping of str to float
        Change of the rate at the upper limit of each key's tolerance, to first order.
    worst : float
        Sum of their absolute values: to first order, no design within the tolerances deviates by more.
    std : float
        Standard deviation of the rate if the keys deviate independently and normally, with the limits of each
        tolerance three standard deviations away.
    share : float
        Share of designs within the allowed deviation; nan where none is given.
    """

    contributions: Mapping[str, float]
    worst: float
    std: float
    share: float


@dataclass(frozen=True)
class Reached:
    """A target and the value that the design reaches, in displayed units, with derivatives by key per its unit."""

    target: Target
    value: float
    slopes: Mapping[str, float]
    spread: Spread | None

    @property
    def target_value(self) -> float:
        """The target's value."""
        return self.target.value * self.target.per_shown

    @property
    def deviation(self) -> float:
        """Relative deviation, a share."""
        return self.value / self.target_value - 1.0

    @property
    def tolerance(self) -> float:
        """Relative deviation within which the target counts as reached, a share: 0.1 % unless the target has one."""
        given = self.target.deviation / self.target.value
        return REACHED if math.isnan(given) else given

    @property
    def is_met(self) -> bool:
        """Whether the design has the rate, within the allowed deviation."""
        return abs(self.deviation) <= self.tolerance


@dataclass(frozen=True)
class Design:
    """A design for target rates.

    Attributes
    ----------
    case : Case
        As in the case file.
    evaluations : int
        Number of designs that were simulated.
    """

    case: Case
    keys: Mapping[str, Dimension]
    targets: tuple[Reached, ...]
    evaluations: int
    converged: bool
    conditions: tuple[Condition, ...] = field(default_factory=tuple)


@dataclass(frozen=True)
class End:
    """End of a search: values, cost (sum of squared relative deviations), evaluations, whether it converged."""

    values: Array
    cost: float
    evaluations: int
    converged: bool


def search(
    cache: DesignCache, task: StudyTask, targets: Sequence[Target], start: Array, low: Array, high: Array
) -> End | str:
    """Search from one start, in any process; return the reason as text if the start cannot be simulated."""
    from scipy.optimize import least_squares

    scale = high - low
    wanted = np.array([target.value for target in targets])
    deviations = np.array([target.deviation for target in targets])
    allowed = np.where(np.isnan(deviations), wanted, deviations)
    evaluated: dict[bytes, TargetRates | None] = {}
    reason = ""

    def at(unit: Array) -> TargetRates | None:
        nonlocal reason
        if unit.tobytes() not in evaluated:
            values = [float(v) for v in low + unit * scale]
            try:
                evaluated[unit.tobytes()] = rates(cache, task, targets, values, task.keys)
            except (InputError, GeometryError, NotConverged, ValueError) as error:
                reason = str(error).splitlines()[0]
                evaluated[unit.tobytes()] = None
        return evaluated[unit.tobytes()]

    def residual(unit: Array) -> Array:
        reached = at(unit)
        # The search shortens a step to a design that cannot be simulated.
        return np.full(len(targets), np.inf) if reached is None else (reached.value - wanted) / allowed

    def slope(unit: Array) -> Array:
        reached = at(unit)
        assert reached is not None
        return reached.slope * scale / allowed[:, None]

    # The first unknowns must be strictly inside the bounds.
    unit = np.clip((start - low) / scale, 1e-3, 1.0 - 1e-3)
    if at(unit) is None:
        return reason
    solution = least_squares(
        residual, unit, slope, bounds=(0.0, 1.0), xtol=XTOL, ftol=FTOL, gtol=None, max_nfev=MOST_EVALUATIONS
    )
    values, cost = low + solution.x * scale, 2.0 * float(solution.cost)
    return End(values, cost, len(evaluated), bool(solution.status > 0))


def bounds_of(variables: Sequence[Variable]) -> tuple[Array, Array]:
    """Return the bounds of the keys, in their units.

    Raises
    ------
    InputError
        A key has no range.
    """
    for variable in variables:
        if variable.values or not variable.low < variable.high:
            where, what = f"--vary {variable.key}={variable.spec}", f"{variable.key} has no range to search"
            raise InputError(Problem(where, what, "", f"{variable.key}=LOW:HIGH"))
    low = np.array([variable.low for variable in variables])
    return low, np.array([variable.high for variable in variables])


def design(
    case: Case,
    task: StudyTask,
    variables: Sequence[Variable],
    targets: Sequence[Target],
    pool: Pool,
    *,
    start: Sequence[float],
    starts: int = 1,
    seed: int = 0,
    tolerances: Mapping[str, Toleranced] | None = None,
    notify: Callable[[int, int, int], None] | None = None,
    tables: TableCache | None = None,
) -> Design:
    """Find the design whose rates are nearest to the targets.

    Parameters
    ----------
    case : Case
        As in the case file.
    task : StudyTask
        Its keys are those of the variables.
    variables : sequence of Variable
        The keys that are searched, with bounds.
    targets : sequence of Target
    pool : Pool
        The processes that run the searches.
    start : sequence of float
        Where the first search begins, in the units of the keys.
    starts, seed : int
        Number of searches, and seed of the points at which the others begin.
    tolerances : mapping of str to Toleranced or None
        By key; the nominal value of a key that is searched is ignored.
    notify : callable or None
        Called with the numbers of finished searches, of all searches, and of failed ones.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    InputError
        A key has no range, or no search found a design that can be simulated.
    """
    for target in targets:
        # Without the unit a load would be searched as a travel.
        if not modes()[target.mode].rotational and abs(target.travel) > (case.geometry.overall or math.inf):
            overall = f"{case.geometry.overall:.4g} mm in all"
            what = f"asks for a travel of {target.travel:g} mm, and the bushing is {overall}"
            raise InputError(Problem(f"--target {target.name}", what, f"{target.name}N, if it is a load", ""))
    low, high = bounds_of(variables)
    points = [np.clip(start, low, high)]
    if starts > 1:
        from scipy.stats import qmc

        unit = qmc.LatinHypercube(len(low), rng=np.random.default_rng(seed)).random(starts - 1)
        points += list(low + unit * (high - low))
    cache = DesignCache(measured=RecordingCache(tables))
    ends: list[End] = []
    failed, reason = 0, ""
    questions = [(task, tuple(targets), point, low, high) for point in points]
    for _, end in pool.answers(search, questions, cache):
        if isinstance(end, End):
            ends.append(end)
        else:  # its start could not be simulated
            failed, reason = failed + 1, str(end)
        if notify is not None:
            notify(len(ends) + failed, len(points), failed)
    if not ends:
        what = f"no start could be simulated: {reason.rstrip('.')}"
        raise InputError(Problem("design", what, "", "try other bounds, or more --starts"))
    # Of equal costs the smallest values win: the result does not depend on the order in which searches end.
    best = min(ends, key=lambda end: (round(end.cost, 14), *end.values))
    return _result(
        cache, case, task, variables, targets, best, sum(e.evaluations for e in ends), start, tolerances or {}
    )


def _result(
    cache: DesignCache,
    case: Case,
    task: StudyTask,
    variables: Sequence[Variable],
    targets: Sequence[Target],
    end: End,
    evaluations: int,
    start: Sequence[float],
    tolerances: Mapping[str, Toleranced],
) -> Design:
    from scipy.special import ndtr

    values = [float(value) for value in end.values]
    others = {key: tolerance.nominal for key, tolerance in tolerances.items() if key not in task.keys}
    whole_task = replace(task, keys=(*task.keys, *others))
    target_rates = rates(cache, whole_task, targets, [*values, *others.values()], whole_task.keys)
    keys = {
        variable.key: Dimension(value, variable.low, variable.high, float(initial))
        for variable, value, initial in zip(variables, values, start, strict=True)
    }
    reached = []
    for i, target in enumerate(targets):
        by_key = zip(whole_task.keys, target_rates.slope[i], strict=True)
        slopes = {key: float(slope) * target.per_shown for key, slope in by_key}
        shown = float(target_rates.value[i]) * target.per_shown
        spread = None
        if tolerances:
            parts = {key: slopes[key] * tolerance.deviation for key, tolerance in tolerances.items()}
            std = math.sqrt(math.fsum((part / SIGMAS) ** 2 for part in parts.values()))
            share = math.nan
            if not math.isnan(target.deviation) and std > 0.0:
                wanted, allowed = target.value * target.per_shown, target.deviation * target.per_shown
                share = float(ndtr((wanted + allowed - shown) / std) - ndtr((wanted - allowed - shown) / std))
            spread = Spread(parts, math.fsum(map(abs, parts.values())), std, share)
        reached.append(Reached(target, shown, slopes, spread))
    ranges = np.array([variable.high - variable.low for variable in variables])
    scaled = target_rates.slope[:, : len(variables)] * ranges
    conditions = _conditions(keys, reached, scaled / target_rates.value[:, None], end.converged)
    if case.effects:
        names = " and ".join(effect.name for effect in case.effects)
        what = f"the rates are those without the effects of the case: {names}"
        remedy = (
            "compare the design with `bushcli direct`, and correct the targets by what the effects change"
        )
        conditions = (Condition("effect_left_out", what, remedy), *conditions)
    return Design(case, keys, tuple(reached), evaluations, end.converged, conditions)


def _conditions(
    keys: Mapping[str, Dimension], reached: Sequence[Reached], scaled: Array, converged: bool
) -> tuple[Condition, ...]:
    conditions = []
    missed = [rate for rate in reached if not rate.is_met]
    bound = [key for key, dimension in keys.items() if dimension.at_bound]
    if missed:
        names = ", ".join(
            f"{rate.target.name} by {'+' * (rate.deviation > 0.0)}{with_digits(off, -limit, limit)} %"
            for rate in missed
            for off, limit in [(100 * rate.deviation, 100 * rate.tolerance)]
        )
        remedy = "vary more keys, or use more --starts"
        remedy = f"widen the bounds of {', '.join(bound)}" if bound else remedy
        what = f"no design within the bounds reaches the targets: {names}"
        conditions.append(Condition("target_missed", what, remedy))
    if not converged:
        what = f"the search ended after {MOST_EVALUATIONS} designs"
        conditions.append(Condition("not_converged", what, "use more --starts"))
    singular = np.linalg.svd(scaled, compute_uv=False)
    rank = int(np.count_nonzero(singular > DETERMINED * singular[0]))
    if rank < len(keys) and not missed:
        what = f"{len(keys)} keys are searched, of which the targets determine {rank}: other designs meet the targets"
        conditions.append(Condition("underdetermined", what, "add a --target, or vary fewer keys"))
    return tuple(conditions)
