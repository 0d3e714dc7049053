"""JSON: all simulated curves and, where there is one, the stiffness matrix."""

from __future__ import annotations

import json
from typing import Any

from bushcli import __version__
from bushcli.export.writer import Order, Writer
from bushcli.export.writers.chrono import in_units


def write(order: Order) -> str:
    """Return the document."""
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
    }
    curves = []
    for curve in order.bushing.curves:
        length = 1.0 if curve.rotational else units.of_length(1.0)
        force = units.of_moment if curve.rotational else units.of_force
        values = {
            "time": None if curve.time is None else curve.time.tolist(),
            "displacement": [length * float(q) for q in curve.displacement],
            "force": [force(float(value)) for value in curve.force],
        }
        curves.append({"name": curve.name, "mode": curve.mode, **values})
    document["curves"] = curves
    if matrix is not None:
        document["stiffness_matrix"] = {
            "order": ["ux", "uy", "uz", "rx", "ry", "rz"],
            "values": in_units(matrix, units).tolist(),
        }
    return json.dumps(document, indent=2, allow_nan=False)


WRITER = Writer(
    name="json",
    title="JSON of curves and stiffness matrix",
    kind="bushing",
    ending=".json",
    comment=("", ""),
    write=write,
    source="RFC 8259",
)
