"""Begin a model from the optima of models that it contains: its effects, their branches and the law's terms in turn.

A search from one start may end where two branches share one relaxation time, or where one relaxes within a sampling
interval; the model then misfits more than a simpler one that it contains. Here the smallest model is fitted first. Each
addition is tried at all times, slips or gaps of its grid: with its amplitude at zero a single solution gives the
derivative by it. The addition with the largest first-order gain joins the model, at the size of the full step.

References
----------
Friedman and Stuetzle (1981), Projection pursuit regression, J. Am. Stat. Assoc. 76:817-823,
doi:10.1080/01621459.1981.10477729: terms are added one at a time, and all are refitted after each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.effect import EffectParameter
from bushcli.inverse.channel import ChannelForces
from bushcli.inverse.local import NOTHING, Loss, Minimum, full_step
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.task import Task
from bushcli.recording import Recording

Array = NDArray[np.float64]

# Shares of the full step to an addition's first size that are tried as long as the misfit falls (judgement: the first
# order overestimates what thins or saturates; each share costs one evaluation).
SHARES = (0.25, 0.0625, 0.015625)
# An addition predicted to remove less than this share of the misfit begins at its start value (judgement).
NEGLIGIBLE = 1e-4
# Duration of a table for its grid of times, in periods of its highest frequency: the longest times of its three highest
# decades; the shortest of the grid is that of a branch with its largest loss at the highest frequency.
IN_TABLE = 50.0
# Relative change of a cost by the march, where branches change places.
SAME = 1e-4
# Factor on the times of two branches that begin as one, up and down: half a decade apart each is its own (judgement).
APART = 3.0


@dataclass(frozen=True)
class ContainedPart:
    """An effect, one branch more of it, or one term more of the law: its identified parameters by name."""

    names: tuple[str, ...]
    # Values of its amplitudes with which it is absent.
    off: Mapping[str, float]
    # Values of its other parameters that are tried, the start value first.
    grid: Mapping[str, tuple[float, ...]]
    # The effect or law whose earlier branches or terms come first.
    after: str
    # The same parameters of the branch or term before it; empty for the first.
    earlier: Mapping[str, str]


def removable_parts(task: Task, recordings: Sequence[Recording]) -> list[ContainedPart]:
    """Return what can be taken out of a task's model, in the order in which it can be added again."""
    start = dict(zip(task.names, map(float, task.vectors()[0]), strict=True))
    times = [float(np.ptp(recording.time)) for recording in recordings if recording.time is not None]
    travels = [float(np.abs(recording.displacement).max()) for recording in recordings]
    shear = float(task.law.shear_modulus(**task.material.parameters))
    scales = {"duration": max(times, default=1.0), "amplitude": max(travels, default=1.0), "shear": shear}
    parts: list[ContainedPart] = []
    terms = [p.name for p in task.law.parameters if p.optional and p.name in start]
    for number in dict.fromkeys(name[-1] for name in terms):
        names = tuple(name for name in terms if name[-1] == number)
        absent = {name: 0.0 for name in names if name in task.law.linear}
        shape = {name: (start[name],) for name in names if name not in absent}
        earlier = {name: f"{name[:-1]}{int(number) - 1}" for name in names}
        parts.append(ContainedPart(names, absent, shape, "law", earlier))
    for active in task.effects:
        if active.effect.needs_temperature:
            # It shifts the branches, and changes nothing before they are there: it begins at its start values.
            continue
        free = {active.full_name(p): p for p in active.parameters if active.full_name(p) in start}
        shapes = [active.full_name(p) for p in active.parameters if p.off is None and not p.of_mesh]
        if shapes and not set(shapes) & set(free):
            # With all times held a spectrum is nearly linear in its moduli, which one search finds together.
            continue
        latest: dict[str, str] = {}
        branches: dict[str, dict[str, EffectParameter]] = {}
        for name, p in free.items():
            branches.setdefault(p.branch if p.optional and not p.variant else "", {})[name] = p
        for branch in branches.values():
            absent = {name: p.off for name, p in branch.items() if p.off is not None}
            grids = {n: _grid(p, scales, task.period(active)) for n, p in branch.items() if p.off is None}
            grid = {name: tuple(dict.fromkeys((start[name], *values))) for name, values in grids.items()}
            earlier = {name: latest[p.stem] for name, p in branch.items() if p.stem in latest}
            latest |= {p.stem: name for name, p in branch.items()}
            if absent:
                parts.append(ContainedPart(tuple(branch), absent, grid, active.name, earlier))
    return parts


def _grid(parameter: EffectParameter, scales: Mapping[str, float], period: float | None) -> list[float]:
    """Return the values that are tried of a parameter: of a time that tables resolve, theirs and slower ones."""
    usual = list(parameter.grid(scales))
    if parameter.in_tables is None or period is None:
        return usual
    fast = list(parameter.grid({**scales, "duration": IN_TABLE * period}))
    return [*fast, *(value for value in usual if value > max(fast, default=0.0))]


