"""Raw loops of a dynamic test -> rows of a table: one for each sine burst."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from bushcli.errors import RecordingError
from bushcli.recording.dynamic.columns import above
from bushcli.recording.dynamic.harmonics import LARGEST_THIRD, bursts, harmonics
from bushcli.recording.dynamic.source import LOOP_COLUMNS, DynamicSource
from bushcli.recording.dynamic.table import TablePart, refuse_rows
from bushcli.recording.find_table import tables_of_file
from bushcli.recording.read import read_recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from cases.mode import modes


def read_loops(source: DynamicSource, plain: Source, tables: TableCache) -> list[TablePart]:
    """Return the rows that the sine bursts of a file give."""
    mode = modes()[source.mode]
    columns = {key: value for key, value in source.columns.items() if key in LOOP_COLUMNS}
    units = {key: value for key, value in source.units.items() if key in LOOP_COLUMNS}
    try:
        record = read_recording(replace(plain, columns=columns, units=units), tables)  # type: ignore[arg-type]
    except RecordingError as error:
        if columns:
            raise
        what = "is no table of dynamic stiffness (frequency, and two of |K*|, K', K'', loss angle, tan delta, damping)"
        what += f"; and as loops of time, displacement and force it cannot be read: {error}"
        expected = (
            "columns = {frequency = ..., storage = ..., loss = ...} in the recording's table of the case file"
        )
        raise plain.refusal(what, expected) from None
    if record.time is None:
        what = "has loops without a time, so that their frequency is not known"
        raise plain.refusal(what, "columns = {time = ...} in the case file")
    time, moved, force = record.time, record.displacement, record.force
    fitted = [
        fit for burst in bursts(time, moved) if (fit := harmonics(time, moved, force, burst)) is not None
    ]
    sines = [fit for fit in fitted if not fit.third_motion > LARGEST_THIRD]
    if not sines:
        what = f"has {'no sine, but other periodic motions' if fitted else 'no burst of at least three equal periods'}"
        expected = (
            "bursts of constant frequency and amplitude; a sweep of frequency, or a triangle, gives no K*"
        )
        raise plain.refusal(what, expected)
    remarks = [
        f"{plain.file.name}: {len(sines)} sine bursts give a row each, by a fit of harmonics to whole periods"
    ]
    if len(fitted) > len(sines):
        remarks.append(
            f"{plain.file.name}: {len(fitted) - len(sines)} periodic motions that are no sine are left out"
        )
    temperature = source.temperature
    if temperature is None:
        table = tables_of_file(plain, list(columns.values()), tables)
        stated = above(table).get("temperature") if isinstance(table, Table) else None
        temperature = np.nan if stated is None else stated.value
    complex_ = np.array([sine.stiffness for sine in sines])
    arrays = {
        "frequency": np.array([sine.frequency for sine in sines]),
        "storage": complex_.real,
        "loss": complex_.imag,
        "amplitude": np.array([sine.amplitude for sine in sines]),
        "preload": np.array([sine.mean[0] for sine in sines]),
        "preload_force": np.array([sine.mean[1] for sine in sines]),
        "temperature": np.full(len(sines), temperature),
        "storage_error": np.array([sine.error for sine in sines]),
        "loss_error": np.array([sine.error for sine in sines]),
        "third_harmonic": np.array([sine.third for sine in sines]),
    }
    places = tuple(f"{plain.file}, {sine.span[0]:.4g} to {sine.span[1]:.4g} s" for sine in sines)
    refuse_rows(
        complex_.real <= 0.0,
        places,
        lambda row: f"the force runs against the motion: K' = {complex_[row].real:.4g}",
        "put the sign of the force right in the file; or the fixture's inertia is larger than the stiffness",
    )
    modulus: Literal["E", "G", ""] = "" if mode.specimen == "bushing" else "G" if mode.sheared else "E"
    return [TablePart(arrays, places, tuple(remarks), modulus)]
