"""Tables and sections of cycles and holds."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bushcli.curve.cycles import Cycle, Uncertain
from bushcli.curve.holds import STANDARD_TIMES, Hold
from bushcli.report.cycles import ChannelHistory, energy_unit
from bushcli.report.quantity import number, quantities, with_std
from bushcli.report.tables import ReportTable, Row

# Largest number of rows on the terminal, and on the page; result.json has all.
FEW, MANY = 12, 100


def history_tables(histories: Sequence[ChannelHistory], *, brief: bool) -> list[ReportTable]:
    """Return tables of cycles and of holds, channel by channel.

    Parameters
    ----------
    histories : sequence of ChannelHistory
        Channels with cycles or holds.
    brief : bool
        Whether to shorten them for the terminal: no peak forces, and long tables without their middle rows.
    """
    tables = []
    for history in histories:
        tables.append(cycle_table(history, peaks=not brief))
        if history.holds:
            tables.append(hold_table(history))
    return [_shortened(table, FEW if brief else MANY) for table in tables]


def cycle_table(history: ChannelHistory, *, peaks: bool = True) -> ReportTable:
    """Return energy, loss, secant stiffness and peak force of each cycle, recorded beside simulated.

    Parameters
    ----------
    history : ChannelHistory
        One channel.
    peaks : bool
        Whether the table has peak forces.
    """
    shown, both = quantities(history.mode), history.has_recording
    timed = history.path.time is not None
    columns = [
        ("energy", f"energy, {energy_unit(history.mode)}", 1.0),
        ("loss", "loss, %", 100.0),
        ("secant", f"secant, {shown.stiffness_unit}", 1.0 / shown.per_internal),
        *([("peak_force", f"peak, {shown.force_unit}", 1.0)] if peaks else []),
    ]
    rows: list[Row] = []
    for known, recorded, simulated in history.cycles:
        path = f"{_plain(shown.at(known.lowest))} to {_plain(shown.at(known.highest))}"
        rate = (number(None if known.rate is None else shown.per_internal * known.rate),) if timed else ()
        cells = [
            cell
            for name, _, factor in columns
            for cell in _pair(_scaled(recorded, name, factor), _scaled(simulated, name, factor), both)
        ]
        rows.append((f"{known.number}{'' if known.closed else ' open'}", path, *rate, *cells))
    unit = shown.displacement_unit
    heads: Row = ("cycle", unit or shown.displacement, *((f"{unit or '1'}/s",) if timed else ()))
    return ReportTable(
        f"{_name(history)}: cycles, {_seen(both)}",
        heads + _paired([head for _, head, _ in columns], both),
        tuple(rows),
    )


def hold_table(history: ChannelHistory) -> ReportTable:
    """Return the force at the start of each hold and its relaxation, recorded beside simulated."""
    shown, both = quantities(history.mode), history.has_recording
    times = [at for at in STANDARD_TIMES if any(at in known.after for known, _, _ in history.holds)]
    rows: list[Row] = []
    for known, recorded, simulated in history.holds:
        cells = _pair(_scaled(recorded, "force_start", 1.0), _scaled(simulated, "force_start", 1.0), both)
        for at in (*times, None):
            cells += _pair(_lost(recorded, at), _lost(simulated, at), both)
        duration = "-" if known.duration is None else number(known.duration)
        rows.append((str(known.number), _plain(shown.at(known.displacement)), duration, *cells))
    values = [f"start, {shown.force_unit}", *(f"{at:g} s, %" for at in times), "end, %"]
    heads: Row = ("hold", f"at, {shown.displacement_unit or 'stretch'}", "s", *_paired(values, both))
    return ReportTable(
        f"{_name(history)}: force lost in holds after 1 s, 10 s, ..., {_seen(both)}", heads, tuple(rows)
    )


def _name(history: ChannelHistory) -> str:
    return f"{history.name} (held out)" if history.held_out else history.name


def _seen(both: bool) -> str:
    return "recorded ± standard error, and simulated (sim.)" if both else "simulated"


def _paired(heads: Sequence[str], both: bool) -> Row:
    return tuple(name for head in heads for name in ((head, "sim.") if both else (head,)))


def _scaled(found: Cycle | Hold | None, name: str, factor: float) -> Uncertain | None:
    if found is None:
        return None
    value: Uncertain = getattr(found, name)
    # No error of a peak: it is that of one sample, the same in every row.
    return Uncertain(factor * value.value, 0.0 if name == "peak_force" else factor * value.std)


def _lost(hold: Hold | None, at: float | None) -> Uncertain | None:
    """Return the relaxation in percent after a time in s, or at the end of the hold."""
    found = None if hold is None else hold.relaxation if at is None else hold.after.get(at)
    return None if found is None else Uncertain(100 * found.value, 100 * found.std)


def _pair(recorded: Uncertain | None, simulated: Uncertain | None, both: bool) -> list[str]:
    """Return a recorded value with its error, and the simulated value with as many digits."""
    std = recorded.std if recorded is not None and recorded.std > 0 else math.nan
    cells = []
    for found in (recorded, simulated) if both else (simulated,):
        if found is None or not math.isfinite(found.value):
            cells.append("-")
        elif found is recorded and found.std > 0:
            cells.append(with_std(found.value, found.std))
        else:
            text = with_std(found.value, std).split(" ± ")[0]
            cells.append(text.removeprefix("-") if float(text) == 0 else text)
    return cells


def _plain(value: float) -> str:
    # Two decimals are enough for noise about zero.
    return f"{float(f'{value:.2f}') + 0.0:g}"


def _shortened(table: ReportTable, most: int) -> ReportTable:
    if len(table.rows) <= most:
        return table
    tail = most // 4
    head = most - tail - 1
    gap = ("...", *("" for _ in table.heads[1:]))
    rows = (*table.rows[:head], gap, *table.rows[-tail:])
    return ReportTable(f"{table.title} ({len(table.rows)} in all)", table.heads, rows, table.left)
