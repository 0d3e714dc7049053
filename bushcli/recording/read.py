"""File of a rig -> Recording: read, convert to internal units (N, mm, MPa, s, rad), refuse impossible data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recording import ReadColumn, RecordedProgram, Recording, Repair
from bushcli.curve.segment import turning_points
from bushcli.curve.signals import select_cycles
from bushcli.errors import count_of
from bushcli.recording.find_table import open_table
from bushcli.recording.header.above import factor_remarks, rate_remarks
from bushcli.recording.header.columns import Column, chosen_index, column, untaken_time
from bushcli.recording.header.name import heading
from bushcli.recording.header.units import read_unit
from bushcli.recording.several import refuse_several
from bushcli.recording.six import motion_columns, recorded_path, six_table
from bushcli.recording.source import WARM, Quantity, Source
from bushcli.recording.specimen import nominal
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from bushcli.recording.time.cycle_count import cycle_count
from bushcli.recording.time.samples import program_times, samples_with_times
from cases.six import MOTIONS

Array = NDArray[np.float64]
#: Columns that were read, names of the others, and remarks on how they were read.
_Used = tuple[tuple[ReadColumn, ...], tuple[str, ...], tuple[Repair, ...]]

_FEWEST_BUSHING = 5
_FEWEST_COUPON = 3
_FEWEST_PROGRAM = 2
#: Share of its range by which a relaxing force may rise again, by noise or steps of the converter; judgement.
_BACK = 0.2
#: mm, rad, N, N mm, MPa: smaller values are not measurements, and quotients of them may overflow.
_SMALLEST = 1e-12


def read_recording(source: Source, tables: TableCache | None = None) -> Recording:
    """Read a recording of a bushing, or a test of a coupon: stretch - 1 over nominal stress, MPa.

    Parameters
    ----------
    source : Source
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    RecordingError
        With file, line and column, when something cannot be read; with the reason when fewer than 5 points
        remain (3 of a coupon), the time does not increase, or displacement or force never change. A row that
        repeats the one before it in time, displacement and force is left out instead, see ``repeated``.

    Returns
    -------
    Recording
        The cycles that the source names; ``record`` has all of them, because a response that depends on the path needs
        the earlier ones.
    """
    mode, tables = source.deformation, TableCache() if tables is None else tables
    fewest = _FEWEST_COUPON if mode.specimen == "coupon" else _FEWEST_BUSHING
    if source.six is None:
        table = open_table(source, ("displacement", "force"), tables)
    else:
        table = six_table(source, source.six.chosen, tables)
    stamps = column(table, source, "time")
    refuse_several(table, stamps)
    moved = _long_enough(table, source, fewest)
    forced = column(table, source, "force")
    assert forced is not None
    _refuse_still(table, moved, forced, stamps is not None or source.sample_rate is not None)
    samples = samples_with_times(table, source, stamps, moved, forced, fewest)
    displacement, force = moved.values[samples.rows], forced.values[samples.rows]
    if np.ptp(force) <= _SMALLEST:
        what = f"{table.label(forced.index)} is {table.text(0, forced.index)} throughout: was the sensor connected?"
        raise table.refusal(what)
    if mode.specimen == "coupon":
        displacement, force = nominal(source, displacement, force, moved.form, forced.form)
    if source.largest_stretch is not None:
        within = np.asarray(mode.stretch(displacement) <= source.largest_stretch)
        if np.count_nonzero(within) < min(fewest, len(within)):
            points = count_of(np.count_nonzero(within), "point")
            what = f"has {points} up to largest_stretch = {source.largest_stretch:g}"
            raise table.refusal(what, f"at least {fewest}")
        displacement, force, samples = displacement[within], force[within], samples.select(within)
    machine = mode.specimen == "coupon" and source.dimension("force") == "force"
    read_columns = {"displacement": moved, "force": forced} | ({"time": stamps} if stamps else {})
    path = None
    if source.six is not None:
        motions = motion_columns(table, source, source.six).items()
        free = source.six.free
        read_columns |= {MOTIONS[k]: c for k, c in motions if k not in free and c.index != moved.index}
        path = recorded_path(source, source.six, samples, tables)
    columns, unused, remarks = _used_columns(table, read_columns, source)
    recording = Recording(
        mode.name,
        displacement,
        force,
        samples.time,
        name=source.label,
        source=source.file,
        units=("", "") if machine else (moved.unit, forced.unit),
        repeated=tuple(table.line(i) for i in samples.repeated),
        repairs=(*samples.repairs, *remarks),
        conditioning=source.conditioning,
        columns=columns,
        unused=unused,
        accepted_faults=source.accepted_faults,
        six=path,
        temperature=_temperature_of(table, source, samples.rows),
    )
    count = cycle_count(table, samples.rows, recording)
    if count is not None:
        name = table.names[count[0]]
        columns += (ReadColumn("cycle", count[0] + 1, name, "", False),)
        unused = tuple(text for text in unused if text != name)
        recording = recording.with_cycle_numbers(count[1], columns, unused)
    return _used_cycles(recording, source)


def _temperature_of(table: Table, source: Source, rows: NDArray[np.int_]) -> Array | None:
    """Return the temperature at some rows, degrees C; None where the case names no column of it."""
    if source.temperature_column is None:
        return None
    index = chosen_index(table, source.temperature_column)
    name = heading(table.names[index])
    given = (source.temperature_unit, table.units[index], *name.written, name.at_end)
    texts = [text for text in given if text] or ["degC"]
    units = [unit for text in texts if (unit := read_unit(text)) and unit.measured == "temperature"]
    if not units:
        what = f"{table.label(index)}: {texts[0].strip('[]() ')} is no unit of a temperature"
        raise table.refusal(what, 'units = {temperature = "degC"}, "K" or "degF"')
    values = units[0].factor * table.numbers(index, source.accept)[rows] + units[0].zero
    beyond = np.flatnonzero(~((values >= WARM[0]) & (values <= WARM[1])))
    if len(beyond):
        row = int(rows[beyond[0]])
        what = f"{table.label(index)} is {table.text(row, index)}, {values[beyond[0]]:.4g} degrees C: no test of rubber"
        expected = 'give its unit, as in units = {temperature = "K"}; or leave the column out'
        raise table.refusal(what, expected, row)
    return np.asarray(values, dtype=np.float64)


def _used_columns(table: Table, used: Mapping[str, Column], source: Source) -> _Used:
    """Return the columns of a table by what was read of it."""
    taken = {column.index for column in used.values()}
    columns = tuple(
        ReadColumn(name, c.index + 1, table.names[c.index], c.unit, c.assumed) for name, c in used.items()
    )
    unused = tuple(name for i, name in enumerate(table.names) if name and i not in taken)
    remarks = [*table.remarks, *(text for column in used.values() for text in column.remarks)]
    remarks += factor_remarks(table, taken)
    if "time" not in used and not source.is_untimed:
        remarks += untaken_time(table, taken)
        remarks += rate_remarks(table) if source.sample_rate is None and source.rate is None else []
    return columns, unused, tuple(Repair("columns", text) for text in remarks)


def _used_cycles(recording: Recording, source: Source) -> Recording:
    """Return the cycles that are compared: the ones that the case names, without the conditioning cycles."""
    cycles = source.cycles
    if source.conditioning:
        last = max(branch.cycle for branch in recording.branches)
        if source.conditioning >= last:
            what = f"conditioning = {source.conditioning}, but the recording has {count_of(last, 'cycle')}"
            raise source.refusal(what, "leave at least one cycle to compare")
        requested = source.cycles or range(source.conditioning + 1, last + 1)
        cycles = tuple(cycle for cycle in requested if cycle > source.conditioning)
        if not cycles:
            what = f"conditioning = {source.conditioning} leaves none of the cycles that are to be used"
            raise source.refusal(what)
    return recording if cycles is None else select_cycles(recording, cycles)


def read_program(
    source: Source, tables: TableCache | None = None, quantity: Quantity = "displacement"
) -> RecordedProgram:
    """Read the program of a load case.

    Parameters
    ----------
    source : Source
    tables : TableCache, optional
        Cache of the binary files that the caller reads.
    quantity : str
        What the program prescribes: "displacement", or "force", which is then in the place of the displacement.

    Raises
    ------
    RecordingError
        As `read_recording` does, but two points are enough and the other quantity is not needed.
    """
    table = open_table(source, (quantity,), TableCache() if tables is None else tables)
    stamps = column(table, source, "time")
    moved = _long_enough(table, source, _FEWEST_PROGRAM, quantity)
    _refuse_still(table, moved)
    time: Array | None = None
    if stamps is not None:
        time = program_times(table, stamps)
    elif source.sample_rate is not None:
        time = np.arange(len(moved.values)) / source.sample_rate
    read_columns: dict[str, Column] = {quantity: moved}
    if stamps is not None:
        read_columns["time"] = stamps
    used = _used_columns(table, read_columns, source)
    return RecordedProgram(source.label, source.mode, time, moved.values, *used)


def _long_enough(table: Table, source: Source, fewest: int, quantity: Quantity = "displacement") -> Column:
    """Return the column of a quantity, or refuse it if it has too few points."""
    channel = column(table, source, quantity)
    assert channel is not None
    if len(channel.values) < fewest:
        what = f"has only {count_of(len(channel.values), 'point')}"
        raise table.refusal(what, f"at least {fewest}")
    return channel


def _refuse_still(table: Table, moved: Column, forced: Column | None = None, timed: bool = False) -> None:
    """Refuse a motion that never moves, but a hold in time: away from rest, at a force that falls and keeps its sign.

    A sensor of displacement that is dead shows the same displacement, but its force goes back and forth.
    """
    q, force = moved.values, np.zeros(2) if forced is None else forced.values
    falls = timed and abs(force[-1]) < abs(force[0]) and force[-1] * force[0] > 0.0
    still = np.ptp(q) <= max(1e-12 * np.abs(q).max(), _SMALLEST)
    if still and not (q[0] != 0.0 and falls and not turning_points(force, _BACK * np.ptp(force))):
        what = f"{table.label(moved.index)} is {table.text(0, moved.index)} throughout: nothing moves"
        rest = "a hold is read if the displacement counts from rest, the force relaxes, and the file has the times"
        raise table.refusal(what, "" if forced is None else rest)
