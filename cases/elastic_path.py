"""Derivatives along a path by the amplitudes of branches that are off.

Rubber whose branches are all off is elastic, so that its states along any path are those of one curve over the range of
the path. A branch remembers these states whether it is off or on, and the derivative of the force by its amplitude is
the work of its stress, per unit of the amplitude, on dx/dq: nothing is solved along the path. States and dx/dq are
interpolated from those of the curve by cubic Hermite polynomials in q. A spring in series shares the displacement with
the curve.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.history import History, failure_at_start
from cases.model import FiniteElementModel
from cases.parameters import Numbers
from cases.program import Program
from cases.ranks import sum_over_ranks
from cases.series import SeriesSpring, Shared
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
        branch.is_off for branch in model.body.material.families if branch.clock != "shown"
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
    drive: SeriesSpring | None = None,
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
    sensitivity, drive, failure_limit
        As there.

    Raises
    ------
    NotConverged
        As there, with the curve so far.
    """
    q = program.displacement
    time = np.zeros(len(q)) if program.time is None else program.time
    curve = _elastic_curve(model, q, steps, tolerance, failure_limit)
    if drive is not None:
        q = _bushing_path(curve, drive, q, time)
    changes = [model.parameters.rates(name) for name in sensitivity]
    durations = np.diff(time, prepend=time[0])
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
    force, stiffness = curve.force(q), curve.force(q, 1)
    path_slope = np.zeros_like(slope)
    if drive is not None:
        for i, at in enumerate(zip(q, force, time, stiffness, strict=True)):
            # None of these parameters moves what the program prescribes.
            path_slope[i] = [
                drive.rate(name, *at, 0.0, w) for name, w in zip(sensitivity, slope[i], strict=True)
            ]
    return History(
        displacement=q,
        force=force,
        time=program.time,
        energy=np.interp(q, curve.history.displacement, curve.history.energy),
        newton=np.zeros(len(q), dtype=np.int64),
        attempts=curve.history.attempts,
        sensitivity=slope + stiffness[:, None] * path_slope,
        path_sensitivity=path_slope,
        stretches=curve.history.stretches,
    )


@dataclass(frozen=True)
class _ElasticCurve:
    """Curve of a model whose branches are off: force, unknowns and their derivatives by q, as functions of q."""

    history: History
    force: Callable[..., Array]
    state: Callable[[float], Array]
    rate: Callable[[float], Array]


def _elastic_curve(
    model: FiniteElementModel, q: Array, steps: int, tolerance: float, failure_limit: int | None
) -> _ElasticCurve:
    """Return the curve over the range of a path (n,), or the last one if only parameters of branches have changed."""
    from scipy.interpolate import CubicHermiteSpline, CubicSpline  # 0.1 s: only where they are needed

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
    curve = _ElasticCurve(history, CubicSpline(solved, history.force), state, state.derivative())
    model.curves.put(key, curve)
    return curve


def _bushing_path(curve: _ElasticCurve, drive: SeriesSpring, prescribed: Array, time: Array) -> Array:
    """Return the bushing's displacements (n,), given those of bushing and spring together; raises `NotConverged`."""
    search = Shared(drive, float(np.abs(prescribed).max()), float(time[0]))
    path = []
    for together, now in zip(map(float, prescribed), map(float, time), strict=True):
        better: float | None = search.first_trial(together)
        while better is not None:
            if math.isnan(better):
                raise failure_at_start(search.reason)
            q = better
            better = search.better(q, float(curve.force(q)), now, together)
        path.append(q)
    return np.array(path)


def _works(model: FiniteElementModel, names: Sequence[str], changes: Sequence[Numbers], rate: Array) -> Array:
    """Work (names,) of the stresses' derivatives by each parameter on dx/dq at the model's state."""
    body = model.body
    slopes = Slopes(body, model.state.x.array)
    # A clock follows the strain.
    body.material.isochoric(moduli=False)
    memory = [[None] * len(body.material.families)] * len(names)
    (active, answers), *_ = slopes.stresses(changes, memory)
    along, works = slopes.along(rate), np.zeros(len(names))
    others = [None] * (len(body.parts) - 1)
    for i, row in zip(active, answers, strict=True):
        works[i] = slopes.work_of(names[i], changes[i], [row[:, 1:], *others], along)
    return np.asarray(sum_over_ranks(model.comm, works))
