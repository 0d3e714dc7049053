"""Cycles and holds of channels -> a section of a document."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from bushcli.curve.cycles import Cycle, Uncertain
from bushcli.curve.holds import STANDARD_TIMES, Hold
from bushcli.report.cycles import ChannelHistory, energy_unit, shown_values, times
from bushcli.report.document import Row, Section, Table, figures, note
from bushcli.report.quantity import Quantities, channel_label, number, quantities, with_std

# Largest number of rows on the terminal.
FEW = 12
_NOTE = (
    "Energy is the net work of a cycle, the area of its loop where it closes; loss is that energy over the work "
    "done while loading. ± is one standard error from the noise of the recording. A law without memory has "
    "neither loops nor relaxation."
)


def history_section(histories: Sequence[ChannelHistory]) -> Section:
    """Return cycles and holds channel by channel; without blocks where no path comes back or holds."""
    tables: list[Table] = []
    for history in histories:
        tables += [cycle_table(history), *([hold_table(history)] if history.holds else [])]
    return Section("Cycles and holds", [*tables, note(_NOTE), figures("cycles", "holds")])


def cycle_table(history: ChannelHistory) -> Table:
    """Return energy, loss, secant stiffness and peak force of each cycle, recorded beside simulated."""
    units, both = quantities(history.mode), history.has_recording
    timed, unit = history.path.time is not None, units.displacement_unit
    rows: list[Row] = []
    for cycle, recorded, simulated in history.cycles:
        path = f"{_plain(units.at(cycle.lowest))} to {_plain(units.at(cycle.highest))}"
        rate = (number(None if cycle.rate is None else units.per_internal * cycle.rate),) if timed else ()
        cells = _cells(shown_values(cycle, units), _values(recorded, units), _values(simulated, units), both)
        rows.append((f"{cycle.number}{'' if cycle.closed else ' open'}", path, *rate, *cells))
    heads: Row = ("cycle", unit or units.displacement, *((units.rate_unit,) if timed else ()))
    values = [f"energy, {energy_unit(history.mode)}", "loss, %", f"secant, {units.stiffness_unit}"]
    heads += _head_pairs([*values, f"peak, {units.force_unit}"], both)
    peaks = range(len(heads) - (2 if both else 1), len(heads))
    title = f"{channel_label(history.name, history.held_out)}: cycles, {_legend(both)}"
    return Table(title, heads, tuple(rows), detail=peaks, most=FEW)


def hold_table(history: ChannelHistory) -> Table:
    """Return the force at the start of each hold and its relaxation, recorded beside simulated."""
    units, both = quantities(history.mode), history.has_recording
    known_times = [time for time in STANDARD_TIMES if any(time in hold.after for hold, _, _ in history.holds)]
    rows: list[Row] = []
    for hold, recorded, simulated in history.holds:
        names = ("force_start", *(f"{time:g}" for time in known_times), "relaxation_percent")
        cells = _cells(names, _values(recorded, units), _values(simulated, units), both)
        duration = "-" if hold.duration is None else number(hold.duration)
        rows.append((str(hold.number), _plain(units.at(hold.displacement)), duration, *cells))
    values = [f"start, {units.force_unit}", *(f"{time:g} s, %" for time in known_times), "end, %"]
    heads: Row = ("hold", f"at, {units.displacement_unit or 'stretch'}", "s", *_head_pairs(values, both))
    channel = channel_label(history.name, history.held_out)
    title = f"{channel}: force lost in holds after 1 s, 10 s, ..., {_legend(both)}"
    return Table(title, heads, tuple(rows), most=FEW)


def _legend(both: bool) -> str:
    return "recorded ± standard error, and simulated (sim.)" if both else "simulated"


def _head_pairs(heads: Sequence[str], both: bool) -> Row:
    return tuple(name for head in heads for name in ((head, "sim.") if both else (head,)))


def _values(segment: Cycle | Hold | None, units: Quantities) -> dict[str, Uncertain]:
    """Return the values of a cycle or a hold by name, and the relaxation in percent by the time in s."""
    if segment is None:
        return {}
    values = shown_values(segment, units)
    if isinstance(segment, Hold):
        return values | {f"{time:g}": times(100.0, relaxation) for time, relaxation in segment.after.items()}
    # No error of a peak: it is that of one sample, the same in every row.
    return values | {"peak_force": Uncertain(segment.peak_force.value)}


def _cells(
    names: Iterable[str], recorded: Mapping[str, Uncertain], simulated: Mapping[str, Uncertain], both: bool
) -> list[str]:
    """Return of each name the recorded value with its error, and the simulated value with as many digits."""
    cells = []
    for measured, computed in ((recorded.get(name), simulated.get(name)) for name in names):
        std = measured.std if measured is not None and measured.std > 0 else math.nan
        for estimate in (measured, computed) if both else (computed,):
            if estimate is None or not math.isfinite(estimate.value):
                cells.append("-")
            elif estimate is measured and estimate.std > 0:
                cells.append(with_std(estimate.value, estimate.std))
            else:
                text = with_std(estimate.value, std).split(" ± ")[0]
                cells.append(text.removeprefix("-") if float(text) == 0 else text)
    return cells


def _plain(value: float) -> str:
    # Two decimals are enough for noise about zero.
    return f"{float(f'{value:.2f}') + 0.0:g}"
