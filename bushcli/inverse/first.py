"""The first search of an identification, which is also the fit of the plain law in a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.begin import first_point
from bushcli.inverse.local import Loss, Minimum
from bushcli.inverse.problem import LeastSquaresProblem
from bushcli.inverse.search import search

Array = NDArray[np.float64]


@dataclass(frozen=True)
class First:
    """The first search of an identification.

    Attributes
    ----------
    minimum : Minimum
    initial : shape (parameters,)
        Where the search began.
    instead : shape (parameters,) or None
        Point that replaced a start which is unstable or could not be solved, before it was brought to scale.
    states : shape (n, 3)
        Principal stretches in which the law's stability was watched when the search began.
    """

    minimum: Minimum
    initial: Array
    instead: Array | None
    states: Array


def first_minimum(
    problem: LeastSquaresProblem,
    start: Array,
    loss: Loss = "linear",
) -> First | None:
    """Search from the start, or from the nearest point that can be solved; return None if there is none.

    This is the plain law's fit of `bushcli inverse` and of `bushcli diagnose`.

    Parameters
    ----------
    problem : LeastSquaresProblem
        The least-squares problem.
    start : Array
        Where the search begins, shape (parameters,), in the units of the law.
    loss : Loss
        Loss function, as in `scipy.optimize.least_squares`.
    """
    initial, instead = first_point(problem, start)
    if not np.isfinite(problem.residual(initial)).all():
        return None
    problem.watch(problem.reached(initial), initial)
    states = problem.states
    return First(search(problem, initial, loss), initial, instead, states)
