"""Plots of many curves over each other: the parts of a batch with their band, and the results of a comparison."""

from __future__ import annotations

import numpy as np

from bushcli.errors import count_of
from bushcli.report.document import Panels, Plot, Region, Series
from bushcli.report.plots.direct import around, capital, colour, rest_lines
from bushcli.report.quantity import quantities
from bushcli.runtime.names import file_names
from bushcli.study.batch import Batch
from bushcli.study.compare import Comparison, ReactionHistory


def batch_panels(batch: Batch) -> list[Panels]:
    """Return the parts of each mode, their mean and the tolerance band."""
    panels = []
    for curve in batch.curves:
        units = quantities(curve.mode)
        parts = [part for part in batch.parts if part.mode == curve.mode]
        series = []
        for key, label, is_outlier in (("part", "parts", False), ("left_out", "outliers", True)):
            recordings = [part.recording for part in parts if bool(part.outlier) == is_outlier]
            if recordings:  # one series, with gaps, so that no line joins two curves
                q = np.concatenate([np.append(curve.displacement, np.nan) for curve in recordings])
                force = np.concatenate([np.append(curve.force, np.nan) for curve in recordings])
                series.append(Series(key, label, units.convert(q), force))
        q = units.convert(curve.mean.displacement)
        series.append(Series("after", "mean", q, curve.mean.force))
        # Up to the turning points, each of which belongs to both branches.
        legs = [slice(max(segment.start - 1, 0), segment.stop) for segment in curve.mean.segments]
        outlines = [around(q[leg], curve.lower[leg], curve.upper[leg]) for leg in legs]
        band = Region("range", "tolerance band", outlines)
        plot = Plot("curves", units.labels, series, [band], rest_lines(units), height=400.0)
        title = f"{capital(curve.mode)}: {count_of(curve.parts, 'part')}, their mean and the band of their tolerance"
        panels.append(Panels(f"{curve.mode}-batch", "curve", title, [[plot]], curve.mode))
    return panels


def compare_panels(comparison: Comparison) -> list[Panels]:
    """Return the curves of each channel."""
    panels, names = [], file_names(comparison.channels)
    for channel in comparison.channels:
        results = {i: item for i, item in enumerate(comparison.items) if channel in item.curves}
        series = []
        for i, item in results.items():
            curve = item.curves[channel]
            units = quantities(curve.mode)
            x = curve.time if isinstance(curve, ReactionHistory) else units.convert(curve.displacement)
            series.append(Series(colour(i), item.name, x, curve.force))
        label = "time [s]" if isinstance(curve, ReactionHistory) else units.displacement_label
        plot = Plot("curves", (label, units.force_label), series, bands=rest_lines(units))
        panels.append(Panels(f"{names[channel]}-compare", "curve", capital(channel), [[plot]], channel))
    return panels
