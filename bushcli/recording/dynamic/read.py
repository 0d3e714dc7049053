"""Files of a dynamic test -> DynamicTable: a table as the rig wrote it, or the loops that it is made from."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, count_of
from bushcli.recording.dynamic.columns import (
    ERRORS,
    MEASURED,
    ColumnGroup,
    groups,
    key_of_unit,
    meanings,
    numbers,
    unit_of,
    with_conditions_above,
    with_names_above,
    with_values,
)
from bushcli.recording.dynamic.harmonics import LARGEST_DISTORTION, sines
from bushcli.recording.dynamic.lines import (
    conditions_above,
    conditions_between_rows,
    refuse_doubtful,
    remarks_on_lines,
    states_condition,
)
from bushcli.recording.dynamic.mixed import refuse_mixed_rows, with_merged_cells
from bushcli.recording.dynamic.names import Stated
from bushcli.recording.dynamic.peaks import FACTORS, Peak
from bushcli.recording.dynamic.source import HIGHEST, LOOP_COLUMNS, DynamicSource
from bushcli.recording.dynamic.stiffness import StiffnessColumns, complex_stiffness, missing_columns
from bushcli.recording.dynamic.table import (
    DynamicTable,
    Quantity,
    TablePart,
    level_numbers,
    refuse_rows,
    steps_of_levels,
)
from bushcli.recording.find_table import quoted_names, tables_of_file
from bushcli.recording.quantities import CONDITIONS, DYNAMIC
from bushcli.recording.read import read_recording
from bushcli.recording.several import own_rows
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]

#: Larger amplitudes of a strain are in percent: 100 % is beyond any dynamic test.
_LARGEST_STRAIN = 1.0
_PRELOADS = {"preload", "preload_force"}
#: Columns of the arrays of a `DynamicTable`.
_ARRAYS = ("frequency", "storage", "loss", *CONDITIONS[1:], *ERRORS, "third_harmonic")


def read_dynamic(source: DynamicSource, tables: TableCache | None = None) -> DynamicTable:
    """Read a table of dynamic stiffness, or make it from the loops that its files have.

    Parameters
    ----------
    source : DynamicSource
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    RecordingError
        With file, line and column, when something cannot be read, is not possible or contradicts itself; with the key
        of the case file that answers it, when the file does not say what its numbers are.
    """
    mode, tables = source.deformation, TableCache() if tables is None else tables
    parts = [part for file in source.files for part in _parts(file, source, tables)]
    if mode.specimen == "coupon" and source.quantity is None:
        if not mode.sheared and not all(part.modulus for part in parts):
            what = "has a modulus, and does not say whether it is Young's modulus E or the shear modulus G"
            expected = 'quantity = "E" or "G" in the recording\'s table of the case file'
            raise RecordingError(Problem(str(source.files[0]), what, "", expected))
        parts = [replace(part, modulus=part.modulus or "G") for part in parts]
    arrays = {key: np.concatenate([part.arrays[key] for part in parts]) for key in _ARRAYS}
    places = tuple(place for part in parts for place in part.places)
    arrays["amplitude"] = arrays["amplitude"] * source.amplitude_factor
    amplitude, temperature = arrays["amplitude"], arrays["temperature"]
    refuse_rows(
        amplitude == 0.0,
        places,
        "an amplitude of 0 has no response",
        "delete the row; without a column of amplitudes all are taken as small",
    )
    refuse_rows(
        amplitude > (_LARGEST_STRAIN if mode.specimen == "coupon" else math.inf),
        places,
        lambda row: f"a strain amplitude of {100 * amplitude[row]:.4g} % is not that of a dynamic test",
        'units = {amplitude = "percent"} in the recording\'s table, if the file has percent',
    )
    refuse_rows(
        temperature < -273.15,
        places,
        lambda row: f"a temperature of {temperature[row]:.4g} degrees C is below absolute zero",
        'units = {temperature = "°C"} or "K"',
    )
    moduli = {part.modulus for part in parts} - {""}
    if len(moduli) > 1:
        what = "some files have a modulus E and others a modulus G"
        raise RecordingError(Problem(str(source.files[0]), what, "", "one recording for each"))
    quantity: Quantity = "stiffness"
    if mode.specimen == "coupon":
        quantity = source.quantity or ("G" if "G" in moduli else "E")
    remarks = tuple(dict.fromkeys(text for part in parts for text in part.remarks))
    amplitude_is = {part.amplitude_is for part in parts}
    return DynamicTable(
        name=source.label,
        mode=source.mode,
        quantity=quantity,
        **arrays,
        files=source.files,
        places=places,
        remarks=remarks,
        accepted_faults=source.accepted_faults,
        amplitude_is=amplitude_is.pop() if len(amplitude_is) == 1 else "",
        units={key: unit for part in parts for key, unit in part.units.items() if unit is not None},
    )


def _parts(file: Path, source: DynamicSource, tables: TableCache) -> list[TablePart]:
    """Return the rows of one file: of all its sheets or groups that are tables of stiffness, or of its loops."""
    plain = Source(
        source.mode,
        file,
        source.label,
        delimiter=source.delimiter,
        decimal=source.decimal,
        group=source.group,
        rows=source.rows,
        between=states_condition,
    )
    if set(source.columns) & {"time", "displacement", "force"}:
        return _loops(source, plain, tables)
    names = [name for name in source.columns.values() if isinstance(name, str)]
    contents = tables_of_file(plain, names, tables)
    sheets = [contents] if isinstance(contents, Table) else contents.tables
    complete = (with_conditions_above(with_names_above(table)) for table in sheets)
    chosen = not set(MEASURED).isdisjoint(source.columns)
    fitting = [table for table in complete if chosen or {c.quantity for c in meanings(table)} & set(MEASURED)]
    if not fitting:
        return _loops(source, plain, tables)
    parts: list[TablePart] = []
    for table in fitting:
        # A column of conditions alone, such as the mean of all, is no group.
        measured = [group for group in groups(table, source) if set(MEASURED) & set(group.columns)]
        if not measured:
            raise missing_columns(table, ())
        taken = {index: key for group in measured for key, (index, _) in group.columns.items()}
        unused = [i for i, name in enumerate(table.names) if name and i not in taken]
        rows = own_rows(with_merged_cells(table, taken), plain)
        group_parts = []
        for group in measured:
            of_group = with_values(rows, group)
            part = _part(of_group, group, source)
            values = {key: part.arrays[key] for key in CONDITIONS}
            levels = [level_numbers(own, steps_of_levels(key, own)) for key, own in values.items()]
            refuse_mixed_rows(of_group, unused, levels)
            group_parts.append(part)
        if unused:
            remark = f"columns that are not used: {', '.join(table.names[i] for i in unused)}"
            group_parts[0] = replace(group_parts[0], remarks=(*group_parts[0].remarks, remark))
        parts += group_parts
    if len(fitting) > 1:
        together = quoted_names([table.part for table in fitting])
        remark = f"{file.name}: {len(fitting)} sheets or groups are read together: {together}"
        parts[0] = replace(parts[0], remarks=(remark, *parts[0].remarks))
    return parts


def _part(table: Table, group: ColumnGroup, source: DynamicSource) -> TablePart:
    """Return the rows of a group of columns, in internal units."""
    if not len(table):
        raise table.refusal("has a group of columns without values")
    # All that is asked is asked at once.
    arrays, of_columns, asked = _columns(table, group, source)
    remarks = [*table.remarks, *of_columns]
    stated = dict(group.conditions)
    known = {*group.columns, *stated, *(key for key in CONDITIONS if getattr(source, key) is not None)}
    wanted = [key for key in CONDITIONS if key not in known]
    peak: Peak = ""
    below: list[tuple[int, Stated]] = []
    try:
        stated |= conditions_above(table, source, wanted)
        below = conditions_between_rows(table, source, wanted)
        # A preload is stated once, as a force or as a displacement.
        first = {c.quantity for line, c in below if line < table.line(0)}
        settled = {*known, *stated, *first}
        refuse_doubtful(table, source, wanted, settled | (_PRELOADS if settled & _PRELOADS else set()))
        # An amplitude that is stated between the rows only is asked for, too.
        said = {c.quantity: c for _, c in reversed(below)} | stated
        peak = _peak(table, group, said, source)
    except RecordingError as error:
        asked += error.problems
    if asked:
        raise RecordingError(*asked)
    remarks += remarks_on_lines(table, source, wanted)
    for quantity in CONDITIONS:
        if quantity not in arrays:
            arrays[quantity] = np.full(len(table), _stated_value(table, quantity, stated, source))
    _set_below_lines(table, source, below, {key: arrays[key] for key in wanted}, peak)
    arrays["amplitude"] = np.abs(arrays["amplitude"]) * FACTORS[peak]
    places = tuple(table.place(row) for row in range(len(table)))
    _refuse_frequencies(table, source, arrays["frequency"], places)
    measured = {key: arrays.pop(key) for key in MEASURED if key in arrays}
    labels = {key: table.label(group.columns[key][0]) for key in measured}
    answers = source.stiffness_is, source.loss_angle_is
    columns = StiffnessColumns(measured, table, labels, places, arrays["frequency"], *answers)
    storage, loss, said_of = complex_stiffness(columns)
    unknown = np.full(len(table), np.nan)
    arrays |= {"storage": storage, "loss": loss, "third_harmonic": unknown}
    arrays = {key: arrays.get(key, unknown) for key in _ARRAYS}
    moduli = {name.modulus for quantity, (_, name) in group.columns.items() if quantity in MEASURED} - {""}
    modulus: Literal["E", "G", ""] = next(iter(moduli)) if len(moduli) == 1 else ""
    units = {key_of_unit(key): unit_of(group.columns[key][1], key, source) for key in measured}
    return TablePart(arrays, places, (*remarks, *said_of), modulus, "" if peak == "rms" else peak, units)


def _columns(
    table: Table, group: ColumnGroup, source: DynamicSource
) -> tuple[dict[str, Array], list[str], list[Problem]]:
    """Return the numbers (n,) of each column by quantity, in internal units, remarks, and what is asked about them."""
    arrays: dict[str, Array] = {}
    remarks: list[str] = []
    asked: list[Problem] = []
    for quantity, (index, column) in group.columns.items():
        try:
            arrays[quantity], remark = numbers(table, index, column, quantity, source)
            remarks += [remark] if remark else []
        except RecordingError as error:
            asked += error.problems
    return arrays, remarks, asked


def _refuse_frequencies(
    table: Table, source: DynamicSource, frequency: Array, places: tuple[str, ...]
) -> None:
    """Refuse frequencies (n,), Hz, that are missing or not possible."""
    # Moduli may come from shifts along temperature, which reach any frequency.
    highest = HIGHEST if source.deformation.specimen == "bushing" else math.inf
    if np.isnan(frequency).any():
        what = "has no column of a frequency, and neither its header nor the case file states one"
        expected = "frequency = ... (Hz) in the recording's table, or columns = {frequency = ...}"
        raise table.refusal(what, expected)
    refuse_rows(
        frequency <= 0.0,
        places,
        lambda row: f"a frequency of {frequency[row]:g} Hz has no cycle",
        "delete the row; a static stiffness comes from a recording of force over displacement",
    )
    refuse_rows(
        frequency > highest,
        places,
        lambda row: (
            f"{frequency[row]:.4g} Hz is beyond any dynamic test of a bushing, which ends at some kHz"
        ),
        'delete the row; or units = {frequency = "rad/s"} or "Hz", if the file has another unit',
    )


def _set_below_lines(
    table: Table,
    source: DynamicSource,
    below: Sequence[tuple[int, Stated]],
    arrays: Mapping[str, Array],
    peak: Peak,
) -> None:
    """Set the conditions (n,), by quantity, that lines between the rows state for the rows below."""
    numbers_of_rows = [table.line(row) for row in range(len(table))]
    beginning = [(bisect(numbers_of_rows, line), condition) for line, condition in below]
    for first, block in groupby(beginning, lambda pair: pair[0]):
        stated = {condition.quantity: condition for _, condition in block}
        # A preload in N ends one in mm.
        for key in _PRELOADS & set(arrays) if _PRELOADS & set(stated) else ():
            arrays[key][first:] = math.nan
        for key, c in stated.items():
            value = _stated_value(table, key, {key: c}, source)
            arrays[key][first:] = value * FACTORS[c.peak or peak] / FACTORS[peak]


def _stated_value(table: Table, quantity: str, stated: Mapping[str, Stated], source: DynamicSource) -> float:
    """Return a condition of all rows, as the case file or else the file states it, in internal units; or nan."""
    given = getattr(source, quantity)
    condition = stated.get(quantity) if given is None else None
    if condition is not None and condition.unit.measured not in DYNAMIC[quantity].kinds_in(
        source.deformation
    ):
        unit = f"a unit of a {condition.unit.measured}, which mode {source.mode} has not"
        what = f"states a {quantity.replace('_', ' ')} in {unit}"
        raise table.refusal(what, f"{quantity} = ... in the recording's table of the case file")
    return condition.value if condition is not None else math.nan if given is None else float(given)


def _peak(table: Table, group: ColumnGroup, stated: Mapping[str, Stated], source: DynamicSource) -> Peak:
    """Return what the file's amplitude is; ask for it where nothing says it, or what says it contradicts itself."""
    if "amplitude" in group.columns:
        index, column = group.columns["amplitude"]
        stated_peak, label = column.peak, table.label(index)
    elif source.amplitude is None and "amplitude" in stated:
        stated_peak, label = stated["amplitude"].peak, "the amplitude that the file states"
    else:
        return source.amplitude_is or "peak"
    if source.amplitude_is is not None and stated_peak and stated_peak != source.amplitude_is:
        what = f'{label} is the {stated_peak} amplitude, and the case file has amplitude_is = "{source.amplitude_is}"'
        raise table.refusal(what, "leave amplitude_is out, or name another column")
    peak = source.amplitude_is or stated_peak
    if not peak:
        others = "the double amplitude (peak to peak), or the root mean square"
        what = f"{label} may be the peak (half of the travel of a cycle), {others}"
        expected = 'amplitude_is = "peak", "double" or "rms" in the recording\'s table of the case file'
        raise table.refusal(what, expected)
    return peak


