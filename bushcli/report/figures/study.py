"""Pictures of a study: tornado, band of the curves, scatter and spread of the answers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    RED,
    Picture,
    legend,
    literal,
    new_figure,
    picture,
    style,
)
from bushcli.report.quantity import number, quantities
from bushcli.study.analysis import Summary
from bushcli.study.bands import Band
from bushcli.study.study import Study

# Largest number of bars in a tornado diagram, of panels of the scatter plots across and down, and of characters of a
# value in words.
MOST_KEYS, ACROSS, DOWN, LONGEST = 12, 6, 6, 18


def study_figures(found: Study) -> tuple[Picture, ...]:
    """Return all pictures of a study.

    Parameters
    ----------
    found : Study
    """
    units = {one.name: one.unit for one in found.task.answers}
    made: list[Picture] = []
    drawn = {name: one for name, one in found.summaries.items() if one.influences}
    if drawn:
        title = "Change of each answer by each key alone"
        made.append(picture("tornado", "tornado", title, tornado_figure(drawn, units)))
    for one in found.bands:
        title = f"{one.channel}: curves of {one.count} designs"
        made.append(
            picture(f"band-{_file(one.channel)}", "band", title, band_figure(found, one), one.channel)
        )
    if found.summaries and any(found.samples.values()):
        title = "Answers against the varied keys"
        made.append(picture("scatter", "scatter", title, scatter_figure(found, units)))
        made.append(picture("spread", "histogram", "Spread of the answers", spread_figure(found, units)))
    return tuple(made)


def _file(channel: str) -> str:
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in channel)[:50]


def _label(name: str, unit: str) -> str:
    return literal(f"{name} [{unit}]" if unit else name)


def tornado_figure(summaries: Mapping[str, Summary], units: Mapping[str, str]) -> Figure:
    """Draw a panel per answer: a bar per key for the change between its 5 % and 95 % quantiles, the longest on top.

    Parameters
    ----------
    summaries : mapping of str to Summary
        By answer.
    units : mapping of str to str
        By answer.
    """
    keys = max(min(len(one.influences), MOST_KEYS) for one in summaries.values())
    columns = min(2, len(summaries))
    rows = -(-len(summaries) // columns)
    with style():
        figure = new_figure(5.4 * columns, rows * (1.15 + 0.42 * keys))
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, (name, one) in zip(panels, summaries.items(), strict=False):
            _tornado(axes, one)
            axes.set_xlabel(_label(name, units[name]))
        for axes in panels[len(summaries) :]:
            axes.set_visible(False)
        return figure


def _tornado(axes: Axes, found: Summary) -> None:
    ordered = sorted(found.influences.items(), key=lambda pair: -abs(pair[1].swing[1] - pair[1].swing[0]))
    chosen = ordered[:MOST_KEYS]
    for i, (_, one) in enumerate(chosen):
        for change, colour in zip(one.swing, (ORANGE, BLUE), strict=True):
            axes.barh(i, change, left=found.mean, color=colour, height=0.6)
    labels = [
        key if math.isnan(one.total) else f"{key}\nSobol {one.first:.2f}, total {one.total:.2f}"
        for key, one in chosen
    ]
    axes.set_yticks(range(len(chosen)), [literal(label) for label in labels], fontsize=9)
    axes.axvline(found.mean, color=BLACK, lw=0.8)
    if found.limits is not None:
        _limits(axes, found)
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    ends = [Patch(color=ORANGE, label="key at its 5 %"), Patch(color=BLUE, label="at its 95 %")]
    # Placed above the panel, because bars and limits may be anywhere in it.
    above = (0.0, 1.0)
    axes.legend(handles=ends, loc="lower left", bbox_to_anchor=above, ncols=2, fontsize=8, borderaxespad=0.2)


def _limits(axes: Axes, found: Summary) -> None:
    assert found.limits is not None
    for value in (found.limits.low, found.limits.high):
        axes.axvline(value, color=RED, lw=1.1, ls="--")


def band_figure(found: Study, one: Band) -> Figure:
    """Draw the median curve, and the bands that contain 90 % of the curves and all of them.

    Parameters
    ----------
    found : Study
    one : Band
        Band of one channel; mm or degrees, N or N mm.
    """
    shown = quantities(dict(found.case.channels)[one.channel])
    q, (least, low, middle, high, most) = one.displacement, one.force
    with style():
        figure = new_figure(5.6, 4.2)
        axes = figure.subplots()
        # A loop is drawn in parts: between its turning points the displacement is monotonic.
        turns = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
        edges = [0, *map(int, turns), len(q) - 1]
        for number, (first, last) in enumerate(pairwise(edges)):
            leg, label = slice(first, last + 1), number == 0
            axes.fill_between(
                q[leg], least[leg], most[leg], color=LIGHT, lw=0, label="all designs" if label else None
            )
            axes.fill_between(
                q[leg],
                low[leg],
                high[leg],
                color=BLUE,
                alpha=0.35,
                lw=0,
                label="5 to 95 %" if label else None,
            )
        axes.plot(q, middle, color=BLUE, label="median")
        axes.set_xlabel(shown.displacement_label)
        axes.set_ylabel(shown.force_label)
        axes.set_title(literal(f"{one.channel}: {one.count} designs"))
        legend(axes, loc="upper left")
        return figure


def scatter_figure(found: Study, units: Mapping[str, str]) -> Figure:
    """Draw each answer over each key, with a dot per design.

    Parameters
    ----------
    found : Study
    units : mapping of str to str
        By answer.
    """
    names = [name for name in found.summaries if name in found.samples][:DOWN]
    keys = [key for key in found.plan.keys if len(set(found.samples[key])) > 1][:ACROSS] or [
        found.plan.keys[0]
    ]
    with style():
        figure = new_figure(1.1 + 2.6 * len(keys), 0.7 + 2.1 * len(names))
        panels = figure.subplots(len(names), len(keys), squeeze=False, sharex="col", sharey="row")
        for i, name in enumerate(names):
            for j, key in enumerate(keys):
                _scatter(panels[i][j], found, name, key)
            panels[i][0].set_ylabel(_label(name, units[name]))
        for j, key in enumerate(keys):
            panels[-1][j].set_xlabel(literal(key))
        return figure


def _scatter(axes: Axes, found: Study, name: str, key: str) -> None:
    x, y = found.samples[key], found.samples[name]
    words = any(isinstance(value, str) for value in x)
    at = [str(value)[:LONGEST] for value in x] if words else x
    axes.scatter(at, y, s=7, color=BLUE, alpha=0.55, lw=0, rasterized=True)
    if not words:
        # More ticks than these do not fit if dimensions have three decimals.
        axes.locator_params(axis="x", nbins=3)
    limits = found.summaries[name].limits
    if limits is not None:
        for value in (limits.low, limits.high):
            axes.axhline(value, color=RED, lw=1.0, ls="--")
    influence = found.summaries[name].influences.get(key)
    if influence is not None:
        axes.set_title(f"rank correlation {influence.spearman:.2f}", fontsize=8.5, fontweight="normal", pad=3)


def spread_figure(found: Study, units: Mapping[str, str]) -> Figure:
    """Draw a histogram of each answer with its limits.

    Parameters
    ----------
    found : Study
    units : mapping of str to str
        By answer.
    """
    names = [name for name in found.summaries if name in found.samples][: 2 * DOWN]
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    with style():
        figure = new_figure(3.7 * columns, 0.4 + 2.5 * rows)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
            one = found.summaries[name]
            values = np.array(found.samples[name], dtype=float)
            bins = max(5, min(40, round(math.sqrt(len(values)))))
            if np.ptp(values) <= 1e-9 * abs(float(values.mean())):
                bins = 1
            axes.hist(values, bins=bins, color=BLUE, alpha=0.8)
            axes.axvline(one.quantiles[1], color=BLACK, lw=1.2)
            if one.limits is not None:
                _limits(axes, one)
                colour = GREEN if one.limits.share > 0.99 else RED
                axes.set_title(f"{100 * one.limits.share:.1f} % within", fontsize=10, color=colour)
            else:
                axes.set_title(f"median {number(one.quantiles[1], 4)}", fontsize=10)
            axes.set_xlabel(_label(name, units[name]))
            axes.set_ylabel("designs")
        for axes in panels[len(names) :]:
            axes.set_visible(False)
        return figure
