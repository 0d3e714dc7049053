"""A search that continues past unsolvable parameters and unstable laws until it reaches a minimum.

Where a softening law is strained more than it can bear, the rubber at the corners of the bond gives way first:
at one Gauss point the tangent moduli lose their positive definiteness and the strain there doubles; soon after, the
march finds no equilibrium. At that wall there is no misfit to guide a search, but the law's stability in the states
that the rubber reaches can guide it. These states are therefore checked wherever a search ends or meets failures, not
only at its start; if the law is unstable in any of them, they are added to the problem, and the search continues.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.edge import minimise_at_edge
from bushcli.inverse.local import WALL, Ends, Loss, Minimum, minimise
from bushcli.inverse.problem import ACTIVE, LeastSquaresProblem
from bushcli.inverse.start_values import first_point

Array = NDArray[np.float64]


def search(
    problem: LeastSquaresProblem, start: Array, loss: Loss = "linear", ends: Ends | None = None
) -> Minimum:
    """Minimise the misfit from a start, within the bounds and where the law is stable in the states reached.

    Parameters
    ----------
    problem
        The least-squares problem, to which states are added.
    start : shape (parameters,)
        Must be solvable.
    loss
        As in `scipy.optimize.least_squares`.
    ends
        Called at each point of the search; returns why it ends there, or None.
    """
    iterations, point = 0, start
    evaluated: set[bytes] = set()

    def is_explained(x: Array) -> bool:
        # A point is checked once: its states do not change.
        new = x.tobytes() not in evaluated
        evaluated.add(x.tobytes())
        return new and watch(problem, x)

    for last in (*[False] * problem.stopping.rounds, True):
        states = len(problem.states)
        end = minimise(problem, point, loss, WALL, None if last else is_explained, ends)
        iterations, point = iterations + end.iterations, end.x
        if end.hopeless:
            return replace(end, start=start, iterations=iterations)
        if last or (len(problem.states) == states and not is_explained(point)):
            break
    if loss == "linear" and (end.rejected or end.at_edge):
        end = minimise_at_edge(problem, end)
    return replace(end, start=start, iterations=iterations)


def watch(problem: LeastSquaresProblem, x: Array) -> bool:
    """Whether the law is unstable in any state that the rubber reaches at `x`; if so, add the states to the problem."""
    states = problem.reached_stretches(x)
    if not is_unstable(problem, x, states):
        return False
    problem.watch(states, x)
    return True


def is_unstable(problem: LeastSquaresProblem, x: Array, states: Array) -> bool:
    """Whether the law is unstable, or nearly so, in any of the states, shape (n, 3)."""
    return bool(problem.instability(x, states).max(initial=0.0) > ACTIVE)


@dataclass(frozen=True)
class FirstSearch:
    """The first search of an identification, and where it began, shape (parameters,)."""

    minimum: Minimum
    initial: Array
    # Point that replaced a start which is unstable or could not be solved, before it was brought to scale.
    instead: Array | None
    # Principal stretches (n, 3) in which the law's stability was watched when the search began.
    states: Array


def first_minimum(
    problem: LeastSquaresProblem,
    start: Array,
    loss: Loss = "linear",
    searched: Callable[[LeastSquaresProblem, Array, Loss], Minimum] = search,
) -> FirstSearch | None:
    """Search from the start, or from the nearest point that can be solved; return None if there is none.

    This is the plain law's fit of `bushcli inverse` and of `bushcli diagnose`.

    Parameters
    ----------
    problem : LeastSquaresProblem
    start : shape (parameters,)
        Where the search begins.
    loss : Loss
        As in `scipy.optimize.least_squares`.
    searched : callable
        Search from a solvable point, shape (parameters,): `search`, or `bushcli.inverse.contained.from_contained`.
    """
    initial, instead = first_point(problem, start)
    if not np.isfinite(problem.residual(initial)).all():
        return None
    problem.watch(problem.reached_stretches(initial), initial)
    states = problem.states
    return FirstSearch(searched(problem, initial, loss), initial, instead, states)