def _loops(source: DynamicSource, plain: Source, tables: TableCache) -> list[TablePart]:
    """Return the rows that the sine bursts of a file give."""
    mode = source.deformation
    # A line between the samples states nothing that holds for some of the bursts only.
    plain = replace(plain, between=None)
    columns = {key: value for key, value in source.columns.items() if key in LOOP_COLUMNS}
    units = {key: value for key, value in source.units.items() if key in LOOP_COLUMNS}
    stretches = sines(*_samples(replace(plain, columns=columns, units=units), tables))  # type: ignore[arg-type]
    fitted = [fit for stretch in stretches for fit in stretch]
    rows = [fit for fit in fitted if not fit.distortion > LARGEST_DISTORTION]
    unsteady = sum(not stretch for stretch in stretches)
    if not rows:
        what = "has no burst of at least three equal periods"
        if stretches:
            what = "has no sine, but other periodic motions" if fitted else "has no sine that stays as it is"
        others = "a sweep of frequency, or a triangle, gives no K*"
        expected = f"bursts of constant frequency and amplitude; {others}"
        raise plain.refusal(what, expected)
    remarks = [
        f"{plain.file.name}: {len(rows)} sine bursts give a row each, by a fit of harmonics to whole periods"
    ]
    if len(fitted) > len(rows):
        left = len(fitted) - len(rows)
        remarks.append(f"{plain.file.name}: {left} periodic motions that are no sine are left out")
    if unsteady:
        what = "whose frequency or amplitude changes within every three periods: left out"
        remarks.append(f"{plain.file.name}: {count_of(unsteady, 'periodic motion')} {what}")
    temperature = source.temperature
    if temperature is None:
        table = tables_of_file(plain, list(columns.values()), tables)
        temperature = math.nan
        if isinstance(table, Table):
            temperature = _temperature_of_loops(table, source)
            remarks += remarks_on_lines(table, source, ["temperature"])
    complex_ = np.array([sine.stiffness for sine in rows])
    arrays = {
        "frequency": np.array([sine.frequency for sine in rows]),
        "storage": complex_.real,
        "loss": complex_.imag,
        "amplitude": np.array([sine.amplitude for sine in rows]),
        "preload": np.array([sine.mean[0] for sine in rows]),
        "preload_force": np.array([sine.mean[1] for sine in rows]),
        "temperature": np.full(len(rows), temperature),
        "storage_error": np.array([sine.error for sine in rows]),
        "loss_error": np.array([sine.error for sine in rows]),
        "third_harmonic": np.array([sine.third for sine in rows]),
    }
    places = tuple(f"{plain.file}, {sine.span[0]:.4g} to {sine.span[1]:.4g} s" for sine in rows)
    refuse_rows(
        complex_.real <= 0.0,
        places,
        lambda row: f"the force runs against the motion: K' = {complex_[row].real:.4g}",
        "put the sign of the force right in the file; or the fixture's inertia is larger than the stiffness",
    )
    modulus: Literal["E", "G", ""] = "" if mode.specimen == "bushing" else "G" if mode.sheared else "E"
    return [TablePart(arrays, places, tuple(remarks), modulus)]


