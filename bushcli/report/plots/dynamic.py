"""Plots of dynamic stiffness: |K*| and loss angle over frequency, a curve for each preload and amplitude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Panels, Plot, Series
from bushcli.report.plots.direct import SEPARATE, capital
from bushcli.report.views.dynamic import (
    amplitude_in_words,
    point_in_words,
    preload_in_words,
    stiffness_unit,
    title,
)

if TYPE_CHECKING:
    from bushcli.simulate.vibrations import DynamicCurve

# Frequencies that span more than this factor are drawn on a logarithmic axis.
WIDE = 20.0
# Frequencies of a line, between those that were asked for.
_DENSE = 300
# Colours of lines, after which they begin again.
COLOURS = 10


def dynamic_panels(curves: Sequence[DynamicCurve], names: Mapping[str, str]) -> list[Panels]:
    """Return the plots of each load case, of which the names of the files are given; a preload has a colour."""
    return [dynamic_panel([one for one in curves if one.name == name], file) for name, file in names.items()]


def dynamic_panel(curves: Sequence[DynamicCurve], file: str) -> Panels:
    """Return the plots of one load case."""
    asked = np.unique(np.concatenate([curve.frequency for curve in curves]))
    wide = bool(asked[-1] > WIDE * asked[0])
    lines = np.unique([*(np.geomspace if wide else np.linspace)(asked[0], asked[-1], _DENSE), *asked])
    size: list[Series] = []
    angle: list[Series] = []
    for number, curve in enumerate(curves):
        key, label = f"line-{number % COLOURS}", f"preload {preload_in_words(curve)}"
        if curve.amplitude is not None:
            label += f", amplitude {amplitude_in_words(curve)}"
        if curve.uneven is None:
            at, between = lines, curve.model.stiffness(lines, curve.branches)
        else:
            order = np.argsort(curve.frequency)
            at, between = curve.frequency[order], curve.stiffness[order]
        for series, function in ((size, np.abs), (angle, lambda K: np.degrees(np.angle(K)))):
            series.append(Series(key, label, at, function(between)))
            if len(curve.frequency) <= SEPARATE:
                series.append(Series(key, "", curve.frequency, function(curve.stiffness), "dots"))
    words = f"{capital(title(curves[0]))}: {point_in_words(curves[0])} and loss angle over frequency"
    unit = stiffness_unit(curves[0].mode)
    above = Plot("stiffness", ("", f"|K*| [{unit}]"), size, log="x" if wide else "")
    below = Plot("angle", ("frequency [Hz]", "loss angle [deg]"), angle, log=above.log)
    return Panels(f"{file}-dynamic", "dynamic", words, [[above], [below]], curves[0].name)
