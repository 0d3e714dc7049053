"""Where the search for a model's parameters begins: what derivatives promise, checked against the law's own start.

A law that was fitted to recordings without an effect that they show has bent its shape towards it. It may stand at the
edge of stability then, where the bushing with the effect cannot be solved at all, or the search creeps along the edge.
The law's own start values, brought to scale, have no such past.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.begin import own_start, scaled
from bushcli.inverse.local import inside
from bushcli.inverse.problem import Problem

Array = NDArray[np.float64]


def begin(
    problem: Problem,
    start: Array,
    lower: Array,
    upper: Array,
    retreats: Sequence[Mapping[str, float]],
    is_enough: Callable[[Array], bool],
) -> Array | None:
    """Return the point at which a search had best begin; None where nothing can be solved.

    Parameters
    ----------
    problem
    start, lower, upper : shape (p,)
    retreats
        Values by parameters' names that stand in for the start's where it cannot be solved, in their order.
    is_enough
        Whether a point that can be solved is as good as was hoped for, so that no other one is looked at.
    """
    points = [inside(one, lower, upper) for one in (start, *(_moved(problem, start, r) for r in retreats))]
    first = next((x for x in points if _is_solved(problem, x)), None)
    if first is not None and is_enough(first):
        return first
    own = (inside(own_start(problem, x), lower, upper) for x in points)
    other = next((x for x in own if _is_solved(problem, x)), None)
    if other is None:
        return first
    other = scaled(problem, other, lower, upper)
    return other if first is None or problem.cost(other) < problem.cost(first) else first


def _moved(problem: Problem, start: Array, values: Mapping[str, float]) -> Array:
    return np.array([values.get(name, value) for name, value in zip(problem.names, start, strict=True)])


def _is_solved(problem: Problem, x: Array) -> bool:
    return bool(np.isfinite(problem.residual(x)).all())
