"""Dynamic stiffness and loss angle over frequency, a curve for each preload."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    RED,
    Picture,
    legend,
    literal,
    log_ticks,
    new_figure,
    picture,
    style,
)
from bushcli.report.views.dynamic import point_in_words, preload_in_words, stiffness_unit, title
from bushcli.simulate.dynamic import DynamicCurve, DynamicResponse

# Frequencies that span more than this factor are drawn on a logarithmic axis.
_WIDE = 20.0


def dynamic_figures(response: DynamicResponse, names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return a picture of each load case.

    Parameters
    ----------
    response : DynamicResponse
    names : mapping of str to str
        File name by name of the load case.
    """
    found = []
    for name, file in names.items():
        curves = [curve for curve in response.curves if curve.name == name]
        words = f"{title(curves[0])}: {point_in_words(curves[0])} and loss angle over frequency"
        words = words[:1].upper() + words[1:]
        found.append(picture(f"{file}-dynamic", "dynamic", words, _figure(curves, words), name))
    return tuple(found)


def _figure(curves: Sequence[DynamicCurve], words: str) -> Figure:
    frequency = np.sort(curves[0].frequency)
    with style():
        figure = new_figure(7.5, 6.4)
        panels = figure.subplots(2, 1, sharex=True)
        for number, curve in enumerate(curves):
            order = np.argsort(curve.frequency)
            color = (BLUE, RED, GREEN, ORANGE, BLACK)[number % 5]
            line = "-" if number < 5 else "--"
            mark = {"marker": "o", "ms": 3.5} if len(order) < 30 else {}
            values = (np.abs(curve.stiffness), np.degrees(curve.loss_angle))
            for axes, value in zip(panels, values, strict=True):
                label = f"preload {preload_in_words(curve)}"
                axes.plot(curve.frequency[order], value[order], line, color=color, label=label, **mark)
        panels[0].set(ylabel=f"|K*| [{stiffness_unit(curves[0].mode)}]")
        panels[1].set(ylabel="loss angle [deg]", xlabel="frequency [Hz]")
        if frequency[-1] > _WIDE * frequency[0]:
            panels[1].set_xscale("log")
            log_ticks(panels[1].xaxis, frequency[0], frequency[-1])
        legend(panels[0], loc="best")
        figure.suptitle(literal(words))
        figure.align_ylabels()
    return figure
