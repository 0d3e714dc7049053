"""Which column is time, displacement and force, and what factor leads to internal units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, nearest
from bushcli.recording.header import match_quality, name_and_unit, unit_of
from bushcli.recording.source import UNITS, Quantity, Source, dimension
from bushcli.recording.text import TextTable
from cases.mode import Mode

Array = NDArray[np.float64]

_DEFAULT_UNIT = {
    "time": "s", "length": "mm", "angle": "deg", "force": "N", "moment": "Nmm",
    "strain": "stretch", "stress": "MPa",
}  # fmt: skip
_EXPECTED = {
    "length": "displacement_mm", "angle": "rotation_deg", "force": "force_N", "moment": "moment_Nmm",
    "strain": "stretch", "stress": "nominal_stress_MPa", "time": "time_s",
}  # fmt: skip


def column(table: TextTable, source: Source, mode: Mode, quantity: Quantity) -> tuple[int, Array] | None:
    """Return the index (from 0) of a quantity's column and its values (n,) in internal units.

    The values of a coupon's displacement are stretch - 1. A time that is not in the file is None.

    Raises
    ------
    RecordingError
        When the column is missing, ambiguous, of another kind than the mode needs, or not all numbers.
    """
    measured = dimension(quantity, mode.specimen, mode.rotational)
    chosen = source.columns.get(quantity)
    index = _found(table, mode, quantity, measured) if chosen is None else _chosen(table, chosen)
    if index is None:
        return None
    given = source.units.get(quantity) or _unit(table, mode, index, measured)
    values = table.numbers(index) * UNITS[measured][given]
    if measured == "strain" and given == "stretch":
        if (values <= 0).any():
            row = int(np.argmax(values <= 0))
            what = f"{table.label(index)}: a stretch of {table.rows[row][index]} is impossible"
            expected = 'a strain? say so: units = {displacement = "strain"} or "percent"'
            raise RecordingError(Problem(f"{table.path}:{table.lines[row]}", what, "", expected))
        values = values - 1.0
    return index, -values if quantity in source.reverse else values


def unit(table: TextTable, source: Source, mode: Mode, quantity: Quantity) -> str:
    """Return the unit in which a column was read; empty where there is no such column.

    Raises
    ------
    RecordingError
        As `column` does.
    """
    measured = dimension(quantity, mode.specimen, mode.rotational)
    chosen = source.columns.get(quantity)
    index = _found(table, mode, quantity, measured) if chosen is None else _chosen(table, chosen)
    if index is None:
        return ""
    return source.units.get(quantity) or _unit(table, mode, index, measured)


def _found(table: TextTable, mode: Mode, quantity: Quantity, measured: str) -> int | None:
    kinds = ("stretch", "strain") if measured == "strain" else (measured,)
    quality = [max(match_quality(name, kind) for kind in kinds) if name else 0 for name in table.names]
    if not any(table.names):
        # A row of units alone tells as much as it is unambiguous.
        quality = [int((unit_of(unit) or ("",))[0] == measured) for unit in table.units]
    best = [i for i, q in enumerate(quality) if q == max(quality) > 0]
    if len(best) == 1:
        return best[0]
    if quantity == "time" and not best:
        return None
    key = f"columns = {{{quantity} = ...}} in the case file"
    if best:
        several = " and ".join(table.label(i) for i in best)
        what = f"{several} could both be the {quantity}"
        raise RecordingError(Problem(str(table.path), what, "", f"name one, or give its number: {key}"))
    listed = ", ".join(name for name in table.names if name)
    what = f"no column {_EXPECTED[measured]}, which mode {mode.name} needs"
    what += f", among {listed}" if listed else "; the table has no header"
    expected = f"or choose a column by name or number: {key}"
    other = _other_modes(table, mode)
    raise RecordingError(Problem(str(table.path), what + (f"; {other}" if other else ""), "", expected))


def _other_modes(table: TextTable, mode: Mode) -> str:
    """Return for which modes the file has columns."""
    for specimen, kind, modes in (
        ("translation", "length", "axial or radial"),
        ("rotation", "angle", "torsional or conical"),
        ("coupon", "stretch", "uniaxial, equibiaxial, planar or volumetric"),
        ("coupon", "strain", "uniaxial, equibiaxial, planar or volumetric"),
    ):
        here = "coupon" if mode.specimen == "coupon" else "rotation" if mode.rotational else "translation"
        if specimen != here and any(match_quality(name, kind) >= 3 for name in table.names if name):
            return f"is this a recording of mode {modes}?"
    return ""


def _chosen(table: TextTable, chosen: str | int) -> int:
    width = len(table.names)
    if isinstance(chosen, int):
        if chosen > width:
            what = f"has no column {chosen}"
            raise RecordingError(Problem(str(table.path), what, "", f"the table has {width} columns"))
        return chosen - 1
    folded = [name.strip().casefold() for name in table.names]
    plain = [name_and_unit(name)[0] for name in table.names]
    for names, wanted in ((folded, chosen.strip().casefold()), (plain, name_and_unit(chosen)[0])):
        hits = [i for i, name in enumerate(names) if name and name == wanted]
        if len(hits) == 1:
            return hits[0]
        if len(hits) > 1:
            what = f'has {len(hits)} columns named "{chosen}"'
            numbers = ", ".join(str(i + 1) for i in hits)
            raise RecordingError(Problem(str(table.path), what, "", f"give a number: {numbers}"))
    named = [name for name in table.names if name]
    near = dict(zip(plain, table.names, strict=True)).get(nearest(name_and_unit(chosen)[0], plain), "")
    what = f'has no column "{chosen}"'
    listed = ", ".join(named) or f"no header; give a number from 1 to {width}"
    raise RecordingError(Problem(str(table.path), what, near, listed))


def _unit(table: TextTable, mode: Mode, index: int, measured: str) -> str:
    """Return the unit that the file gives for a column, or the default one."""
    name, unit = name_and_unit(table.names[index])
    unit = unit or unit_of(table.units[index])
    if unit is None:
        is_strain = measured == "strain" and not match_quality(table.names[index], "stretch") and name
        return (
            "strain" if is_strain and match_quality(table.names[index], "strain") else _DEFAULT_UNIT[measured]
        )
    if unit[0] != measured:
        what = f"{table.label(index)} is in {unit[1]}, but mode {mode.name} needs a {_KIND[measured]}"
        raise RecordingError(Problem(str(table.path), what, "", "in " + ", ".join(UNITS[measured])))
    return unit[1]


_KIND = {
    "time": "time", "length": "length", "angle": "rotation", "force": "force", "moment": "moment",
    "strain": "stretch or strain", "stress": "stress",
}  # fmt: skip
