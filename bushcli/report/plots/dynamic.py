"""Plots of dynamic stiffness: over frequency for each preload, and measured tables beside their simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.report.document import Array, Panels, Plot, Region, Series
from bushcli.report.plots.direct import SEPARATE, around, capital, colour
from bushcli.report.quantity import number, percent
from bushcli.report.views import dynamic as words
from bushcli.simulate.dynamic_tables import ComparedTable

if TYPE_CHECKING:
    from bushcli.simulate.vibrations import DynamicCurve


# Frequencies that span more than this factor are drawn on a logarithmic axis.
WIDE = 20.0
# Frequencies of a line, between those that were asked for.
_DENSE = 300


def dynamic_panels(curves: Sequence[DynamicCurve], names: Mapping[str, str]) -> list[Panels]:
    """Return the plots of each load case, of which the names of the files are given; a preload has a colour."""
    groups = {file: [curve for curve in curves if curve.name == name] for name, file in names.items()}
    return [dynamic_panel(group, file) for file, group in groups.items()]


def dynamic_panel(curves: Sequence[DynamicCurve], file: str) -> Panels:
    """Return the plots of one load case."""
    asked = np.unique(np.concatenate([curve.frequency for curve in curves]))
    wide = bool(asked[-1] > WIDE * asked[0])
    lines = np.unique([*(np.geomspace if wide else np.linspace)(asked[0], asked[-1], _DENSE), *asked])
    drawn: tuple[list[Series], list[Series]] = ([], [])
    for i, curve in enumerate(curves):
        key, label = colour(i), f"preload {words.preload_in_words(curve)}"
        if curve.amplitude is not None:
            label += f", amplitude {words.amplitude_in_words(curve)}"
        if curve.uneven is None:
            at, between = lines, curve.model.stiffness(lines, curve.branches)
        else:
            order = np.argsort(curve.frequency)
            at, between = curve.frequency[order], curve.stiffness[order]
        for series, line, dots in zip(drawn, _polar(between), _polar(curve.stiffness), strict=True):
            series.append(Series(key, label, at, line))
            if len(curve.frequency) <= SEPARATE:
                series.append(Series(key, "", curve.frequency, dots, "dots"))
    first = curves[0]
    heading = f"{capital(words.title(first))}: {words.point_in_words(first)} and loss angle over frequency"
    label = f"|K*| [{words.stiffness_unit(first.mode)}]"
    above = Plot("stiffness", ("", label), drawn[0], log="x" if wide else "")
    below = Plot("angle", ("frequency [Hz]", "loss angle [deg]"), drawn[1], log=above.log)
    return Panels(f"{file}-dynamic", "dynamic", heading, [[above], [below]], first.name)


def _polar(K: NDArray[np.complex128]) -> tuple[Array, Array]:
    """Return magnitude and angle in degrees."""
    return np.abs(K), np.degrees(np.angle(K))


def table_panels(compared: ComparedTable, file: str) -> Panels:
    """Return |K*| and loss angle over frequency or amplitude, a colour for each curve, and the loss angle over |K*|."""
    table, unit = compared.table, words.table_units(compared.table)[2]
    how = "predicted" if compared.held_out else "simulated"
    x = table.frequency if table.over_frequency else table.amplitude
    measured = table.stiffness, np.degrees(table.loss_angle)
    models = [] if compared.started is None else [("before", "before", compared.started)]
    # Each simulated curve has the colour of its rows.
    models.append(("", f"{how} (held out)" if compared.held_out else how, compared.simulated))
    series: list[list[Series]] = [[], [], []]
    regions: list[list[Region]] = [[], []]
    curves = table.conditions()
    for i, rows in enumerate(curves):
        rows = rows[np.argsort(x[rows], kind="stable")]
        key, label = colour(i), f"measured, {words.preload_of(table.rows(rows))}"
        errors = compared.errors
        halves = (None, None) if errors is None else (errors[0, rows], np.degrees(errors[1, rows]))
        for k, name in enumerate((label, "")):
            series[k].append(Series(key, name, x[rows], measured[k][rows], "dots", halves[k]))
        series[2].append(Series(key, "", measured[0][rows], measured[1][rows], "dots"))
        for role, label, simulated in models:
            polar = _polar(simulated[rows])
            for k in range(2):
                named = label if i == len(curves) - 1 and k == 0 else ""
                series[k].append(Series(role or key, named, x[rows], polar[k]))
            series[2].append(Series(role or key, "", *polar))
        if compared.spread is not None:
            spread = compared.spread[0, rows], np.degrees(compared.spread[1, rows])
            for band, end, half in zip(regions, _polar(compared.simulated[rows]), spread, strict=True):
                if len(rows) > 1 and np.isfinite(half).all():
                    band.append(Region("shaded", "", [around(x[rows], end - half, end + half)]))
    axis = "frequency [Hz]" if table.over_frequency else "amplitude"
    log: Literal["", "x"] = "x" if x.max() > WIDE * x.min() > 0.0 else ""
    above = Plot("stiffness", ("", f"|K*| [{unit}]"), series[0], regions[0], log=log)
    below = Plot("angle", (axis, "loss angle [deg]"), series[1], regions[1], log=log)
    wicket = Plot("wicket", (f"|K*| [{unit}]", "loss angle [deg]"), series[2], height=300.0)
    pale = "" if compared.spread is None else "; pale: 95 % interval of the simulated curve"
    note = f"Bars: one standard error of the measured row{pale}. {_WICKET}"
    misfit = f"{percent(compared.stiffness_percent)} and {number(compared.loss_angle_deg)} degrees rms"
    title = f"{capital(table.name)}: {how} within {misfit}"
    return Panels(f"{file}-table", "table", title, [[above], [below], [wicket]], table.name, note=note)


_WICKET = "In the lowest plot, the wicket plot, a row that belongs to no curve stands apart."
