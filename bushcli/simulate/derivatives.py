"""Derivatives of a solved curve, arranged by all parameters of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.symmetry import both_halves, swept_range
from bushcli.effects import rig
from bushcli.effects.active import ActiveEffect
from bushcli.effects.change import Signal
from bushcli.simulate.steps import steps_of_sweep
from cases import local
from cases.march import History
from cases.model import FiniteElementModel
from cases.series import Extension
from cases.simulate import even_targets

Array = NDArray[np.float64]


def columns(derivatives: Array | None, inner: Sequence[str], names: Sequence[str], count: int) -> Array:
    """Spread the derivatives by some parameters over the columns of all parameters, with zeros elsewhere.

    Parameters
    ----------
    derivatives : (count, len(inner)) array or None
        Derivatives by the parameters `inner`, in the unit of the curve per unit of each parameter; None for all zero.
    inner : sequence of str
        Parameters that the model was differentiated by.
    names : sequence of str
        All parameters, in the order of the columns returned.
    count : int
        Number of samples.
    """
    spread = np.zeros((count, len(names)))
    if derivatives is not None:
        spread[:, [names.index(name) for name in inner]] = derivatives
    return spread


def elastic_curve(
    history: History, symmetric: bool, inner: tuple[str, ...], names: tuple[str, ...]
) -> rig.Response:
    """Return the solved curve as a function of the displacement: force, stiffness, derivatives by all names."""
    from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed

    q = history.displacement
    values = np.column_stack([history.force, columns(history.sensitivity, inner, names, len(q))])
    if symmetric:
        q, values = both_halves(q, values)
    spline = CubicSpline(q, values)
    stiffness = spline.derivative()

    def response(displacement: Array) -> tuple[Array, Array, Array]:
        values = spline(displacement)
        return values[:, 0], stiffness(displacement)[:, 0], values[:, 1:]

    return response


def extension_in_series(
    active: Sequence[ActiveEffect], names: tuple[str, ...], start: float
) -> Callable[[float, float, float], Extension]:
    """Return the function for the extension of springs in series, given one state of the bushing."""
    local = ("", " ", *names)

    def extension_at(q: float, force: float, time: float) -> Extension:
        rows = np.zeros((2, 1, len(local)))
        rows[0, 0, 0] = rows[1, 0, 1] = 1.0
        displacement, reaction = Signal(np.array([q]), rows[0]), Signal(np.array([force]), rows[1])
        total = rig.parallel(active, displacement, reaction, local, np.array([max(time - start, 0.0)]))
        springs = rig.extension(active, total, local)
        by_q, by_force, *by_name = map(float, springs.slope[0])
        return Extension(float(springs.value[0]), by_q, by_force, dict(zip(names, by_name, strict=True)))

    return extension_at


def local_slopes(model: FiniteElementModel, displacement: Array, odd: bool) -> tuple[Array, local.Cells]:
    """Return derivatives (n, cells) of the force by the stiffness of each cell, and the cells; collective.

    Parameters
    ----------
    model : FiniteElementModel
        Of rubber without memory, with the values of its parameters.
    displacement : Array
        Samples at which the derivatives are wanted, shape (n,), mm or rad.
    odd : bool
        Whether one side of the curve gives the other.

    Raises
    ------
    NotConverged
    """
    from scipy.interpolate import CubicSpline  # 0.1 s: only where it is needed
    from scipy.spatial import KDTree

    count = steps_of_sweep(model.mesh.shape, model.mesh.dimension)
    sweep = local.differentiate_sweep(model, even_targets(*swept_range(displacement, odd), count))
    q, slope = sweep.history.displacement, sweep.slope
    if odd:
        # Mirrored halves of the rubber change places with the sign of the load.
        plane, dimension = model.mode.reversed_by, sweep.cells.points.shape[1]
        image = sweep.cells.centres.copy()
        if plane is not None and (dimension == 3 or plane == "z"):
            image[:, dimension - 1 if plane == "z" else "xy".index(plane)] *= -1.0
        q, slope = both_halves(q, slope, -slope[:, KDTree(sweep.cells.centres).query(image)[1]])
    return np.asarray(CubicSpline(q, slope)(displacement)), sweep.cells
