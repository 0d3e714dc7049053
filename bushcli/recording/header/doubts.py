"""Refuse numbers that contradict the meaning that the name and unit of their column give them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.header import heading
from bushcli.recording.header.loose_numbers import largest
from bushcli.recording.header.units import Unit
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.table import Table
from cases.mode import Mode

Array = NDArray[np.float64]

#: Days since 1900 from 1982 to 2119, largest interval of samples in days, and milliseconds since 1970 in 1973.
_DAYS, _LONGEST_DAYS, _MILLISECONDS = (30_000.0, 80_000.0), 0.1, 1e11
#: Share of a range by which a sensor is overloaded at most; judgement.
_OVERLOAD = 1.2
#: Strain of the first sample of a coupon up to which it counts as at rest; judgement.
_AT_REST = 0.15


def refuse_date(table: Table, index: int, time: Array) -> None:
    """Refuse a time without a unit whose numbers are dates: days since 1900 as in Excel, or milliseconds since 1970."""
    first, steps = float(time[0]), np.abs(np.diff(time))
    step = float(np.median(steps)) if len(steps) else 0.0
    is_day = _DAYS[0] < first < _DAYS[1] and 0.0 < step < _LONGEST_DAYS and first % 1.0 != 0.0
    if is_day or first > _MILLISECONDS:
        kind = "days since 1900" if is_day else "milliseconds since 1970"
        what = f"{table.label(index)}: {table.text(0, index)} looks like a date in {kind}, not like seconds"
        expected = 'write the time in s, or give units = {time = "s"} in the table of the case file if it is'
        raise RecordingError(Problem(table.place(0), what, "", expected))


def ranges_of(table: Table, quantity: Quantity, index: int, numbers: Array, assumed: bool) -> list[str]:
    """Return a remark about each range in the name of a column, such as the ±25 of ``Displacement ±25``."""
    said = []
    for text in heading(table.names[index]).ranges:
        row = int(np.argmax(np.abs(numbers)))
        if assumed and abs(float(numbers[row])) > _OVERLOAD * largest(text):
            what = f'{table.label(index)}: {table.text(row, index)} is beyond the range "{text}", and no unit is given'
            expected = f'units = {{{quantity} = "..."}} in the table of the case file'
            raise RecordingError(Problem(table.place(row), what, "", expected))
        said.append(f'{table.label(index)}: "{text}" is taken for the range of the sensor, and not applied')
    return said


def refuse_other_strain(table: Table, index: int, read: Unit, values: Array) -> None:
    """Refuse a strain that begins like a stretch, and a stretch that begins like a strain: a coupon begins at rest."""
    first = float(values[0])
    if (read.name == "strain" and abs(first - 1.0) < _AT_REST and values.min() > 1.0 - _AT_REST) or (
        read.name == "stretch" and abs(first) < _AT_REST and first != 0.0
    ):
        is_strain = read.name == "strain"
        other = "a stretch" if is_strain else "a strain"
        what = f"{table.label(index)} is read as a {read.name}, and begins with {table.text(0, index)} as {other} does"
        expected = f'units = {{displacement = "{"stretch" if is_strain else "strain"}"}} in the table of the case file'
        raise RecordingError(Problem(table.place(0), what, "", f'{expected}, or "{read.name}" if it is one'))


#: Beginnings of words for compression and for tension.
_COMPRESSIVE = ("compress", "druck", "stauch", "kompress", "schiacc", "écras")
_TENSILE = ("tens", "zug", "pull", "trac", "traz")


def says_compression(name: str) -> bool:
    """Whether a name contains a word for compression, and none for tension."""
    words = [
        word for word in re.split(r"[\W_\d]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()) if word
    ]
    return any(word.startswith(_COMPRESSIVE) for word in words) and not any(
        word.startswith(_TENSILE) or "zug" in word for word in words
    )


def refuse_compression(
    table: Table, source: Source, mode: Mode, quantity: Quantity, index: int, values: Array, form: str
) -> None:
    """Refuse a compressive strain or stress that is counted as positive: it would be read as tension.

    The name of the column says that it is compressive, or that of the file, of its sheet or of the channel. In shear
    and in volumetric tests it says nothing about signs (`bushcli.recording.specimen`).
    """
    if source.reverse is not None or mode.sheared or mode.needs_compressibility:
        return
    by_column = any(word.startswith(_COMPRESSIVE) for word in heading(table.names[index]).words)
    names = {
        source.file.stem: "the name of the file",
        table.part: "its sheet",
        source.name: "the name of the channel",
    }
    telling = [of for name, of in names.items() if name and says_compression(name)]
    # A stretch in compression is below 1: it has its sign already.
    positive = values.max() > abs(values.min())
    if (by_column or telling) and positive:
        says = f"{table.label(index)} is compressive" if by_column else f"{telling[0]} says compression"
        what = f"{says}, and the values of {table.label(index)} are positive: they would be read as tension"
        if by_column:
            what = f"{says}, and its values are positive: they would be read as tension"
        expected = 'reverse = ["displacement", "force"] in the table of the case file, or reverse = [] if it is tension'
        raise RecordingError(Problem(table.where, what, "", expected))
