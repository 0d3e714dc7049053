"""Project Chrono: a 6 x 6 bushing, ChLoadBodyBodyBushingGeneric, as a Python module for PyChrono.

Chrono's matrix has the same order as bushcli's: rows force then torque, columns displacement then rotation. Chrono
knows no units; SI is usual. The matrix holds for small motions about rest; Chrono's loads need its symmetric part.
"""

from __future__ import annotations

import numpy as np

from bushcli.export.curves import Array
from bushcli.export.units import UnitSystem
from bushcli.export.writer import Order, Writer

_CODE = '''
import pychrono as chrono

#: Forces and torques on the inner sleeve against its displacement and rotation, x y z rx ry rz; the axis is z.
STIFFNESS = [
{rows}
]


def bushing(inner, outer, frame, damping=0.0):
    """Return the load between two bodies, to be added to a ChLoadContainer.

    frame: ChFrameD of the bushing in absolute coordinates. damping: time in which to multiply the stiffness.
    """
    stiffness, viscous = chrono.ChMatrixDynamicD(6, 6), chrono.ChMatrixDynamicD(6, 6)
    for i, row in enumerate(STIFFNESS):
        for j, value in enumerate(row):
            stiffness[i, j] = value
            viscous[i, j] = damping * value
    return chrono.ChLoadBodyBodyBushingGeneric(inner, outer, frame, stiffness, viscous)
'''


def write(order: Order) -> str:
    """Return the module."""
    assert order.bushing.stiffness_matrix is not None
    matrix = in_units(order.bushing.stiffness_matrix, order.units)
    rows = "\n".join("    [" + ", ".join(f"{value:.9g}" for value in row) + "]," for row in matrix)
    return _CODE.format(rows=rows)


def in_units(matrix: Array, units: UnitSystem) -> Array:
    """Return a stiffness matrix in N, mm, rad in other units."""
    rows = np.array([units.of_force(1.0)] * 3 + [units.of_moment(1.0)] * 3)
    columns = np.array([units.of_length(1.0)] * 3 + [1.0] * 3)
    return np.asarray(matrix * rows[:, None] / columns[None, :])


WRITER = Writer(
    name="chrono",
    title="Project Chrono 6 x 6 bushing",
    kind="matrix",
    ending=".py",
    comment=("#", ""),
    write=write,
    static=True,
    remarks=("angles in rad",),
    source="Project Chrono API: ChLoadBodyBodyBushingGeneric",
)
