"""Derivatives of a solved curve, arranged by all parameters of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.symmetry import both_halves
from bushcli.effects import rig
from bushcli.effects.active import ActiveEffect
from bushcli.effects.change import Signal
from cases.march import History
from cases.series import Extension

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
    slope = np.zeros((len(q), len(names)))
    for i, name in enumerate(names):
        if name in inner:
            assert history.sensitivity is not None
            slope[:, i] = history.sensitivity[:, inner.index(name)]
    values = np.column_stack([history.force, slope])
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

    def extended(q: float, force: float, time: float) -> Extension:
        rows = np.zeros((2, 1, len(local)))
        rows[0, 0, 0] = rows[1, 0, 1] = 1.0
        displacement, reaction = Signal(np.array([q]), rows[0]), Signal(np.array([force]), rows[1])
        total = rig.parallel(active, displacement, reaction, local, np.array([max(time - start, 0.0)]))
        springs = rig.extension(active, total, local)
        slope = springs.slope[0]
        return Extension(
            float(springs.value[0]),
            float(slope[0]),
            float(slope[1]),
            dict(zip(names, map(float, slope[2:]), strict=True)),
        )

    return extended
