"""Pictures of a diagnosis: probabilities, values, curves, missing force, both maps, and the next test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, NextTest
from bushcli.mismatch.bins import KINDS, Bin
from bushcli.report.figures.diagnosis_curves import (
    BEST,
    changed,
    diagnosed_figure,
    diagnosed_title,
    force_range,
)
from bushcli.report.figures.diagnosis_map import map_figure, map_title
from bushcli.report.figures.diagnosis_missing import missing_figure
from bushcli.report.figures.diagnosis_probability import prior_figure, probability_figure, strips
from bushcli.report.figures.picture import BLACK, BLUE, GREY, Picture, literal, new_figure, picture, style
from bushcli.report.quantity import Quantities, quantities

Array = NDArray[np.float64]

# From ColorBrewer, safe for colour-blind eyes: orange where the simulation is too stiff, purple where it is too soft.
DIVERGING = "PuOr_r"
# Least end of the colour scale, in percent of the force range; a smaller one would show noise in full colours.
_LEAST = 0.2


def diagnosis_figures(found: Diagnosis, names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return every picture of a diagnosis.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    names : mapping of str to str
        File name by channel name, and by the name of each map.
    """
    drawn = []
    if found.probability and found.models:
        title = "Probability of each effect"
        drawn.append(picture("probabilities", "probabilities", title, probability_figure(found)))
    if strips(found):
        title = "Values with 95 % intervals: posterior and prior"
        drawn.append(picture("priors", "priors", title, prior_figure(found)))
    for channel in found.channels:
        file, title = names[channel.name], diagnosed_title(channel)
        figure = diagnosed_figure(found, channel)
        drawn.append(picture(f"{file}-diagnosis", "diagnosed", title, figure, channel.name))
        # A held-out channel is not fitted and may have no bins.
        if any(one.channel == channel.name for one in found.location.bins):
            title = f"{channel.name}: where in the record the simulation misses"
            figure = record_figure(found, channel)
            drawn.append(picture(f"{file}-record-map", "record_map", title, figure, channel.name))
        profiles = [] if found.missing is None else found.missing.profiles
        own = [one for one in profiles if one.channel == channel.name]
        if own:
            title = f"{channel.name}: what the most probable model leaves"
            figure = missing_figure(channel, own)
            drawn.append(picture(f"{file}-missing", "missing", title, figure, channel.name))
    for one in found.maps:
        file = f"{names[one.name]}-bushing-map"
        drawn.append(picture(file, "bushing_map", map_title(one), map_figure(one), one.name))
    if found.next_test is not None:
        title = f"Next test: {found.next_test.name}"
        drawn.append(picture("next-test", "next_test", title, next_test_figure(found, found.next_test)))
    return tuple(drawn)


def record_figure(found: Diagnosis, channel: DiagnosedChannel) -> Figure:
    """Draw the mean misfit by cycle, displacement and branch, for the plain law and for the most probable model.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    channel : DiagnosedChannel
        The channel to draw.
    """
    rows = [("plain law", [one for one in found.location.bins if one.channel == channel.name])]
    after = [one for one in found.remaining.bins if one.channel == channel.name]
    if after and changed(channel):
        rows.append((BEST, after))
    kinds = [kind for kind in KINDS if any(one.branch == kind for _, bins in rows for one in bins)]
    units = quantities(channel.mode)
    scale = 100.0 / force_range(channel)
    largest = max((abs(scale * one.mean) for one in rows[0][1]), default=_LEAST)
    norm = Normalize(-max(largest, _LEAST), max(largest, _LEAST))
    cycles = sorted({one.cycle for _, bins in rows for one in bins})
    with style():
        height = 0.8 + len(rows) * (0.75 + 0.24 * max(len(cycles), 2))
        figure = new_figure(1.4 + 3.1 * max(len(kinds), 1), height)
        panels = figure.subplots(len(rows), max(len(kinds), 1), sharex=True, sharey=True, squeeze=False)
        mappable = ScalarMappable(norm, DIVERGING)
        for line, (what, bins) in zip(panels, rows, strict=True):
            for axes, kind in zip(line, kinds, strict=True):
                _cells(axes, [one for one in bins if one.branch == kind], cycles, units, mappable, scale)
                axes.set_title(
                    literal(f"{channel.name}, {what}: {kind}"), fontsize=9.5, fontweight="normal", pad=4
                )
        for axes in panels[-1]:
            axes.set_xlabel(units.displacement_label)
        for axes in panels[:, 0]:
            axes.set_ylabel("cycle")
        bar = figure.colorbar(mappable, ax=panels, shrink=0.95, pad=0.015)
        bar.set_label("simulated force too small (-)\nor too large (+) [% of range]", fontsize=9)
        bar.outline.set_visible(False)  # type: ignore[operator]
        figure.supxlabel(
            "dots: more than noise, all bins tested together", fontsize=8.5, color=GREY, x=0.01, ha="left"
        )
        return figure


