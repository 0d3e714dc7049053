"""Dynamic stiffness and loss angle over frequency, a curve for each preload."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

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

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Frequencies that span more than this factor are drawn on a logarithmic axis.
_WIDE = 20.0
# Frequencies of a line, between those that were asked for.
_DENSE = 300


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
    asked = np.unique(np.concatenate([curve.frequency for curve in curves]))
    wide = asked[-1] > _WIDE * asked[0]
    lines = (np.geomspace if wide else np.linspace)(asked[0], asked[-1], _DENSE)
    with style():
        figure = new_figure(7.5, 6.4)
        panels = figure.subplots(2, 1, sharex=True)
        for number, curve in enumerate(curves):
            color = (BLUE, RED, GREEN, ORANGE, BLACK)[number % 5]
            line = curve.model.stiffness(lines, curve.branches)
            for axes, between, value in zip(panels, _shown(line), _shown(curve.stiffness), strict=True):
                axes.plot(lines, between, "-" if number < 5 else "--", color=color)
                axes.plot(curve.frequency, value, "o", ms=3.0, color=color)
            panels[0].plot([], [], color=color, label=f"preload {preload_in_words(curve)}")
        panels[0].set(ylabel=f"|K*| [{stiffness_unit(curves[0].mode)}]")
        panels[1].set(ylabel="loss angle [deg]", xlabel="frequency [Hz]")
        if wide:
            panels[1].set_xscale("log")
            log_ticks(panels[1].xaxis, asked[0], asked[-1])
        legend(panels[0], loc="best")
        figure.suptitle(literal(words))
        figure.align_ylabels()
    return figure


def _shown(stiffness: Complex) -> tuple[Array, Array]:
    """Return |K*| and the loss angle in degrees."""
    return np.abs(stiffness), np.asarray(np.degrees(np.angle(stiffness)))
