"""One search for a design, by bounded least squares.

References
----------
Branch, Coleman and Li (1999), SIAM J. Sci. Comput. 21:1-23, doi:10.1137/S1064827595289108 (bounded trust region).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError
from bushcli.study.rates import TargetRates, rates
from bushcli.study.target import Target
from bushcli.study.task import DesignCache, StudyTask
from cases.march import NotConverged
from geometry.errors import GeometryError

Array = NDArray[np.float64]

# Relative step of the scaled unknowns, and relative change of the cost, below which the search has converged.
XTOL, FTOL = 1e-8, 1e-10
MOST_EVALUATIONS = 60


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
    allowed = np.array(
        [target.value if math.isnan(target.deviation) else target.deviation for target in targets]
    )
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
    return End(
        low + solution.x * scale, 2.0 * float(solution.cost), len(evaluated), bool(solution.status > 0)
    )
