"""JSON: all simulated curves and, where there is one, the stiffness matrix."""

from __future__ import annotations

import json
from typing import Any

from bushcli import __version__
from bushcli.export.curves import ForceCurve
from bushcli.export.units import UnitSystem
from bushcli.export.writer import Order, Writer
from bushcli.export.writers.chrono import in_units


def write(order: Order) -> str:
    """Return the document."""
    assert order.bushing is not None
    units, matrix = order.units, order.bushing.stiffness_matrix
    document: dict[str, Any] = {
        "written_by": f"bushcli {__version__}",
        "title": order.title,
        "from": order.where,
        "units": {
            "displacement": units.length_name,
            "rotation": "rad",
            "force": units.force_name,
            "moment": units.moment_name,
            "time": "s",
        },
        "axis": "z",
        "remarks": list(order.bushing.remarks),
        "curves": [_curve(one, units) for one in order.bushing.curves],
    }
    if matrix is not None:
        document["stiffness_matrix"] = {
            "order": ["ux", "uy", "uz", "rx", "ry", "rz"],
            "values": in_units(matrix, units).tolist(),
        }
    return json.dumps(document, indent=2, allow_nan=False)


def _curve(one: ForceCurve, units: UnitSystem) -> dict[str, Any]:
    turned = one.rotational
    return {
        "name": one.name,
        "mode": one.mode,
        "time": None if one.time is None else one.time.tolist(),
        "displacement": [float(q) if turned else units.of_length(float(q)) for q in one.displacement],
        "force": [
            units.of_moment(float(force)) if turned else units.of_force(float(force)) for force in one.force
        ],
    }


WRITER = Writer(
    name="json",
    title="JSON of curves and stiffness matrix",
    kind="bushing",
    ending=".json",
    comment=("", ""),
    write=write,
    source="RFC 8259",
)
