"""Altair MotionSolve: a general bushing file (.gbs) with a spline in each direction, coupled in the plane of x and y.

A bushing whose radial curve is the same in all directions has cylindrical coupling. Altair's rubber damping has
its own coefficients, which Altair's identification tool fits; none are written. An FMU includes the memory.
"""

from __future__ import annotations

from bushcli.export.teimorbit import block, comments, curve, units_block
from bushcli.export.vibration import FORCES
from bushcli.export.writer import Order, Writer

_MODELS = (
    *("SPLINE_STIFFNESS", "CUBIC_STIFFNESS", "CONSTANT_STIFFNESS"),
    *("CONSTANT_DAMPING", "RUBBER_DAMPING", "HYDROMOUNT_DAMPING"),
)


def write(order: Order) -> str:
    """Return the file."""
    lines = comments(order.bushing)
    lines += block("HEADER", ["FILE_TYPE     = 'gbs'", "FILE_VERSION  = '1.1'", "FILE_FORMAT   = 'ASCII'"])
    lines += units_block(order.units, "degree")
    lines += block("GLOBAL", ["COUPLING      = 'cylindrical'"])
    rows = [
        f"'{model}'".ljust(22) + "".join("   1" if i == 0 else "   0" for _ in FORCES)
        for i, model in enumerate(_MODELS)
    ]
    heads = "{ formulation" + " " * 9 + "".join(f"  {d}" for d in FORCES) + " }"
    lines += block("DIRECTIONS", ["(ACTIVITY)", heads, *rows])
    for direction in FORCES:
        data = ["(SPLINE_DATA)", "{           disp            force  }", *curve(order, direction, "altair")]
        lines += block(f"SPLINE_STIFFNESS_{direction}", data)
    return "\n".join(lines)


WRITER = Writer(
    name="altair",
    title="Altair general bushing file",
    kind="bushing",
    ending=".gbs",
    comment=("$", ""),
    write=write,
    static=True,
    remarks=("the bushing's axis is z; angles in degrees",),
    source="Altair MotionSolve 2021 help, Bushing Property File: Header, Units, Global, Directions, Spline Stiffness",
)
