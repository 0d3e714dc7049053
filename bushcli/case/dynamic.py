"""Recordings of the kind "dynamic": their tables in a case file, checked and converted to sources."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from bushcli.case.as_json import in_degrees
from bushcli.case.finding import Finding, Keys, wrong_key, wrong_value
from bushcli.case.loads import unused_name
from bushcli.case.schema import DELIMITERS, CaseTable, ColumnKey, Delimiter, Name, optional
from bushcli.errors import nearest
from bushcli.recording.dynamic.source import COLUMNS, LOOP_COLUMNS, DynamicSource
from cases.mode import modes

KIND = "dynamic"
#: Keys that the case file gives in degrees where the mode turns.
_TURNED = ("amplitude", "preload")
_AS_GIVEN = (
    *("frequency", "preload_force", "temperature", "decimal", "group"),
    *("amplitude_is", "stiffness_is", "loss_angle_is", "across", "quantity"),
)


class DynamicRecordingTable(CaseTable):
    """``[[recordings]]`` and ``[[coupons]]`` with ``kind = "dynamic"``."""

    kind: Literal["dynamic"] = Field(description="a table of dynamic stiffness, or the loops of sine bursts")
    mode: str = Field(description="a mode, see bushcli list modes")
    file: Name = Field(description="file of a rig, or a pattern of files, one for each condition")
    name: Name | None = optional("name of the channel; absent = the mode")
    columns: dict[str, ColumnKey] | None = optional(
        f"column by name or number: {', '.join((*COLUMNS, *LOOP_COLUMNS))}"
    )
    units: dict[str, str] | None = optional("unit by column")
    delimiter: Delimiter | None = None
    decimal: Literal[".", ","] | None = None
    group: ColumnKey | None = optional("sheet or group of the file")
    rows: dict[str, str | float] | None = optional("value, by column, of the rows that belong to the table")
    amplitude_is: Literal["peak", "double", "rms"] | None = optional(
        "what the file calls amplitude: the peak, peak to peak, or the root mean square"
    )
    stiffness_is: Literal["magnitude", "storage"] | None = optional(
        "what the file calls stiffness or modulus: |K*| or K'"
    )
    loss_angle_is: Literal["loss", "complement"] | None = optional("the loss angle, or 90 degrees minus it")
    across: Literal["amplitude", "preload"] | None = optional(
        "what a length or a strain in the names of the columns is"
    )
    accept: (
        list[Literal["unit", "spikes", "temperature", "loss_angle", "amplitude", "order", "clipped"]] | None
    ) = optional("kinds of faults that are none")
    quantity: Literal["E", "G"] | None = optional("modulus of a coupon")
    frequency: float | None = optional("Hz, of the whole file", gt=0)
    amplitude: float | None = optional("mm, degrees or strain, peak; of the whole file", gt=0)
    preload: float | None = optional("mm, degrees or strain, of the whole file")
    preload_force: float | None = optional("N, N mm or MPa, of the whole file")
    temperature: float | None = optional("degrees C, of the whole file", ge=-273.15)


def sources(
    tables: Iterable[tuple[DynamicRecordingTable, Keys]],
    files: Callable[[Keys, str], tuple[list[Path], bool]],
    known: Callable[[Keys, str], bool],
    taken: Iterable[str],
    findings: list[Finding],
) -> tuple[DynamicSource, ...]:
    """Return the sources of the tables of a case file; what is wrong is added to `findings`."""
    dynamic_sources: list[DynamicSource] = []
    for table, keys in tables:
        names = [*taken, *(source.label for source in dynamic_sources)]
        if table.name in names:
            findings.append(wrong_value((*keys, "name"), table.name, "is the name of another channel"))
        paths, _ = files((*keys, "file"), table.file)
        if not known((*keys, "mode"), table.mode):
            continue
        findings += _columns(table, keys)
        name = table.name or unused_name(table.mode, names)
        unit = math.radians(1.0) if modes()[table.mode].rotational else 1.0
        values: dict[str, Any] = {key: getattr(table, key) for key in _AS_GIVEN}
        for key in _TURNED:
            value = getattr(table, key)
            values[key] = None if value is None else unit * value
        dynamic_sources.append(
            DynamicSource(
                mode=table.mode,
                files=tuple(paths),
                name=name,
                pattern=table.file,
                columns=dict(table.columns or {}),
                units=dict(table.units or {}),
                rows=dict(table.rows or {}),
                delimiter=DELIMITERS.get(table.delimiter or "", table.delimiter),
                accepted_faults=tuple(table.accept or ()),
                **values,
            )
        )
    return tuple(dynamic_sources)


def _columns(table: DynamicRecordingTable, keys: Keys) -> list[Finding]:
    """Return what is wrong with the keys of columns and units."""
    # Here, because a case without such tables needs no parser of units.
    from bushcli.recording.header.units import read_unit
    from bushcli.recording.quantities import DYNAMIC

    mode, findings = modes()[table.mode], []
    column_names = (*COLUMNS, *LOOP_COLUMNS)
    for section in ("columns", "units"):
        for key in getattr(table, section) or {}:
            if key not in column_names:
                at = (*keys, section, key)
                what, close = "is not a column of a dynamic table", nearest(key, column_names)
                findings.append(wrong_key(at, what, ", ".join(column_names), close))
    for key, text in (table.units or {}).items():
        unit = read_unit(text)
        if key in COLUMNS and (unit is None or unit.measured not in DYNAMIC[key].kinds_in(mode)):
            at = (*keys, "units", key)
            kinds = " or ".join(sorted(DYNAMIC[key].kinds_in(mode)))
            what = f"is not a unit of a {kinds}"
            expected = f"the {key.replace('_', ' ')} in mode {mode.name} is one"
            findings.append(wrong_value(at, text, what, expected))
    if table.quantity is not None and mode.specimen != "coupon":
        what = f"belongs to a material test, but mode {mode.name} to a bushing"
        findings.append(wrong_key((*keys, "quantity"), what))
    return findings


def dynamic_source_json(source: DynamicSource) -> dict[str, Any]:
    """Return a source as JSON-ready data, with the keys and units of the case file; what is not given is left out."""
    rotational = modes()[source.mode].rotational
    fields: Mapping[str, Any] = vars(source)
    other = ("files", "pattern", "columns", "units", "name", "accepted_faults", "amplitude_factor")
    shown_keys = {key: fields[key] for key in fields if key not in other}
    for key in _TURNED:
        if rotational and shown_keys[key] is not None:
            shown_keys[key] = in_degrees(shown_keys[key], True)
    shown_keys |= {"columns": dict(source.columns) or None, "units": dict(source.units) or None}
    shown_keys["accept"] = list(source.accepted_faults) or None
    shown_keys |= {"kind": KIND, "file": source.pattern, "name": source.label}
    return {key: value for key, value in shown_keys.items() if value is not None}
