"""Pictures of a path: loops with energy and secant stiffness per cycle, and relaxation in holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bushcli.curve.cycles import Cycle, Uncertain
from bushcli.curve.holds import Hold
from bushcli.report.cycles import ChannelHistory, energy_unit
from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREY,
    Picture,
    legend,
    literal,
    log_ticks,
    new_figure,
    picture,
    style,
)
from bushcli.report.quantity import Quantities, number, percent, quantities

# Largest number of holds that are drawn: those that relax most.
_MOST = 6
# Up to this many cycles are drawn as bars, more as lines.
_BARS = 24
# Secants that differ by less than this share are drawn as one.
_SAME = 1e-5


def history_figures(histories: Sequence[ChannelHistory], names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return a picture of the loops of each channel, and one of its holds where the recording has time.

    Parameters
    ----------
    histories : sequence of ChannelHistory
        Channels with cycles or holds.
    names : mapping of str to str
        File name by channel name.
    """
    found = []
    for history in histories:
        file = names[history.name]
        found.append(
            picture(f"{file}-cycles", "cycles", cycle_title(history), cycle_figure(history), history.name)
        )
        if drawn_holds(history):
            title = hold_title(history)
            found.append(picture(f"{file}-holds", "holds", title, hold_figure(history), history.name))
    return tuple(found)


def cycle_title(history: ChannelHistory) -> str:
    """Return the title of the picture, with the energy of all closed cycles."""
    name = history.name[:1].upper() + history.name[1:]
    unit, std, parts = energy_unit(history.mode), 0.0, []
    for what, cycles in (("recorded", history.recorded), ("simulated", history.simulated)):
        closed = [cycle.energy for cycle in cycles if cycle is not None and cycle.closed]
        if closed:
            total = sum(energy.value for energy in closed)
            std = max(std, math.sqrt(sum(energy.std**2 for energy in closed)))
            # An energy within the noise of the recording counts as zero.
            parts.append(f"{number(total) if abs(total) > std else '0'} {unit} {what}")
    return f"{name}: loops dissipate {', '.join(parts)}" if parts else f"{name}: no closed loop"


def cycle_figure(history: ChannelHistory) -> Figure:
    """Draw the loops; beside them energy and secant stiffness of each cycle."""
    with style():
        figure = new_figure(11.0, 5.2)
        grid = figure.add_gridspec(2, 2, width_ratios=(1.15, 1))
        shown = quantities(history.mode)
        loops = figure.add_subplot(grid[:, 0])
        _loops(loops, history, shown)
        energy, secant = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
        _energy(energy, history)
        _secant(secant, history, shown)
        figure.align_ylabels([energy, secant])
        figure.suptitle(literal(cycle_title(history)), fontsize=12, fontweight="bold", x=0.01, ha="left")
        return figure


def _loops(axes: Axes, history: ChannelHistory, shown: Quantities) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=1)
    axes.axvline(shown.rest, color=GREY, lw=0.8, zorder=1)
    q = shown.shown(history.path.displacement)
    axes.plot(q, history.simulated_force, color=BLUE, lw=2.2, alpha=0.8, label="simulated", zorder=2)
    if history.has_recording:
        # On top and thin, so that both are visible where they agree.
        axes.plot(q, history.path.force, color=BLACK, lw=0.9, label="recorded", zorder=3)
    axes.set(xlabel=shown.displacement_label, ylabel=shown.force_label)
    legend(axes, loc="upper left")


def _energy(axes: Axes, history: ChannelHistory) -> None:
    """Draw the energies of the closed cycles; the work of open ones includes stored energy and would dwarf them."""
    series = [
        ("recorded", BLACK, {r.number: r.energy for _, r, _ in history.cycles if r is not None and r.closed}),
        ("simulated", BLUE, {s.number: s.energy for _, _, s in history.cycles if s is not None and s.closed}),
    ]
    _by_cycle(axes, series, history, bars=True)
    axes.axhline(0, color=GREY, lw=0.8, zorder=1)
    axes.set(ylabel=f"energy [{energy_unit(history.mode)}]")
    axes.margins(y=0.12)
    # Space for the legend above the bars and their errors.
    low, high = axes.get_ylim()
    if not any(one.value or one.std for _, _, found in series for one in found.values()):
        low, high = -1.0, 1.0
    axes.set_ylim(low, high + 0.2 * (high - low))
    legend(axes, loc="upper left", ncols=2)
    title = "hysteresis energy of closed cycles (error bars: ± 2 standard errors)"
    axes.set_title(title, fontsize=9, fontweight="normal", pad=4)


def _secant(axes: Axes, history: ChannelHistory, shown: Quantities) -> None:
    def values(cycles: Sequence[Cycle | None]) -> dict[int, Uncertain]:
        per = 1.0 / shown.per_internal
        return {
            c.number: Uncertain(per * c.secant.value, per * c.secant.std) for c in cycles if c is not None
        }

    series = [("recorded", BLACK, values(history.recorded)), ("simulated", BLUE, values(history.simulated))]
    _by_cycle(axes, series, history, bars=False)
    axes.set(xlabel="cycle", ylabel=f"secant [{shown.stiffness_unit}]")
    axes.set_title("secant stiffness, peak to peak of each cycle", fontsize=9, fontweight="normal", pad=4)
    axes.margins(y=0.15)
    low, high = axes.get_ylim()
    # A law without memory has one secant; its cycles differ by rounding only.
    if high - low < _SAME * max(abs(low), abs(high)):
        axes.set_ylim(min(0.95 * low, 1.05 * low), max(0.95 * high, 1.05 * high))