class Contained(LeastSquaresProblem):
    """A problem with some parameters held: its vectors have the others only, all solutions are those of the whole."""

    def __init__(self, whole: LeastSquaresProblem, point: Array, free: Sequence[str]) -> None:
        self.whole, self.at = whole, point.copy()
        self.free = np.array([name in free for name in whole.names])
        held = {n: float(v) for n, v, f in zip(whole.names, point, self.free, strict=True) if not f}
        names = [name for name in whole.names if name in free]
        bounds, fixed = whole.bounds.of(self.free), whole.fixed | held
        super().__init__(whole.channels, whole.law, names, fixed, bounds, whole.states)
        self.stopping, self.limits, self.evaluations = whole.stopping, whole.limits, whole.evaluations

    def all_of(self, x: Array) -> Array:
        """Return the parameters of the whole problem, shape (p,), for those that are free."""
        whole = self.at.copy()
        whole[self.free] = x
        return whole

    def answers(self, x: Array, iteration: int = 0) -> list[ChannelForces] | None:
        """Solved curves, with derivatives by all parameters of the whole problem."""
        return self.whole.answers(self.all_of(x), iteration)

    def forces(self, x: Array) -> list[tuple[Array, Array]] | None:
        """Force and derivatives by the free parameters at the samples of each channel."""
        forces = self.whole.forces(self.all_of(x))
        return None if forces is None else [(force, slope[:, self.free]) for force, slope in forces]

    def watch(self, states: Array, best: Array | None = None) -> None:
        """Also require the law's stability in further states, in the whole problem too."""
        self.whole.watch(states, None if best is None else self.all_of(best))
        self.states = self.whole.states


def from_contained(
    problem: LeastSquaresProblem, start: Array, loss: Loss = "linear", every: Sequence[ContainedPart] = ()
) -> Minimum:
    """Search from the smallest model on, one addition after the other."""
    x, remaining = _switch_off(problem, problem.bounds.inside(start), every), list(every)
    added: list[ContainedPart] = []
    free = [name for name in problem.names if not any(name in part.names for part in every)]
    amplitudes = {*problem.law.linear, *(name for part in every for name in part.off)}
    lowest = _search_free(problem, x, free, loss) if every else None
    while lowest is not None and remaining:
        next_parts = {part.after: part for part in reversed(remaining)}
        sizes = [name for name in free if name in amplitudes]
        trials = [(*_start_of_addition(problem, lowest.x, sizes, part), part) for part in next_parts.values()]
        gain, point, chosen = max(trials, key=lambda trial: trial[0])
        remaining.remove(chosen)
        added.append(chosen)
        free += chosen.names
        if point is not None and gain > NEGLIGIBLE * lowest.cost * len(problem.channels):
            starts = [_shorten(problem, lowest.x, point)]
        elif chosen.after == "law":
            # With its start exponent a further term gains nothing: it stays absent unless halves of the last one gain.
            starts = []
        else:
            # The derivative by a gap or a play vanishes where it is absent: it begins at its start value.
            starts = [np.where([name in chosen.names for name in problem.names], start, lowest.x)]
        if set(chosen.earlier) == set(chosen.names):
            starts.append(_split(problem, lowest.x, chosen))
        for begins_at in starts:
            lowest = _lower_minimum(problem, lowest, begins_at, free, loss)
    for i, part in enumerate(added if lowest is not None else ()):
        # A part took its place without those of other effects that came after it: it is tried again beside them.
        if lowest is None or all(later.after == part.after for later in added[i:]):
            continue
        x = _switch_off(problem, lowest.x, [part])
        _, point = _start_of_addition(problem, x, [name for name in free if name in amplitudes], part)
        if point is not None:
            lowest = _lower_minimum(problem, lowest, _shorten(problem, x, point), free, loss)
    if lowest is None or problem.cost(start) < lowest.cost:
        direct = search(problem, start, loss)
        lowest = direct if lowest is None or direct.cost < lowest.cost else lowest
    x = _number_branches(problem, every, start, lowest.x)
    return replace(lowest, start=start, x=x, cost=problem.cost(x))


def _switch_off(problem: LeastSquaresProblem, x: Array, parts: Sequence[ContainedPart]) -> Array:
    """Return a point, shape (p,), with the amplitudes of some parts off."""
    absent = {name: value for part in parts for name, value in part.off.items()}
    return np.array([absent.get(name, value) for name, value in zip(problem.names, x, strict=True)])


