"""Plots of a study: tornado, band of the curves, scatter and spread of the answers."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bushcli.report.document import Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.cycles import in_rows
from bushcli.report.plots.direct import around
from bushcli.report.plots.fit import bar
from bushcli.report.quantity import number, quantities
from bushcli.report.views.study import share_percent
from bushcli.study.analysis import Summary
from bushcli.study.bands import Band
from bushcli.study.study import Study

# Largest number of bars in a tornado diagram, of panels of the scatter plots across and down, and of characters of a
# value in words.
MOST_KEYS, ACROSS, DOWN, LONGEST = 12, 6, 6, 18
# Panels of scatter plots beside each other up to which the page can zoom them.
_ZOOMED = 3


def study_panels(found: Study) -> list[Panels]:
    """Return all plots of a study: tornado, bands, each answer over each key with a dot per design, histograms."""
    units = {one.name: one.unit for one in found.task.answers}
    labels = {name: f"{name} [{units[name]}]" if units[name] else name for name in found.summaries}
    made = []
    drawn = {name: one for name, one in found.summaries.items() if one.influences}
    if drawn:
        plots = [tornado_plot(one, labels[name], i) for i, (name, one) in enumerate(drawn.items())]
        made.append(
            Panels("tornado", "tornado", "Change of each answer by each key alone", in_rows(plots, 2))
        )
    made += [band_panels(found, one) for one in found.bands]
    if found.summaries and any(found.samples.values()):
        names = [name for name in found.summaries if name in found.samples]
        keys = [key for key in found.plan.keys if len(set(found.samples[key])) > 1][:ACROSS]
        keys = keys or [found.plan.keys[0]]
        rows = [
            [scatter_plot(found, name, key, labels[name], key == keys[0]) for key in keys]
            for name in names[:DOWN]
        ]
        is_many = len(keys) > _ZOOMED
        width = max(300.0, 900.0 / len(keys)) if is_many else 900.0 / len(keys)
        rows = [[replace(plot, width=width) for plot in row] for row in rows]
        made.append(Panels("scatter", "scatter", "Answers against the varied keys", rows, still=is_many))
        plots = [spread_plot(found, name, labels[name]) for name in names[: 2 * DOWN]]
        made.append(Panels("spread", "histogram", "Spread of the answers", in_rows(plots, 3)))
    return made


def _limits(found: Summary, axis: str) -> list[Stripe]:
    if found.limits is None:
        return []
    ends = [(v, v) for v in (found.limits.low, found.limits.high) if math.isfinite(v)]
    return [Stripe("limit", x=end) if axis == "x" else Stripe("limit", y=end) for end in ends]


def tornado_plot(found: Summary, label: str, index: int) -> Plot:
    """Return a bar per key for the change between its 5 % and 95 % quantiles, the longest on top."""
    ordered = sorted(found.influences.items(), key=lambda pair: -abs(pair[1].swing[1] - pair[1].swing[0]))
    chosen = ordered[:MOST_KEYS]
    regions = [
        Region(
            key, text, [bar(i, found.mean, found.mean + one.swing[end]) for i, (_, one) in enumerate(chosen)]
        )
        for end, (key, text) in enumerate((("bar_second", "key at its 5 %"), ("bar", "at its 95 %")))
    ]
    names = [
        (i, key if math.isnan(one.total) else f"{key}\nSobol {one.first:.2f}, total {one.total:.2f}")
        for i, (key, one) in enumerate(chosen)
    ]
    bands = [Stripe("level", x=(found.mean, found.mean)), *_limits(found, "x")]
    size, height = (len(chosen) - 0.5, -0.5), 90.0 + 44.0 * len(chosen)
    return Plot(f"answer-{index}", (label, ""), (), regions, bands, y=size, height=height, y_names=names)


def band_panels(found: Study, one: Band) -> Panels:
    """Return the median curve, and the bands that contain 90 % of the curves and all of them."""
    shown = quantities(dict(found.case.channels)[one.channel])
    q, (least, low, middle, high, most) = one.displacement, one.force
    # A loop is drawn in parts: between its turning points the displacement is monotonic.
    turns = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
    legs = [slice(first, last + 1) for first, last in pairwise([0, *map(int, turns), len(q) - 1])]
    regions = [
        Region("shaded", "all designs", [around(q[leg], least[leg], most[leg]) for leg in legs]),
        Region("range", "5 to 95 %", [around(q[leg], low[leg], high[leg]) for leg in legs]),
    ]
    title = f"{one.channel}: curves of {one.count} designs"
    file = "".join(c if c.isalnum() or c in "-_" else "_" for c in one.channel)[:50]
    series = [Series("after", "median", q, middle)]
    plot = Plot("band", shown.labels, series, regions, height=400.0)
    return Panels(f"band-{file}", "band", title, [[plot]], one.channel)


def scatter_plot(found: Study, name: str, key: str, label: str, first: bool) -> Plot:
    """Return one answer over one key, a dot for each design."""
    x, y = found.samples[key], np.array(found.samples[name], dtype=float)
    names: list[tuple[float, str]] = []
    if any(isinstance(value, str) for value in x):
        words = list(dict.fromkeys(str(value)[:LONGEST] for value in x))
        names = list(enumerate(words))
        x = [words.index(str(value)[:LONGEST]) for value in x]
    influence = found.summaries[name].influences.get(key)
    heading = "" if influence is None else f"rank correlation {influence.spearman:.2f}"
    dots, bands = Series("dot", "", np.array(x, dtype=float), y, "dots"), _limits(found.summaries[name], "y")
    labels = (key, label if first else "")
    return Plot(f"{name}-{key}", labels, [dots], (), bands, heading=heading, height=250.0, x_names=names)


def spread_plot(found: Study, name: str, label: str) -> Plot:
    """Return a histogram of an answer with its limits."""
    one = found.summaries[name]
    values = np.array(found.samples[name], dtype=float)
    bins = max(5, min(40, round(math.sqrt(len(values)))))
    if np.ptp(values) <= 1e-9 * abs(float(values.mean())):
        bins = 1
    count, edges = np.histogram(values[np.isfinite(values)], bins)
    boxes = [
        np.array([(a, 0), (b, 0), (b, n), (a, n)]) for (a, b), n in zip(pairwise(edges), count, strict=True)
    ]
    median = Stripe("level", x=(one.quantiles[1], one.quantiles[1]))
    heading = f"median {number(one.quantiles[1], 4)}"
    if one.limits is not None:
        heading = f"{share_percent(one.limits.share)} within"
    labels, top, bands = (label, "designs"), (0.0, 1.06 * float(count.max())), [median, *_limits(one, "x")]
    bars = [Region("bar", "", boxes)]
    return Plot(f"spread-{name}", labels, (), bars, bands, y=top, heading=heading, height=250.0)