def _by_cycle(
    axes: Axes,
    series: Sequence[tuple[str, str, Mapping[int, Uncertain]]],
    history: ChannelHistory,
    bars: bool,
) -> None:
    bars = bars and len(history.cycles) <= _BARS
    series = [entry for entry in series if entry[2]]
    width = 0.8 / max(len(series), 1)
    for i, (label, colour, found) in enumerate(series):
        at = np.array(list(found), dtype=float)
        value = np.array([one.value for one in found.values()])
        error = 2.0 * np.array([one.std for one in found.values()])
        if bars:
            place = at + (i - 0.5 * (len(series) - 1)) * width
            # With an edge, so that a bar of zero height is visible.
            axes.bar(place, value, width, color=colour, edgecolor=colour, lw=1.5, label=label, zorder=2)
            if error.any():
                axes.errorbar(
                    place, value, error, fmt="none", ecolor="#8a929c", elinewidth=1.2, capsize=2.5, zorder=3
                )
        else:
            axes.errorbar(
                at, value, error if error.any() else None, color=colour, marker="o", ms=4, lw=1.2, label=label
            )
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12, min_n_ticks=1))
    axes.set_xlim(0.4, max((known.number for known, _, _ in history.cycles), default=1) + 0.6)
    axes.grid(False, axis="x")


def drawn_holds(history: ChannelHistory) -> list[tuple[Hold, Hold | None, Hold | None]]:
    """Return the holds that are drawn, in their order: if there are many, those with the largest change of force."""
    timed = [entry for entry in history.holds if entry[0].duration is not None]
    largest = sorted(timed, key=lambda entry: -abs(entry[0].force_start.value - entry[0].force_end.value))[
        :_MOST
    ]
    return [entry for entry in timed if entry in largest]


def hold_title(history: ChannelHistory) -> str:
    """Return the title of the picture, with the relaxation of the hold at the largest force."""
    name = history.name[:1].upper() + history.name[1:]
    std, parts = 0.0, []
    for what, holds in (("recorded", history.recorded_holds), ("simulated", history.simulated_holds)):
        # Of the hold at the largest force, because near zero force any share is large.
        held = [hold for hold in holds if hold is not None and math.isfinite(hold.relaxation.value)]
        if held:
            found = max(held, key=lambda hold: abs(hold.force_start.value)).relaxation
            std = max(std, found.std)
            parts.append(f"{percent(100 * found.value) if abs(found.value) > std else '0 %'} {what}")
    return (
        f"{name}: the held force relaxes by {', '.join(parts)}" if parts else f"{name}: no force in the holds"
    )


def hold_figure(history: ChannelHistory) -> Figure:
    """Draw the force over the logarithm of the time since the start of each hold."""
    with style():
        drawn, shown = drawn_holds(history), quantities(history.mode)
        columns = min(len(drawn), 3)
        lines = math.ceil(len(drawn) / columns)
        figure = new_figure(max(3.7 * columns, 5.0), 0.7 + 3.0 * lines)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, (hold, recorded, _) in zip(panels, drawn, strict=False):
            _relaxation(axes, history, hold, recorded, shown)
        for axes in panels[len(drawn) :]:
            axes.set_visible(False)
        for axes in panels[::columns]:
            axes.set_ylabel(shown.force_label)
        legend(panels[0], loc="best")
        figure.suptitle(literal(hold_title(history)), fontsize=12, fontweight="bold", x=0.01, ha="left")
        return figure


def _relaxation(
    axes: Axes, history: ChannelHistory, hold: Hold, recorded: Hold | None, shown: Quantities
) -> None:
    assert history.path.time is not None
    cut = slice(hold.start, hold.stop)
    since = history.path.time[cut] - history.path.time[hold.start]
    # A logarithmic axis has no zero: the start is drawn at half the time of the second sample.
    since[0] = 0.5 * since[1]
    axes.plot(since, history.simulated_force[cut], color=BLUE, lw=2.0, label="simulated", zorder=2)
    if recorded is not None:
        axes.plot(since, history.path.force[cut], "o", color=BLACK, ms=3.2, label="recorded", zorder=3)
    axes.set_xscale("log")
    axes.set_xlim(0.8 * since[0], 1.2 * since[-1])
    log_ticks(axes.xaxis, since[0], since[-1])
    at = shown.at(hold.displacement)
    where = (
        f"{float(f'{at:.2f}') + 0.0:g} {shown.displacement_unit}"
        if shown.displacement_unit
        else f"stretch {at:.3g}"
    )
    axes.set_title(f"hold {hold.number}, at {where}", fontsize=9.5, fontweight="normal", pad=4)
    axes.set_xlabel("time since the start of the hold [s]")
