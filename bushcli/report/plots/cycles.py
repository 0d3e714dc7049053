"""Plots of a path: loops with energy and secant stiffness per cycle, and relaxation in holds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bushcli.curve.cycles import Uncertain
from bushcli.curve.holds import Hold
from bushcli.report.cycles import ChannelHistory, energy_unit, shown_values
from bushcli.report.document import Array, Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.direct import box, capital, rest_lines
from bushcli.report.quantity import Quantities, number, percent, quantities

# Largest number of holds that are drawn: those that relax most.
_MOST = 6
# Up to this many cycles are drawn as bars, more as lines.
_BARS = 24
# Cycles whose number is at the axis.
_TICKS = 12
# Secants that differ by less than this share are drawn as one.
_SAME = 1e-5


def history_panels(histories: Sequence[ChannelHistory], names: Mapping[str, str]) -> list[Panels]:
    """Return the loops of each channel, and its holds where the recording has time."""
    panels = []
    for history in histories:
        panels.append(cycle_panels(history, names[history.name]))
        if any(hold.duration is not None for hold, _, _ in history.holds):
            panels.append(hold_panels(history, names[history.name]))
    return panels


def cycle_panels(history: ChannelHistory, file: str) -> Panels:
    """Return the loops; beside them energy and secant stiffness of each cycle."""
    name, units = capital(history.name), quantities(history.mode)
    unit, std, parts = energy_unit(history.mode), 0.0, []
    for key, by_number in _values(history, "energy", True).items():
        if closed := by_number.values():
            total = sum(energy.value for energy in closed)
            std = max(std, math.sqrt(sum(energy.std**2 for energy in closed)))
            # An energy within the noise of the recording counts as zero.
            parts.append(f"{number(total) if abs(total) > std else '0'} {unit} {_LABELS[key]}")
    title = f"{name}: loops dissipate {', '.join(parts)}" if parts else f"{name}: no closed loop"
    q = units.convert(history.path.displacement)
    series = [Series("recorded", "recorded", q, history.path.force)] if history.has_recording else []
    series.append(Series("after", "simulated", q, history.simulated_force))
    loops = Plot("loops", units.labels, series, bands=rest_lines(units), height=400.0)
    plots = [[loops], [energy_plot(history), secant_plot(history, units)]]
    return Panels(f"{file}-cycles", "cycles", title, plots, history.name)


def energy_plot(history: ChannelHistory) -> Plot:
    """Return the energies of the closed cycles; the work of open ones includes stored energy and would dwarf them."""
    energies = _values(history, "energy", True)
    heading = "hysteresis energy of closed cycles (error bars: ± 2 standard errors)"
    plot = _by_cycle(history, energies, "energy", f"energy [{energy_unit(history.mode)}]", heading)
    if not any(energy.value or energy.std for values in energies.values() for energy in values.values()):
        return replace(plot, y=(-1.0, 1.0))
    if len(history.cycles) > _BARS:
        return plot
    keys = [key for key in energies if energies[key]]
    width, bars, errors = 0.8 / max(len(keys), 1), [], []
    for i, key in enumerate(keys):
        at = np.array(list(energies[key])) + (i - 0.5 * (len(keys) - 1)) * width
        value, error = _bars(energies[key])
        boxes = [box((x - width / 2, x + width / 2), (0.0, v)) for x, v in zip(at, value, strict=True)]
        bars.append(Region(key, _LABELS[key], boxes))
        errors.append(Series("zero", "", at, np.where(error > 0, value, np.nan), error=error, mark="dots"))
    series = [series for series in errors if series.error is not None and series.error.any()]
    return replace(plot, regions=bars, series=series)


_LABELS = {"recorded": "recorded", "after": "simulated"}


def secant_plot(history: ChannelHistory, units: Quantities) -> Plot:
    """Return the secant stiffness of each cycle, recorded and simulated."""
    secants = _values(history, "secant_stiffness")
    heading = "secant stiffness, peak to peak of each cycle"
    plot = _by_cycle(history, secants, "secant", f"secant [{units.stiffness_unit}]", heading)
    stiffnesses = [secant.value for values in secants.values() for secant in values.values()]
    # A law without memory has one secant; its cycles differ by rounding only.
    if stiffnesses and max(stiffnesses) - min(stiffnesses) < _SAME * max(map(abs, stiffnesses)):
        return replace(plot, y=tuple(sorted((0.95 * stiffnesses[0], 1.05 * stiffnesses[0]))) or None)  # type: ignore[arg-type]
    return plot


def _values(history: ChannelHistory, name: str, closed: bool = False) -> dict[str, dict[int, Uncertain]]:
    """Return a value of the cycles, or of closed ones alone, by role ("recorded" or "after") and by their number."""
    units = quantities(history.mode)
    cycles = [cycle for cycle in history.cycles if cycle[0].closed or not closed]
    return {
        key: {cycle.number: shown_values(cycle, units)[name] for three in cycles if (cycle := three[i])}
        for i, key in enumerate(_LABELS, start=1)
    }


def _bars(values: Mapping[int, Uncertain]) -> tuple[Array, Array]:
    """Return the values, and two standard errors of each."""
    value, std = np.array([(entry.value, entry.std) for entry in values.values()]).reshape(-1, 2).T
    return value, 2.0 * std


def _by_cycle(
    history: ChannelHistory,
    curves: Mapping[str, Mapping[int, Uncertain]],
    name: str,
    label: str,
    heading: str,
) -> Plot:
    series = []
    for key, values in curves.items():
        if values:
            value, error = _bars(values)
            at = np.array(list(values), dtype=float)
            series.append(Series(key, _LABELS[key], at, value, "both", error))
    last = max((cycle.number for cycle, _, _ in history.cycles), default=1)
    span, step = (0.4, last + 0.6), -(-last // _TICKS)
    names = [(n, f"{n}") for n in range(1, last + 1, step)]
    zero, labels = [Stripe("zero", y=(0.0, 0.0))] if name == "energy" else [], ("cycle", label)
    return Plot(name, labels, series, x=span, bands=zero, heading=heading, width=450.0, x_names=names)


def hold_panels(history: ChannelHistory, file: str) -> Panels:
    """Return the force over the logarithm of the time since the start of the holds that relax most."""
    timed = [entry for entry in history.holds if entry[0].duration is not None]
    by_change = sorted(timed, key=lambda entry: -abs(entry[0].force_start.value - entry[0].force_end.value))
    holds = [entry for entry in timed if entry in by_change[:_MOST]]
    std, parts = 0.0, []
    for i, what in ((1, "recorded"), (2, "simulated")):
        # Of the hold at the largest force, because near zero force any share is large.
        held = [hold for three in history.holds if (hold := three[i])]
        if relaxing := [hold for hold in held if math.isfinite(hold.relaxation.value)]:
            relaxation = max(relaxing, key=lambda hold: abs(hold.force_start.value)).relaxation
            std = max(std, relaxation.std)
            share = percent(100 * relaxation.value) if abs(relaxation.value) > std else "0 %"
            parts.append(f"{share} {what}")
    what = f"the held force relaxes by {', '.join(parts)}" if parts else "no force in the holds"
    plots = in_rows([relaxation_plot(history, hold, recorded) for hold, recorded, _ in holds], 2)
    return Panels(f"{file}-holds", "holds", f"{capital(history.name)}: {what}", plots, history.name)


def in_rows(plots: Sequence[Plot], across: int) -> list[list[Plot]]:
    """Return the plots in rows of this number, all of the width that fills a row of the page."""
    width = 900.0 / min(across, max(len(plots), 1))
    wide = [replace(plot, width=width) for plot in plots]
    return [wide[i : i + across] for i in range(0, len(wide), across)]


def relaxation_plot(history: ChannelHistory, hold: Hold, recorded: Hold | None) -> Plot:
    """Return the force over the time of one hold, recorded and simulated."""
    assert history.path.time is not None
    units = quantities(history.mode)
    cut = slice(hold.start, hold.stop)
    since = history.path.time[cut] - history.path.time[hold.start]
    # A logarithmic axis has no zero: the start is drawn at half the time of the second sample.
    since[0] = 0.5 * since[1]
    series = []
    if recorded is not None:
        series.append(Series("recorded", "recorded", since, history.path.force[cut], "dots"))
    series.append(Series("after", "simulated", since, history.simulated_force[cut]))
    at = units.at(hold.displacement)
    unit = units.displacement_unit
    where = f"{float(f'{at:.2f}') + 0.0:g} {unit}" if unit else f"stretch {at:.3g}"
    heading, label = f"hold {hold.number}, at {where}", "time since the start of the hold [s]"
    return Plot(f"hold-{hold.number}", (label, units.force_label), series, heading=heading, log="x")