def _samples(source: Source, tables: TableCache) -> tuple[Array, Array, Array]:
    """Return time, displacement and force, (n,) each, of a file of loops."""
    try:
        record = read_recording(source, tables)
    except RecordingError as error:
        if source.columns:
            raise
        what = "is no table of dynamic stiffness (frequency, and two of |K*|, K', K'', loss angle, tan delta, damping)"
        what += f"; and as loops of time, displacement and force it cannot be read: {error}"
        keys = "columns = {frequency = ..., storage = ..., loss = ...}"
        expected = f"{keys} in the recording's table of the case file"
        raise source.refusal(what, expected) from None
    if record.time is None:
        what = "has loops without a time, so that their frequency is not known"
        raise source.refusal(what, "columns = {time = ...} in the case file")
    return record.time, record.displacement, record.force


def _temperature_of_loops(table: Table, source: DynamicSource) -> float:
    """Return the temperature, degrees C, that the lines above the samples state, or nan."""
    wanted = ["temperature"]
    above = conditions_above(table, source, wanted)
    stated = [(0, condition) for condition in above.values()]
    stated += conditions_between_rows(table, source, wanted)
    refuse_doubtful(table, source, wanted, wanted if stated else ())
    if stated and (len({condition.value for _, condition in stated}) > 1 or stated[0][0] > table.line(0)):
        what = f"line {stated[-1][0]} states a temperature of a part of the samples only"
        expected = (
            "temperature = ... in the recording's table of the case file, or a file for each temperature"
        )
        raise table.refusal(what, expected)
    return stated[0][1].value if stated else math.nan
