"""Classes of local strain in a bushing, with which the Payne effect becomes part of a force law.

The clock of a point of the rubber runs with its own strain (`forms.branches.payne`). In a motion along one direction
the strain at each point is a function of the displacement, that of the elastic body: points of about the same strain
share a clock, and their part of the force is their part of the energy of a branch that does not relax. That the strain
gathers where the rubber is thinned is left out; the force is stationary in the displacement field, so that it changes
little: the dynamic stiffness of a plain bushing, axial and radial, by 1 % and 0.4 degrees at most where the thinned
branches are three times as stiff as the law, from 0.01 to 40 % of its wall and 0.01 to 100 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Number of classes, of the same energy each: against a clock at each point six change the dynamic stiffness of a plain
#: bushing by at most 0.1 %.
CLASSES = 6


def strain_classes(grid: Array, path: Sequence[tuple[Array, Array]], volume: Array) -> list[dict[str, Any]]:
    """Return the classes, the data of `fmu.force_law.StrainClass`, with the strain at displacements (n,), mm or rad.

    The path has for each side displacements (m,) from rest and the right Cauchy-Green tensors (m, points, 3, 3) of the
    elastic body there; the volume (points,) is that of the rubber for which each point stands.
    """
    from scipy.interpolate import CubicSpline

    sides, energy = [], np.zeros(len(volume))
    for q, C in path:
        isochoric = C / np.cbrt(np.linalg.det(C))[..., None, None]
        # |A, B|^2 = tr(A^-1 (B - A) B^-1 (B - A)) / 2, as in the law.
        change = np.diff(isochoric, axis=0)
        first, second = (np.linalg.solve(gradient, change) for gradient in (isochoric[:-1], isochoric[1:]))
        steps = np.sqrt(np.maximum(np.einsum("qpij,qpji->qp", first, second) / 2.0, 0.0))
        sides.append((q, np.vstack([np.zeros(len(volume)), np.sign(q[-1]) * np.cumsum(steps, axis=0)])))
        # That of a branch which has relaxed at rest, where the assembly may have strained the rubber.
        energy += volume * (np.trace(np.linalg.solve(isochoric[0], isochoric[-1]), axis1=-2, axis2=-1) - 3.0)
    order = np.argsort(sum(np.abs(strain[-1]) for _, strain in sides))
    share = np.cumsum(energy[order]) / energy.sum()
    classes = []
    parts = np.split(order, np.searchsorted(share, np.arange(1, CLASSES) / CLASSES))
    for points_of_class in filter(len, parts):
        energy_at = {
            float(x): float(y)
            for q, strain in sides
            for x, y in zip(q, strain[:, points_of_class] @ energy[points_of_class], strict=True)
        }
        x = np.array(sorted(energy_at))
        spline = CubicSpline(
            x, np.array([energy_at[position] for position in x]) / energy[points_of_class].sum()
        )
        data = {"strain": spline(grid).tolist(), "strain_slope": spline(grid, 1).tolist()}
        classes.append({"share": float(energy[points_of_class].sum() / energy.sum()), **data})
    return classes
