"""CSV: dynamic stiffness of each direction and preload over frequency, for programs whose own format is not public.

The formats of Adams' files of frequency-dependent bushings are not public. Stiffness and damping of this table fit a
GFORCE at one frequency, splines over frequency, and a fit of the program's own coefficients.
"""

from __future__ import annotations

import csv
import io

import numpy as np

from bushcli.export.writer import Order, Writer, one_line

_COLUMNS = (
    *("direction", "load_case", "point", "preload_displacement", "preload_force", "amplitude", "frequency"),
    *("stiffness", "loss_angle_deg", "storage", "loss", "damping"),
)


def write(order: Order) -> str:
    """Return the table, a row for each direction, preload, amplitude and frequency."""
    units = order.units
    text = io.StringIO()
    # A load case's name may contain a comma.
    table = csv.writer(text, lineterminator="\n")
    table.writerow(_COLUMNS)
    for vibration in order.bushing.vibrations:
        force = units.of_moment if vibration.rotational else units.of_force
        length = 1.0 if vibration.rotational else units.of_length(1.0)
        static: tuple[object, ...] = ("", "")
        if vibration.static is not None:
            static = (f"{length * vibration.static[0]:.12g}", f"{force(vibration.static[1]):.12g}")
        peak = "" if vibration.amplitude is None else f"{length * vibration.amplitude:.12g}"
        point = "transfer" if vibration.transfer else "driving"
        for direction in vibration.directions:
            for f, k, c in zip(vibration.frequency, vibration.stiffness, vibration.damping, strict=True):
                per = force(1.0) / length
                complex_parts = (per * k.real, per * k.imag, units.of_time(per * c))
                numbers = (units.of_frequency(f), per * abs(k), np.degrees(np.angle(k)), *complex_parts)
                row = (direction, one_line(vibration.name), point, *static, peak)
                table.writerow((*row, *(f"{number:.12g}" for number in numbers)))
    return text.getvalue()


WRITER = Writer(
    name="csv_dynamic",
    title="CSV table of dynamic stiffness",
    kind="vibration",
    ending=".csv",
    comment=("#", ""),
    write=write,
    remarks=(
        "the bushing's axis is z; frequency in cycles per unit of time, angles in rad, the loss angle in degrees",
        "an amplitude is a peak; without one the vibration is small",
        "stiffness, storage and loss are force/length, of TX to TZ moment/rad; damping = loss / (2 pi frequency)",
    ),
    source="RFC 4180",
)
