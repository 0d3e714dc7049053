"""CSV: all simulated curves in one table, one row per point."""

from __future__ import annotations

import csv
import io

from bushcli.export.writer import Order, Writer, one_line


def write(order: Order) -> str:
    """Return the table; times are empty where there are none."""
    units = order.units
    text = io.StringIO()
    # A channel's name may contain a comma.
    table = csv.writer(text, lineterminator="\n")
    force_name = f"force_{units.force_name}_or_moment_{units.force_name}{units.length_name}"
    table.writerow(("channel", "mode", "time_s", f"displacement_{units.length_name}_or_rad", force_name))
    for curve in order.bushing.curves:
        rotational = curve.rotational
        times = [""] * len(curve.displacement) if curve.time is None else [f"{t:.12g}" for t in curve.time]
        for time, q, force in zip(times, curve.displacement, curve.force, strict=True):
            x = float(q) if rotational else units.of_length(float(q))
            y = units.of_moment(float(force)) if rotational else units.of_force(float(force))
            table.writerow((one_line(curve.name), curve.mode, time, f"{x:.12g}", f"{y:.12g}"))
    return text.getvalue()


WRITER = Writer(
    name="csv",
    title="CSV table of curves",
    kind="bushing",
    ending=".csv",
    comment=("", ""),
    write=write,
    source="RFC 4180",
)
