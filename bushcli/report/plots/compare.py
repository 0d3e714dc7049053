"""Plots of a comparison: the curves of each channel over each other."""

from __future__ import annotations

from bushcli.report.document import Panels, Plot, Series
from bushcli.report.plots.direct import capital, rest_lines
from bushcli.report.quantity import quantities
from bushcli.runtime.names import file_names
from bushcli.study.compare import Comparison

# Colours of lines, after which they begin again.
_COLOURS = 10


def compare_panels(found: Comparison) -> list[Panels]:
    """Return a figure for each channel."""
    panels, names = [], file_names(found.channels)
    for channel in found.channels:
        drawn = [(i, item) for i, item in enumerate(found.items) if channel in item.curves]
        shown = quantities(drawn[0][1].curves[channel].mode)
        series = [
            Series(
                f"line-{i % _COLOURS}",
                item.name,
                shown.shown(item.curves[channel].displacement),
                item.curves[channel].force,
            )
            for i, item in drawn
        ]
        plot = Plot("curves", (shown.displacement_label, shown.force_label), series, bands=rest_lines(shown))
        panels.append(Panels(f"{names[channel]}-compare", "curve", capital(channel), [[plot]], channel))
    return panels
