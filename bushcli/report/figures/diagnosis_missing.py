"""Picture of the misfit that the most probable model leaves: by displacement and branch, time, cycle and rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedChannel
from bushcli.mismatch.maps import MissingProfile
from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    literal,
    log_ticks,
    new_figure,
    style,
)
from bushcli.report.quantity import Quantities, quantities

Array = NDArray[np.float64]

# Quantities in the order in which they are drawn.
_ALONG = ("displacement", "time", "cycle", "rate")
_BRANCHES = {"": (BLACK, "all"), "loading": (BLUE, "loading"), "unloading": (ORANGE, "unloading")} | {
    "hold": (GREEN, "hold")
}
# Rates that span more than this factor are drawn on a logarithmic axis.
_WIDE = 5.0
# Up to this many points are drawn separately, with error bars.
_FEW = 12


def missing_figure(channel: DiagnosedChannel, profiles: Sequence[MissingProfile]) -> Figure:
    """Draw one panel for each quantity: the mean and a band of two standard deviations to either side.

    Parameters
    ----------
    channel : DiagnosedChannel
        The channel to draw.
    profiles : sequence of MissingProfile
        Misfit that the most probable model leaves in this channel, along each quantity.
    """
    kinds = [along for along in _ALONG if any(one.along == along for one in profiles)]
    across = 1 if len(kinds) == 1 else 2
    down = -(-len(kinds) // across)
    units = quantities(channel.mode)
    with style():
        figure = new_figure(5.4 if across == 1 else 8.6, 0.5 + 2.7 * down)
        panels = figure.subplots(down, across, sharey=True, squeeze=False).ravel()
        for axes, along in zip(panels, kinds, strict=False):
            _panel(axes, [one for one in profiles if one.along == along], units)
        for axes in panels[len(kinds) :]:
            axes.set_visible(False)
        for axes in panels[:: across if across > 1 else 1]:
            axes.set_ylabel("recorded - simulated\n[% of the force range]", fontsize=9.5)
        figure.suptitle(
            literal(f"{channel.name}: what the most probable model leaves"),
            fontsize=11,
            fontweight="bold",
            x=0.01,
            ha="left",
        )
        figure.supxlabel(
            "bands and bars: two standard deviations to either side",
            fontsize=8.5,
            color=GREY,
            x=0.01,
            ha="left",
        )
        return figure


def _panel(axes: Axes, profiles: Sequence[MissingProfile], units: Quantities) -> None:
    along = profiles[0].along
    axes.axhline(0, color=GREY, lw=0.8, zorder=1)
    for one in profiles:
        colour, name = _BRANCHES.get(one.branch, (BLACK, one.branch))
        label = name if len(profiles) > 1 else None
        x = _x(one, units)
        order = np.argsort(x)
        x, mean, two = x[order], one.mean[order], 2 * one.std[order]
        if along in ("cycle", "rate") and len(x) <= _FEW:
            axes.errorbar(x, mean, two, color=colour, fmt="o", ms=4.5, lw=1.2, capsize=3, label=label)
            axes.plot(x, mean, color=colour, lw=0.8, alpha=0.5)
        else:
            axes.fill_between(x, mean - two, mean + two, color=colour, alpha=0.18, lw=0)
            axes.plot(x, mean, color=colour, lw=1.8, label=label)
    axes.set_xlabel(_label(along, units))
    if along == "cycle":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.margins(x=0.08)
    if along == "rate":
        x = np.concatenate([_x(one, units) for one in profiles])
        if x.min() > 0 and x.max() > _WIDE * x.min():
            axes.set_xscale("log")
            axes.set_xlim(x.min() / 1.5, x.max() * 1.5)
            log_ticks(axes.xaxis, *axes.get_xlim())
        else:
            axes.margins(x=0.15)
    if len(profiles) > 1:
        axes.legend(fontsize=8.5, loc="best")


def _x(one: MissingProfile, units: Quantities) -> Array:
    if one.along == "displacement":
        return np.asarray(units.shown(one.x))
    return np.asarray(one.x * (units.per_internal if one.along == "rate" else 1.0))


def _label(along: str, units: Quantities) -> str:
    per_second = f"{units.displacement_unit}/s" if units.displacement_unit else "1/s"
    return {
        "displacement": units.displacement_label,
        "time": "time [s]",
        "cycle": "cycle",
        "rate": f"rate [{per_second}]",
    }[along]
