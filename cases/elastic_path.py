"""Derivatives along a path by the amplitudes of branches that are off.

Rubber whose branches are all off is elastic, so that its states along any path are those of one curve over the range of
the path. A branch remembers these states whether it is off or on, and the derivative of the force by its amplitude is
the work of its stress, per unit of the amplitude, on dx/dq: nothing is solved along the path. States and dx/dq are
interpolated from those of the curve by cubic Hermite polynomials in q.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.history import History
from cases.model import FiniteElementModel
from cases.parameters import Numbers
from cases.program import Program
from cases.ranks import sum_over_ranks
from cases.simulate import even_targets, sweep
from cases.slopes import Slopes

Array = NDArray[np.float64]


def acts_through_branches_off(model: FiniteElementModel, names: Sequence[str]) -> bool:
    """Whether the model is elastic because its branches are off, and parameters act through these alone.

    Parameters
    ----------
    model : FiniteElementModel
    names : sequence of str
        Parameters; none are of no use here.
    """
    if model.internal is None or model.has_assembly or not names:
        return False
    model.take_parameters()
    if not all(name in model.constants for name in names) or not all(
        branch.is_off for branch in model.body.material.branches if branch.clock != "shown"
    ):
        return False
    return not any(
        change.law.any() or change.volumetric.any() or any(metal.any() for metal in change.metals)
        for change in map(model.parameters.rates, names)
    )


def along_elastic_path(
    model: FiniteElementModel,
    program: Program,
    steps: int,
    *,
    tolerance: float,
    sensitivity: Sequence[str],
    failure_limit: int | None = None,
) -> History:
    """Follow a program with branches that are off, as `cases.march.march` does.

    Parameters
    ----------
    model : FiniteElementModel
        One for which `acts_through_branches_off`.
    program : Program
        Targets in mm or rad, at one temperature.
    steps : int
        Of the elastic curve, on the longer side of its range.
    tolerance
        Of an equilibrium, a ratio, as in `cases.march.march`.
    sensitivity, failure_limit
        As there.

    Raises
    ------
    NotConverged
        As there, with the curve so far.
    """
    q = program.displacement
    curve = _elastic_curve(model, q, steps, tolerance, failure_limit)
    changes = [model.parameters.rates(name) for name in sensitivity]
    durations = np.zeros(len(q)) if program.time is None else np.diff(program.time, prepend=program.time[0])
    assert model.internal is not None
    model.internal.reset()
    slopes = []
    for at, duration in zip(q, durations, strict=True):
        model.duration.value = duration
        model.put(curve.state(at))
        model.take_parameters()
        slopes.append(_works(model, sensitivity, changes, curve.rate(at)))
        model.commit()
    slope = np.array(slopes) * model.multiplicity
    return History(
        displacement=q,
        force=np.interp(q, curve.history.displacement, curve.history.force),
        time=program.time,
        energy=np.interp(q, curve.history.displacement, curve.history.energy),
        newton=np.zeros(len(q), dtype=np.int64),
        attempts=curve.history.attempts,
        sensitivity=slope,
        path_sensitivity=np.zeros_like(slope),
    )


@dataclass(frozen=True)
class _ElasticCurve:
    """Curve of a model whose branches are off, and its unknowns and their derivatives by q, as functions of q."""

    history: History
    state: Callable[[float], Array]
    rate: Callable[[float], Array]


def _elastic_curve(
    model: FiniteElementModel, q: Array, steps: int, tolerance: float, failure_limit: int | None
) -> _ElasticCurve:
    """Return the curve over the range of a path (n,), or the last one if only parameters of branches have changed."""
    from scipy.interpolate import CubicHermiteSpline  # 0.1 s: only where it is needed

    targets = even_targets(min(float(q.min()), 0.0), max(float(q.max()), 0.0), steps)
    numbers, of_branches = (
        model.parameters.numbers(),
        tuple(f"{installed.name}." for installed in model.features if installed.feature.branches is not None),
    )
    others = [float(c.value) for name, c in model.constants.items() if not name.startswith(of_branches)]
    elastic = [row.tobytes() for row in (numbers.law, numbers.volumetric, *numbers.metals)]
    key = ("elastic", model.mesh.shape, targets.tobytes(), tolerance, others, elastic)
    known: _ElasticCurve | None = model.curves.get(key)
    if known is not None:
        return known
    rates: dict[float, Array] = {}

    def differentiate(solver: Equilibrium) -> None:
        rates[solver.q] = solver.tangent_rate()

    history = sweep(
        model,
        targets,
        tolerance=tolerance,
        keep_states=True,
        observer=differentiate,
        failure_limit=failure_limit,
    )
    assert history.states is not None
    solved = history.displacement
    state = CubicHermiteSpline(solved, history.states, np.array([rates[x] for x in solved]))
    curve = _ElasticCurve(history, state, state.derivative())
    model.curves.put(key, curve)
    return curve


def _works(model: FiniteElementModel, names: Sequence[str], changes: Sequence[Numbers], rate: Array) -> Array:
    """Work (names,) of the stresses' derivatives by each parameter on dx/dq at the model's state."""
    body = model.body
    slopes = Slopes(body, model.state.x.array)
    # A clock follows the strain.
    body.material.isochoric(moduli=False)
    memory = [[None] * len(body.material.branches)] * len(names)
    (active, answers), *_ = slopes.stresses(changes, memory)
    along, works = slopes.along(rate), np.zeros(len(names))
    others = [None] * (len(body.parts) - 1)
    for i, row in zip(active, answers, strict=True):
        works[i] = slopes.work_of(names[i], changes[i], [row[:, 1:], *others], along)
    return np.asarray(sum_over_ranks(model.comm, works))
