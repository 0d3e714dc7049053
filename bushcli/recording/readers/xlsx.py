"""Excel workbooks (.xlsx, .xlsm), by openpyxl: each worksheet is a table as in a text file, with its header."""

from __future__ import annotations

import datetime
import re
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile, zip_longest
from pathlib import Path
from typing import Any

from bushcli.recording.reader import FilePart, Reader
from bushcli.recording.text.clock_times import Instant

#: Largest number of cells of a workbook: two million rows of three columns, as in a text file.
_MOST_CELLS = 6_000_000
#: Largest size of an unpacked workbook, bytes.
_MOST_BYTES = 1_000_000_000
#: Largest number of columns that are read, and number of empty rows after which a sheet counts as ended.
_WIDEST, _GAP = 1_000, 10_000
#: A sheet with fewer rows may have formulas in all others.
_FEWEST = 5
_SAYS_PERCENT = re.compile(r"%|percent|prozent", re.IGNORECASE)


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the worksheets."""
    from openpyxl import load_workbook

    with zipfile.ZipFile(path) as packed:
        if sum(item.file_size for item in packed.infolist()) > _MOST_BYTES:
            raise ValueError(f"unpacks to more than {_MOST_BYTES / 1e6:g} MB")
    # Given a name, the library would judge the file by its suffix.
    with path.open("rb") as stream:
        book = load_workbook(stream, read_only=True, data_only=True)
        try:
            parts = _sheets(book)
        finally:
            book.close()
        if any(len(p.cells or ()) < _FEWEST or any("" in f for _, f in p.cells or ()) for p in parts):
            written = load_workbook(stream, read_only=True)
            try:
                parts = _with_formulas(parts, written)
            finally:
                written.close()
    yield parts


def _with_formulas(parts: Sequence[FilePart], written: Any) -> list[FilePart]:
    """Return sheets with the formulas whose values are missing: a program that does not calculate wrote the file."""
    sheets = []
    for part in parts:
        sheet = written[part.name]
        sheet.reset_dimensions()
        rows, cells = dict(part.cells or ()), []
        last = max(rows) + _GAP
        for n, row in enumerate(sheet.iter_rows(values_only=True, max_col=_WIDEST, max_row=last), start=1):
            texts = [str(cell) if isinstance(cell, str) and cell.startswith("=") else "" for cell in row]
            fields = [field or text for field, text in zip_longest(rows.get(n, ()), texts, fillvalue="")]
            cells += [(n, fields)] if any(fields) else []
        width = max(_filled_width(fields) for _, fields in cells)
        sheets.append(replace(part, cells=[(n, (f + [""] * width)[:width]) for n, f in cells]))
    return sheets


def _sheets(book: Any) -> list[FilePart]:
    parts, left = [], _MOST_CELLS
    for sheet in book.worksheets:
        # The extent stated in the file may be wrong.
        sheet.reset_dimensions()
        cells: list[tuple[int, list[str]]] = []
        empty, stamps, percent = 0, dict[int, _Stamps](), set[int]()
        for number, row in enumerate(sheet.iter_rows(max_col=_WIDEST), start=1):
            fields = [_field(cell, column, stamps, percent) for column, cell in enumerate(row)]
            left -= 1 + _filled_width(fields)
            if left < 0:
                raise ValueError(f"has more than {_MOST_CELLS / 1e6:g} million cells")
            if any(fields):
                cells.append((number, fields))
                empty = 0
            elif (empty := empty + 1) > _GAP:
                break
        if cells:
            width = max(_filled_width(fields) for _, fields in cells)
            padded = [(n, (f + [""] * width)[:width]) for n, f in cells]
            for column in percent:
                # The header of a column whose numbers are shown in percent has the unit, or gets it.
                rows = takewhile(lambda row, at=column: not row[1][at][-1:].isdigit(), padded)  # type: ignore[misc]
                texts = [fields for _, fields in rows if fields[column]]
                if texts and not any(_SAYS_PERCENT.search(fields[column]) for fields in texts):
                    texts[-1][column] += " [%]"
            dates = [(column, stamp.count, stamp.instant) for column, stamp in stamps.items()]
            parts.append(FilePart(sheet.title, cells=padded, dates=dates))
    return parts


class _Stamps:
    """The first date or time of day in a column, and how many there are."""

    def __init__(self, value: datetime.datetime | datetime.time) -> None:
        self.first, self.count = _date_of(value), 0
        reference = "time of day" if isinstance(value, datetime.time) else "date"
        self.instant = Instant.of(self.first, reference)

    def seconds(self, value: datetime.datetime | datetime.time) -> float:
        """Count a date or a time of day; return the seconds since the first."""
        self.count += 1
        return (_date_of(value) - self.first).total_seconds()


def _date_of(value: datetime.datetime | datetime.time) -> datetime.datetime:
    """Return a date, or a time of day on the first day of 1970."""
    if isinstance(value, datetime.datetime):
        return value
    return datetime.datetime.combine(datetime.date(1970, 1, 1), value)


def _filled_width(fields: Sequence[str]) -> int:
    return max((i + 1 for i, field in enumerate(fields) if field), default=0)


def _field(cell: Any, column: int, stamps: dict[int, _Stamps], percent: set[int]) -> str:
    """Return a cell as text; a date or a time becomes seconds since the first one of its column."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (int, float)):
        if "%" in cell.number_format:
            # Shown as 5 %, and stored as 0.05.
            percent.add(column)
            return repr(float(f"{100.0 * value:.15g}"))
        return repr(value)
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, (datetime.datetime, datetime.time)):
        return repr(stamps.setdefault(column, _Stamps(value)).seconds(value))
    return " ".join(str(value).split())


READER = Reader(
    name="an Excel workbook",
    recognises=lambda head, suffix: (
        head.startswith(b"PK\x03\x04")
        and (suffix in (".xlsx", ".xlsm") or b"[Content_Types].xml" in head or b"xl/" in head)
    ),
    open_parts=open_parts,
    library="openpyxl",
)
