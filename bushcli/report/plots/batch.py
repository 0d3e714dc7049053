"""Plots of a batch: the curves of its parts over each other, with their mean and the tolerance band."""

from __future__ import annotations

import numpy as np

from bushcli.report.document import Panels, Plot, Series
from bushcli.report.plots.direct import capital, rest_lines
from bushcli.report.quantity import quantities
from bushcli.study.batch import Batch


def batch_panels(found: Batch) -> list[Panels]:
    """Return a figure for each mode."""
    panels = []
    for curve in found.curves:
        shown = quantities(curve.mode)
        parts = [part for part in found.parts if part.mode == curve.mode]
        series = []
        for key, label, outlying in (("recorded", "parts", False), ("left_out", "outliers", True)):
            drawn = [part.recording for part in parts if bool(part.outlier) == outlying]
            # A gap between the curves, so that no line joins two of them.
            gap = [np.nan]
            if drawn:
                across = np.concatenate([[*shown.shown(one.displacement), *gap] for one in drawn])
                series.append(
                    Series(key, label, across, np.concatenate([[*one.force, *gap] for one in drawn]))
                )
        q = shown.shown(curve.mean.displacement)
        series += [
            Series("before", "tolerance band", np.r_[q, np.nan, q], np.r_[curve.lower, np.nan, curve.upper]),
            Series("after", "mean", q, curve.mean.force),
        ]
        plot = Plot("curves", (shown.displacement_label, shown.force_label), series, bands=rest_lines(shown))
        title = f"{capital(curve.mode)}: {curve.parts} parts, their mean and the band of their tolerance"
        panels.append(Panels(f"{curve.mode}-batch", "curve", title, [[plot]], curve.mode))
    return panels
