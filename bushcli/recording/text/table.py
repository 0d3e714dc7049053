"""A table of measured columns from a file of any format: names, units as written, numbers on demand."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, count_of, printable
from bushcli.recording.text.clock_times import UTC, ClockTimes, Instant, clock_times, is_short, times_of
from bushcli.recording.text.fields import is_number, says_missing, sentinel, with_hyphens
from bushcli.recording.text.rows import AlikeRows, SplitRows

Array = NDArray[np.float64]
Index = NDArray[np.int_]

#: Larger values are slips or codes for errors; the limit is so low that products of measured values stay finite.
LARGEST = 1e100
#: Largest number of characters of a name or a field that a message shows.
SHOWN = 40
#: Characters of a line above a table in which units and factors are searched.
LONGEST_LINE = 5000
#: What to do where a workbook has formulas without values.
CALCULATE = "open the workbook in Excel or LibreOffice, which calculate them, and save it"
_PERCENT = 'remove the % behind the numbers; the name of the column has the unit: "Strain [%]"'
# What to do with a row that lacks a value, and with times of two numbers.
_NO_VALUE = "delete the row, or put # and a blank in front of it"
_MINUTES = 'units = {time = "mm:ss"} or "hh:mm" in the table of the case file'


@dataclass(frozen=True, kw_only=True)
class Table(ABC):
    """Columns of equal length.

    Attributes
    ----------
    path : Path
    names, units : tuple of str
        By column, as written; empty texts where there is none.
    part : str
        Name of the sheet or group of the file; empty where a file holds one table.
    header_line : int
        Line of the units, or of the names if there is no row of units; 0 in a file without lines.
    remarks : tuple of str
        What a user should know about how the table was made.
    preamble : tuple of (int, str)
        Lines of a text above the header, with their numbers.
    between : tuple of (int, str)
        Lines of text and comments between the names and the last row, with their numbers.
    decimal : str
        Decimal sign of its fields.
    origin : Instant, optional
        Where the times that are numbers count from, if the file says it.
    """

    path: Path
    names: tuple[str, ...]
    units: tuple[str, ...]
    part: str = ""
    header_line: int = 0
    remarks: tuple[str, ...] = ()
    preamble: tuple[tuple[int, str], ...] = ()
    between: tuple[tuple[int, str], ...] = ()
    decimal: str = "."
    origin: Instant | None = None

    def __post_init__(self) -> None:
        # Control characters would act on the terminal that shows them; a minus sign is a hyphen for all that read.
        object.__setattr__(self, "remarks", tuple(map(printable, self.remarks)))
        object.__setattr__(self, "part", printable(self.part))
        for key in ("names", "units"):
            object.__setattr__(self, key, tuple(with_hyphens(printable(text)) for text in getattr(self, key)))
        for key in ("preamble", "between"):
            lines = ((line, with_hyphens(printable(text))) for line, text in getattr(self, key))
            object.__setattr__(self, key, tuple(lines))

    @abstractmethod
    def __len__(self) -> int:
        """Return the number of rows."""

    @abstractmethod
    def line(self, row: int) -> int:
        """Return the number, from 1, by which a user finds a row (from 0): its line, or its sample."""

    @abstractmethod
    def text(self, row: int, column: int) -> str:
        """Return a field as written in the file.

        Parameters
        ----------
        row, column : int
            From 0.
        """

    @abstractmethod
    def numbers(self, column: int, accepted: Collection[float] = ()) -> Array:
        """Return a column as numbers, (n,).

        Parameters
        ----------
        column : int
            From 0.
        accepted : collection of float
            Numbers that look like codes for missing values and were measured, in the unit of the file.

        Raises
        ------
        RecordingError
            At the first field that is not a finite number or looks like a code for a missing value.
        """

    @abstractmethod
    def of_rows(self, rows: Index) -> Table:
        """Return the table of some rows, by their indices (n,) from 0."""

    def clock(self, column: int, form: str = "") -> ClockTimes | None:
        """Return a column of dates, times of day or durations as seconds since the first; None for other columns.

        Parameters
        ----------
        column : int
            From 0.
        form : str
            What the case file says of its form, such as "mm:ss".
        """
        return None

    @property
    def where(self) -> str:
        """The file, with the sheet or group."""
        return f"{self.path} ({self.part})" if self.part else str(self.path)

    def place(self, row: int) -> str:
        """Return the file with the line or sample of a row (from 0)."""
        return f"{self.path}:{self.line(row)}"

    def label(self, column: int) -> str:
        """Return the name of a column (from 0) in messages: ``column 2 (force_N)``."""
        name = self.names[column]
        return f"column {column + 1} ({name[:SHOWN]})" if name else f"column {column + 1}"

    def refusal(self, what: str, remedy: str = "", row: int | None = None) -> RecordingError:
        """Return an error about the table, or about one of its rows.

        Parameters
        ----------
        what, remedy : str
            What is wrong, and what to do.
        row : int, optional
            Index from 0.
        """
        return RecordingError(Problem(self.where if row is None else self.place(row), what, "", remedy))

    def _refusal_of_code(self, row: int, column: int, value: float) -> RecordingError:
        """Return the error for a value, in the unit of the file, that looks like a code for a missing one."""
        what = f"{self.label(column)}: {self.text(row, column)} looks like a code for a missing value"
        expected = (
            "if it is one, delete the row or put # in front of it; if it was measured, "
            f"accept = [{value:g}] in the table of the case file"
        )
        return self.refusal(what, expected, row)


@dataclass(frozen=True, kw_only=True)
class ArrayTable(Table):
    """Columns that a file holds as numbers.

    Attributes
    ----------
    columns : tuple of (n,) arrays or None
        None where a column was not loaded, because neither its name nor the case file asks for it.
    """

    columns: tuple[NDArray[np.generic] | None, ...] = field(repr=False)

    def __len__(self) -> int:
        """Return the number of samples."""
        return next((len(column) for column in self.columns if column is not None), 0)

    def line(self, row: int) -> int:
        """Return the number of the sample, from 1."""
        return row + 1

    def place(self, row: int) -> str:
        """Return the file with the group and the number of the sample."""
        return f"{self.where}, sample {row + 1}"

    def text(self, row: int, column: int) -> str:
        """Return a number in the shortest form that is read back as the same number."""
        values = self.columns[column]
        return "" if values is None else str(values[row])

    def numbers(self, column: int, accepted: Collection[float] = ()) -> Array:
        """Return a column as numbers; see `Table.numbers`."""
        raw = self.columns[column]
        if raw is None:
            what = f"{self.label(column)} was not loaded: the file is large"
            raise self.refusal(what, "name the column in `columns` of the case file")
        dated = self.clock(column)
        values = raw.astype(np.float64) if dated is None else dated.seconds
        bad = ~(np.abs(values) <= LARGEST)
        if bad.any():
            row = int(np.argmax(bad))
            what = f"{self.label(column)}: {self.text(row, column)} is not a finite number"
            if bad.sum() > 1:
                what += f", and likewise in {int(bad.sum()) - 1} more samples"
            expected = "delete these samples, or export the file without them"
            raise self.refusal(what, expected, row)
        code = sentinel(values, lambda row: self.text(row, column), accepted)
        if code is not None:
            raise self._refusal_of_code(code, column, float(values[code]))
        return values

    def of_rows(self, rows: Index) -> ArrayTable:
        """Return the table of some samples; see `Table.of_rows`."""
        return replace(self, columns=tuple(None if c is None else c[rows] for c in self.columns))

    def clock(self, column: int, form: str = "") -> ClockTimes | None:
        """Return a column of dates or durations as seconds since the first; see `Table.clock`."""
        raw = self.columns[column]
        if raw is None or raw.dtype.kind not in "mM":
            return None
        if np.isnat(raw).any():
            row = int(np.argmax(np.isnat(raw)))
            what = f"{self.label(column)}: the date is missing"
            raise self.refusal(what, "export the file without these samples", row)
        return times_of(raw, UTC if self.units[column] == UTC else "date")


@dataclass(frozen=True, kw_only=True)
class TextTable(Table):
    """The rows of a text file or a spreadsheet, as texts.

    Attributes
    ----------
    parts : tuple of SplitRows or AlikeRows
        The rows, one part after the other; every row has at least ``len(names)`` fields.
    dates : mapping of int to Instant
        Columns, from 0, with seconds since an instant instead of the dates that a sheet has.
    """

    parts: tuple[SplitRows | AlikeRows, ...] = field(repr=False)
    dates: Mapping[int, Instant] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of rows."""
        return sum(map(len, self.parts))

    @property
    def size(self) -> int:
        """Memory that it takes, in numbers of 8 bytes."""
        return sum(part.size for part in self.parts)

    def _part(self, row: int) -> tuple[SplitRows | AlikeRows, int]:
        """Return the part that has a row (from 0), and its index there."""
        for part in self.parts:
            if row < len(part):
                return part, row
            row -= len(part)
        raise IndexError(row)

    def line(self, row: int) -> int:
        """Return the line number of a row (from 0)."""
        part, index = self._part(row)
        return part.line(index)

    def text(self, row: int, column: int) -> str:
        """Return a field as written in the file."""
        part, index = self._part(row)
        return part.text(index, column)

    def numbers(self, column: int, accepted: Collection[float] = ()) -> NDArray[np.float64]:
        """Return a column as numbers; see `Table.numbers`."""
        pieces = [part.parse_column(column, self.decimal) for part in self.parts]
        values = np.concatenate([numbers for numbers, _ in pieces])
        if not all(whole for _, whole in pieces) or not np.all(np.abs(values) <= LARGEST):
            self._refuse(column, values)
        code = sentinel(values, lambda row: self.text(row, column), accepted)
        if code is not None:
            raise self._refusal_of_code(code, column, values[code])
        return values

    def of_rows(self, rows: Index) -> TextTable:
        """Return the table of some rows; see `Table.of_rows`."""
        ends = np.cumsum([0, *map(len, self.parts)])
        indices = (rows[(rows >= start) & (rows < end)] - start for start, end in pairwise(ends))
        parts = zip(self.parts, indices, strict=True)
        return replace(self, parts=tuple(part.of_rows(index) for part, index in parts))

    def _refuse(self, column: int, values: NDArray[np.float64]) -> None:
        """Raise for the first field that is no finite number of a possible size."""
        sign = "comma" if self.decimal == "," else "point"
        plain = f"numbers with a decimal {sign}, without thousands separators"
        others = int(np.count_nonzero(~(np.abs(values) <= LARGEST))) - 1
        more = f", and likewise in {count_of(others, 'more row')}" if others > 0 else ""
        for i, value in enumerate(values):
            written = self.text(i, column)
            shown, number = written[:SHOWN], is_number(written, self.decimal)
            faults = (
                (is_short(written), f"{written} may be minutes and seconds, or hours and minutes", _MINUTES),
                (not written, "a field is empty", _NO_VALUE),
                (not number and written.startswith("="), f"{shown} is a formula without a value", CALCULATE),
                (not number, f'"{shown}" is not a number', _PERCENT if written.endswith("%") else plain),
                (says_missing(written), f"{written} is a missing value", _NO_VALUE),
                (not np.isfinite(value), f"{shown} is not a finite number", _NO_VALUE),
                (abs(value) > LARGEST, f"{shown} is not a measured value", plain),
            )
            for holds, what, remedy in faults:
                if holds:
                    raise self.refusal(f"{self.label(column)}: {what}{more}", remedy, i)

    def clock(self, column: int, form: str = "") -> ClockTimes | None:
        """Return a column of dates or times of day as seconds since the first; see `Table.clock`."""
        if column in self.dates:
            return ClockTimes(self.numbers(column), self.dates[column])
        stamped = len(self) > 0 and ":" in self.text(0, column)
        fields = (text for part in self.parts for text in part.texts(column))
        form = form or f"{self.names[column]} {self.units[column]}"
        return clock_times([*fields], form) if stamped else None
