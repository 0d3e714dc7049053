"""CSV: all simulated curves in one table, one row per point."""

from __future__ import annotations

from bushcli.export.writer import Order, Writer


def write(order: Order) -> str:
    """Return the table; times are empty where there are none."""
    assert order.bushing is not None
    units = order.units
    lines = [
        f"channel,mode,time_s,displacement_{units.length_name}_or_rad,"
        f"force_{units.force_name}_or_moment_{units.force_name}{units.length_name}"
    ]
    for curve in order.bushing.curves:
        turned = curve.rotational
        times = [""] * len(curve.displacement) if curve.time is None else [f"{t:.12g}" for t in curve.time]
        for time, q, force in zip(times, curve.displacement, curve.force, strict=True):
            x = float(q) if turned else units.of_length(float(q))
            y = units.of_moment(float(force)) if turned else units.of_force(float(force))
            lines.append(f"{curve.name},{curve.mode},{time},{x:.12g},{y:.12g}")
    return "\n".join(lines)


WRITER = Writer(
    name="csv",
    title="CSV table of curves",
    kind="bushing",
    ending=".csv",
    comment=("", ""),
    write=write,
    source="RFC 4180",
)
