"""Plots of a study: tornado, band of the curves, scatter and spread of the answers."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bushcli.errors import count_of
from bushcli.report.document import Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.cycles import in_rows
from bushcli.report.plots.direct import around, bar, box, capital
from bushcli.report.quantity import number, quantities
from bushcli.report.views.study import by_swing, share_percent
from bushcli.study.analysis import Band, Summary
from bushcli.study.study import Study

# Largest number of bars in a tornado diagram, of panels of the scatter plots across and down, and of characters of a
# value in words.
MOST_KEYS, ACROSS, DOWN, LONGEST = 12, 6, 6, 18
# Panels of scatter plots beside each other up to which the page can zoom them.
_ZOOMED = 3


def study_panels(study: Study) -> list[Panels]:
    """Return all plots of a study: tornado, bands, each answer over each key with a dot per design, histograms."""
    units = {answer.name: answer.unit for answer in study.task.answers}
    labels = {name: f"{name} [{units[name]}]" if units[name] else name for name in study.summaries}
    panels = []
    drawn = {name: summary for name, summary in study.summaries.items() if summary.influences}
    if drawn:
        plots = [tornado_plot(summary, labels[name], i) for i, (name, summary) in enumerate(drawn.items())]
        title = "Change of each answer by each key alone"
        panels.append(Panels("tornado", "tornado", title, in_rows(plots, 2)))
    panels += [band_panels(study, band) for band in study.bands]
    if study.summaries and any(study.samples.values()):
        names = [name for name in study.summaries if name in study.samples]
        keys = [key for key in study.plan.keys if len(set(study.samples[key])) > 1][:ACROSS]
        keys = keys or [study.plan.keys[0]]
        is_many = len(keys) > _ZOOMED
        width = max(300.0, 900.0 / len(keys)) if is_many else 900.0 / len(keys)
        rows = [
            [
                replace(scatter_plot(study, name, key, labels[name], key == keys[0]), width=width)
                for key in keys
            ]
            for name in names[:DOWN]
        ]
        panels.append(Panels("scatter", "scatter", "Answers against the varied keys", rows, still=is_many))
        plots = [spread_plot(study, name, labels[name]) for name in names[: 2 * DOWN]]
        panels.append(Panels("spread", "histogram", "Spread of the answers", in_rows(plots, 3)))
    return panels


def _limits(summary: Summary, axis: str) -> list[Stripe]:
    if summary.limits is None:
        return []
    ends = [(v, v) for v in (summary.limits.low, summary.limits.high) if math.isfinite(v)]
    return [Stripe("limit", x=end) if axis == "x" else Stripe("limit", y=end) for end in ends]


def tornado_plot(summary: Summary, label: str, index: int) -> Plot:
    """Return a bar per key for the change between its 5 % and 95 % quantiles, the longest on top."""
    chosen, mean = by_swing(summary)[:MOST_KEYS], summary.mean
    regions = [
        Region(key, text, [bar(i, mean, mean + change.swing[end]) for i, (_, change) in enumerate(chosen)])
        for end, (key, text) in enumerate((("bar_second", "key at its 5 %"), ("bar", "at its 95 %")))
    ]
    names = []
    for i, (key, influence) in enumerate(chosen):
        indices = f"\nSobol {influence.first:.2f}, total {influence.total:.2f}"
        names.append((i, key if math.isnan(influence.total) else key + indices))
    bands = [Stripe("level", x=(summary.mean, summary.mean)), *_limits(summary, "x")]
    size, height = (len(chosen) - 0.5, -0.5), 90.0 + 44.0 * len(chosen)
    return Plot(f"answer-{index}", (label, ""), (), regions, bands, y=size, height=height, y_names=names)


def band_panels(study: Study, band: Band) -> Panels:
    """Return the median curve, and the bands that contain 90 % of the curves and all of them."""
    units = quantities(dict(study.case.channels)[band.channel])
    q, (least, low, middle, high, most) = band.displacement, band.force
    # A loop is drawn in parts: between its turning points the displacement is monotonic.
    turns = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
    legs = [slice(start, end + 1) for start, end in pairwise([0, *map(int, turns), len(q) - 1])]
    regions = [
        Region("shaded", "all designs", [around(q[leg], least[leg], most[leg]) for leg in legs]),
        Region("range", "5 to 95 %", [around(q[leg], low[leg], high[leg]) for leg in legs]),
    ]
    title = f"{capital(band.channel)}: curves of {count_of(band.count, 'design')}"
    file = "".join(c if c.isalnum() or c in "-_" else "_" for c in band.channel)[:50]
    series = [Series("after", "median", q, middle)]
    plot = Plot("band", units.labels, series, regions, height=400.0)
    return Panels(f"band-{file}", "band", title, [[plot]], band.channel)


def scatter_plot(study: Study, name: str, key: str, label: str, is_first: bool) -> Plot:
    """Return one answer over one key, a dot for each design."""
    x, y = study.samples[key], np.array(study.samples[name], dtype=float)
    names: list[tuple[float, str]] = []
    if any(isinstance(value, str) for value in x):
        words = list(dict.fromkeys(str(value)[:LONGEST] for value in x))
        names = list(enumerate(words))
        x = [words.index(str(value)[:LONGEST]) for value in x]
    influence = study.summaries[name].influences.get(key)
    heading = "" if influence is None else f"rank correlation {influence.spearman:.2f}"
    dots, bands = Series("dot", "", np.array(x, dtype=float), y, "dots"), _limits(study.summaries[name], "y")
    labels = (key, label if is_first else "")
    return Plot(f"{name}-{key}", labels, [dots], (), bands, heading=heading, height=250.0, x_names=names)


def spread_plot(study: Study, name: str, label: str) -> Plot:
    """Return a histogram of an answer with its limits."""
    summary = study.summaries[name]
    values = np.array(study.samples[name], dtype=float)
    bins = max(5, min(40, round(math.sqrt(len(values)))))
    if np.ptp(values) <= 1e-9 * abs(float(values.mean())):
        bins = 1
    count, edges = np.histogram(values[np.isfinite(values)], bins)
    boxes = [box(ends, (0.0, n)) for ends, n in zip(pairwise(edges), count, strict=True)]
    median = Stripe("level", x=(summary.quantiles[1], summary.quantiles[1]))
    heading = f"median {number(summary.quantiles[1], 4)}"
    if summary.limits is not None:
        heading = f"{share_percent(summary.limits.share)} within"
    bars, bands = [Region("bar", "", boxes)], [median, *_limits(summary, "x")]
    top, labels = (0.0, 1.06 * float(count.max())), (label, "designs")
    return Plot(f"spread-{name}", labels, (), bars, bands, y=top, heading=heading, height=250.0)