def _shorten(problem: LeastSquaresProblem, x: Array, point: Array) -> Array:
    """Return the point with the least misfit, shape (p,), on the way to one that was predicted."""
    best = point
    for share in SHARES:
        shorter = x + share * (point - x)
        costs = np.nan_to_num([problem.cost(best), problem.cost(shorter)], nan=np.inf)
        if costs[0] < costs[1]:
            break
        best = shorter
    return best


def _lower_minimum(
    problem: LeastSquaresProblem, lowest: Minimum, begins_at: Array, free: Sequence[str], loss: Loss
) -> Minimum:
    """Search from another point, shape (p,); return the lower of both minima."""
    further = _search_free(problem, begins_at, free, loss)
    if further is None or not further.cost < (1.0 - problem.stopping.tolerance) * lowest.cost:
        return lowest
    return replace(further, iterations=lowest.iterations + further.iterations)


def _search_free(problem: LeastSquaresProblem, x: Array, free: Sequence[str], loss: Loss) -> Minimum | None:
    """Search among the free parameters from a point, shape (p,); None where it cannot be solved."""
    x = np.where([name in free for name in problem.names], problem.bounds.inside(x), x)
    if not np.isfinite(problem.cost(x)):
        return None
    if not free:
        return Minimum(x, x, problem.cost(x), 0, True, "no parameter is free")
    part = Contained(problem, x, free)
    end = search(part, x[part.free], loss)
    return replace(end, start=x, x=part.all_of(end.x))


def _start_of_addition(
    problem: LeastSquaresProblem, x: Array, sizes: Sequence[str], part: ContainedPart
) -> tuple[float, Array | None]:
    """Return the largest fall of the sum of squares that an addition predicts, and where it would begin, shape (p,).

    Its amplitude and the `sizes` of what is in the model change together: the misfit is nearly linear in them. Its
    other parameters take the values of their grids in turn, each beside the best values of those before it.
    """
    index = {name: i for i, name in enumerate(problem.names)}

    def predicted_gain(shape: Mapping[str, float]) -> tuple[float, Array | None]:
        point = x.copy()
        point[[index[name] for name in shape]] = list(shape.values())
        held = Contained(problem, point, [*sizes, *part.off])
        value = held.residual(point[held.free])
        if not np.isfinite(value).all():
            return 0.0, None
        step, remaining = full_step(held, point[held.free])
        return float(value @ value) - remaining, held.all_of(point[held.free] + step)

    best = {name: values[0] for name, values in part.grid.items()}
    gain, point = predicted_gain(best)
    for name, values in part.grid.items():
        for value in values[1:]:
            shape = {**best, name: value}
            more, other = predicted_gain(shape)
            if more > gain:
                gain, point, best = more, other, shape
    return gain, point


def _split(problem: LeastSquaresProblem, x: Array, part: ContainedPart) -> Array:
    """Return a point, shape (p,), at which two neighbouring branches share an amplitude and have different times.

    Where two branches are equal no first derivative tells them apart: only a finite step shows that two fit better.
    """
    index = {name: i for i, name in enumerate(problem.names)}
    point = x.copy()
    for name, before in part.earlier.items():
        point[[index[before], index[name]]] = x[index[before]] * (0.5 if name in part.off else 1.0)
    equal, _ = problem.stiffness_shares(point)
    for name, before in part.earlier.items():
        point[[index[before], index[name]]] *= (1.0, 1.0) if name in part.off else (APART, 1.0 / APART)
    apart, _ = problem.stiffness_shares(point)
    # Terms of the law halve its stiffness, not the modulus.
    ratio = np.divide(equal, apart, out=np.ones(len(x)), where=apart != 0.0)
    return problem.bounds.inside(point * ratio)


def _number_branches(
    problem: LeastSquaresProblem, every: Sequence[ContainedPart], start: Array, x: Array
) -> Array:
    """Return the parameters, shape (p,), with equal branches numbered in the order of their start values.

    A branch that alone has a spectrum is not equal to the others: where the misfit depends on the order it stays.
    """
    index = {name: i for i, name in enumerate(problem.names)}
    absent = {name for part in every for name in part.off}
    # Of each effect the columns of its branches: numbers of the same parameter, the first branch's first.
    columns: dict[str, dict[str, list[int]]] = {}
    for part in every:
        for name, before in part.earlier.items() if set(part.earlier) == set(part.names) else ():
            indices = columns.setdefault(part.after, {})
            indices[name] = [*indices.pop(before, [index[before]]), index[name]]
    ordered = x.copy()
    for of_effect in columns.values():
        times = next((places for name, places in of_effect.items() if name not in absent), None)
        if times is not None:
            order = np.argsort(x[times])[np.argsort(np.argsort(start[times], kind="stable"))]
            for places in of_effect.values():
                ordered[places] = x[[places[i] for i in order]]
    if np.array_equal(ordered, x):
        return x
    return ordered if problem.cost(ordered) <= (1.0 + SAME) * problem.cost(x) + SAME * NOTHING else x
