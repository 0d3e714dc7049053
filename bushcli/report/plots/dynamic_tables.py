"""Plots of a table of dynamic stiffness: measured beside simulated over frequency, and the wicket plot of both."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.report.document import Panels, Plot, Region, Series
from bushcli.report.plots.direct import around, capital
from bushcli.report.plots.dynamic import COLOURS, WIDE
from bushcli.report.quantity import number, percent
from bushcli.report.views.dynamic_tables import preload_of, table_units
from bushcli.simulate.dynamic_tables import ComparedTable

Array = NDArray[np.float64]


def table_panels(one: ComparedTable, file: str) -> Panels:
    """Return |K*| and loss angle over frequency or amplitude, a colour for each curve, and the loss angle over |K*|."""
    table, unit = one.table, table_units(one.table)[2]
    how = "predicted" if one.held_out else "simulated"
    of_frequency = table.over_frequency
    over = table.frequency if of_frequency else table.amplitude
    measured = table.stiffness, np.degrees(table.loss_angle)
    models = (
        [("after", one.simulated)]
        if one.started is None
        else [("before", one.started), ("after", one.simulated)]
    )
    series: list[list[Series]] = [[], [], []]
    regions: list[list[Region]] = [[], []]
    for i, rows in enumerate(table.conditions()):
        rows = rows[np.argsort(over[rows], kind="stable")]
        colour, label = f"line-{i % COLOURS}", f"measured, {preload_of(table.rows(rows))}"
        errors: list[Array | None] = [None, None]
        if one.errors is not None:
            errors = [one.errors[0, rows], np.degrees(one.errors[1, rows])]
        points = [
            Series(colour, label if k == 0 else "", over[rows], measured[k][rows], "dots", errors[k])
            for k in range(2)
        ]
        for k, point in enumerate(points):
            series[k].append(point)
        series[2].append(Series(colour, "", measured[0][rows], measured[1][rows], "dots"))
        for key, simulated in models:
            found = np.abs(simulated[rows]), np.degrees(np.angle(simulated[rows]))
            last = i == len(table.conditions()) - 1
            for k in range(2):
                named = "before" if key == "before" else f"{how} (held out)" if one.held_out else how
                series[k].append(Series(key, named if last and k == 0 else "", over[rows], found[k]))
            series[2].append(Series(key, "", *found))
        if one.spread is not None:
            ends = [np.abs(one.simulated[rows]), np.degrees(np.angle(one.simulated[rows]))]
            for k, half in enumerate((one.spread[0, rows], np.degrees(one.spread[1, rows]))):
                if len(rows) > 1 and np.isfinite(half).all():
                    regions[k].append(
                        Region("shaded", "", [around(over[rows], ends[k] - half, ends[k] + half)])
                    )
    axis = "frequency [Hz]" if of_frequency else "amplitude"
    log: Literal["", "x"] = "x" if over.max() > WIDE * over.min() > 0.0 else ""
    above = Plot("stiffness", ("", f"|K*| [{unit}]"), series[0], regions[0], log=log)
    below = Plot("angle", (axis, "loss angle [deg]"), series[1], regions[1], log=log)
    wicket = Plot("wicket", (f"|K*| [{unit}]", "loss angle [deg]"), series[2], height=300.0)
    misfit = f"{percent(one.stiffness_percent)} and {number(one.loss_angle_deg)} degrees rms"
    title = f"{capital(table.name)}: {how} within {misfit}"
    return Panels(f"{file}-table", "table", title, [[above], [below], [wicket]], table.name, note=_NOTE)


_NOTE = (
    "Bars: one standard error of the measured row; pale: 95 % interval of the simulated curve. In the lowest plot, the "
    "wicket plot, a row that belongs to no curve stands apart."
)
