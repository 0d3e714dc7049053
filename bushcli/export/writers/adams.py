"""Adams: a bushing property file (.bus), TeimOrbit version 4, which Simpack and Altair AutoBush read too.

Six curves of force over displacement; the bushing's axis is the marker's z. The damping is zero: the losses of rubber
are not proportional to speed; an FMU (`fmu2`, `fmu3`) includes them.
"""

from __future__ import annotations

from bushcli.export.teimorbit import block, comments, curve, units_block
from bushcli.export.vibration import FORCES
from bushcli.export.writer import Order, Writer

_NAMES = {"FX": "x", "FY": "y", "FZ": "z", "TX": "ax", "TY": "ay", "TZ": "az"}


def write(order: Order) -> str:
    """Return the file."""
    lines = comments(order.bushing)
    lines += block("MDI_HEADER", ["FILE_TYPE     = 'bus'", "FILE_VERSION  = 4.0", "FILE_FORMAT   = 'ASCII'"])
    lines += units_block(order.units, "degrees")
    lines += block("DAMPING", [f"{direction}_DAMPING    = 0.0" for direction in FORCES])
    for direction in FORCES:
        heads = f"{{{_NAMES[direction]:>15s} {direction.lower():>16s}}}"
        lines += block(f"{direction}_CURVE", [heads, *curve(order, direction, "adams")])
    return "\n".join(lines)


WRITER = Writer(
    name="adams",
    title="Adams bushing property file",
    kind="bushing",
    ending=".bus",
    comment=("$", ""),
    write=write,
    static=True,
    remarks=(
        "the bushing's axis is z; angles in degrees",
        "damping is zero: the losses of rubber are not proportional to speed",
    ),
    source="Adams/Car bushing property files, TeimOrbit format version 4",
)