def _cells(
    axes: Axes,
    bins: Sequence[Bin],
    cycles: Sequence[tuple[int, int]],
    units: Quantities,
    colours: ScalarMappable,
    scale: float,
) -> None:
    """Draw one rectangle for each cycle and band; bins that differ in rate only are averaged, weighted by samples."""
    groups: dict[tuple[int, float, float], list[Bin]] = {}
    for one in bins:
        sign = 1.0 if one.side == "positive" else -1.0
        ends = sorted((sign * one.displacement_from, sign * one.displacement_to))
        groups.setdefault((cycles.index(one.cycle), ends[0], ends[1]), []).append(one)
    axes.grid(False)
    axes.set_facecolor("#f1f2f4")
    means, boxes, dots = [], [], []
    for (row, low, high), members in groups.items():
        count = sum(one.samples for one in members)
        away = 1.0 if members[0].side == "positive" else -1.0
        means.append(away * scale * sum(one.samples * one.mean for one in members) / count)
        x0, x1 = units.at(low), units.at(high)
        boxes.append([(x0, row - 0.5), (x1, row - 0.5), (x1, row + 0.5), (x0, row + 0.5)])
        if any(one.significant for one in members):
            dots.append(((x0 + x1) / 2, row))
    # One collection: a patch for each cell took a second of a report.
    filled = colours.to_rgba(np.array(means))
    axes.add_collection(PolyCollection(boxes, facecolors=filled, edgecolors="white", linewidths=0.6))
    axes.plot(*np.reshape(dots, (-1, 2)).T, "o", color=BLACK, ms=2.6)
    axes.autoscale_view()
    labels = [f"{a}" if a == b else f"{a}-{b}" for a, b in cycles]
    axes.set_yticks(range(len(cycles)), labels)
    axes.set_ylim(len(cycles) - 0.5, -0.5)
    axes.tick_params(length=0)
    axes.axvline(units.rest, color=GREY, lw=0.8)
    for spine in axes.spines.values():
        spine.set_visible(False)


def next_test_figure(found: Diagnosis, test: NextTest) -> Figure:
    """Draw the program of the proposed test: displacement over time.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    test : NextTest
        The proposed test.
    """
    mode = {one.name: one.mode for one in found.channels}.get(test.channel, test.channel)
    units = quantities(mode)
    time, q = program(test)
    minutes = time[-1] > 600.0
    with style():
        figure = new_figure(6.2, 2.4)
        axes = figure.add_subplot()
        axes.axhline(units.rest, color=GREY, lw=0.8, zorder=1)
        axes.plot(time / 60.0 if minutes else time, units.shown(q), color=BLUE, lw=1.8)
        axes.set(xlabel="time [min]" if minutes else "time [s]", ylabel=units.displacement_label)
        speeds = sorted({float(f"{units.per_internal * rate:.3g}") for rate in test.rates})
        unit = f"{units.displacement_unit}/s" if units.displacement_unit else "1/s"
        title = f"{test.channel} at {' and '.join(f'{v:g}' for v in speeds)} {unit}"
        axes.set_title(literal(title), fontsize=10, fontweight="normal")
        return figure


def program(test: NextTest) -> tuple[Array, Array]:
    """Return time (s) and displacement (mm or rad) at the corners of a test's path."""
    time, q = [0.0], [test.points[0]]
    for target, rate, hold in zip(test.points, (None, *test.rates), test.holds, strict=True):
        if rate is not None:
            time.append(time[-1] + abs(target - q[-1]) / rate)
            q.append(target)
        if hold > 0:
            time.append(time[-1] + hold)
            q.append(target)
    return np.array(time), np.array(q)
