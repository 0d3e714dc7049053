"""LabVIEW measurement files (.lvm): segments of text, each with a header of its own below that of the file.

The header of the file gives the decimal sign, and whether the x values, usually the time, have no column, one, or one
for each channel (``X_Columns``). The header of a segment has a field for each column: unit, start and interval of the x
values, date and time of day. Segments with the same channels, as LabVIEW appends them while it measures, are one table
if their times increase.

References
----------
NI, Specification for the LabVIEW Measurement File (.lvm), https://www.ni.com/en/support/documentation/supplemental/06/
specification-for-the-labview-measurement-file---lvm-.html
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.decode import decoded
from bushcli.recording.fields import is_number, to_float
from bushcli.recording.reader import FilePart, Reader

Array = NDArray[np.float64]

_MARK, _END = "LabVIEW Measurement", "***End_of_Header***"
_SPECIAL = ("***Start_Special***", "***End_Special***")
_KEY = "Separator"
#: Channels of a file; more are a slip.
_MOST = 10_000
#: Forms of the date and of the time of day; seconds have up to 19 digits.
_DATES = ("%Y/%m/%d", "%Y-%m-%d", "%m/%d/%Y", "%d.%m.%Y")


@dataclass(frozen=True)
class _Segment:
    """Channels of a segment: names and units, x values (n,), values (channels, n), and its begin as written."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    x: Array
    x_unit: str
    values: Array
    begin: datetime | None


@contextmanager
def _opened(path: Path) -> Iterator[Sequence[FilePart]]:
    segments = list(_segments(decoded(path).splitlines()))
    if not segments:
        raise ValueError("holds no segment with channels")
    joined = _joined(segments)
    if joined is not None:
        yield [_part("", joined)]
    else:
        yield [_part(f"segment {i + 1}", segment) for i, segment in enumerate(segments)]


def _segments(lines: Sequence[str]) -> Iterator[_Segment]:
    """Yield the segments of a file, its lines given."""
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    if not ends:
        raise ValueError(f"the line {_END} is missing")
    # The line that names the separator has it behind its keyword.
    keyed = [line[len(_KEY)] for line in lines[: ends[0]] if line.startswith(_KEY) and len(line) > len(_KEY)]
    separator = keyed[0] if keyed else "\t"
    file = _header(lines[: ends[0]], separator)
    decimal = "".join(file.get("decimal_separator", ())[:1]) or "."
    columns = ("".join(file.get("x_columns", ())[:1]) or "One").lower()
    if columns not in ("no", "one", "multi") or decimal not in (".", ","):
        raise ValueError(f"X_Columns = {columns[:20]} with Decimal_Separator = {decimal[:5]} is not read")
    begin = ends[0] + 1
    for i, end in enumerate(ends[1:], start=1):
        # The next segment's header begins after the last row of this one, at its line "Channels".
        last = ends[i + 1] if i + 1 < len(ends) else len(lines)
        stop = next((n for n in range(end + 1, last) if lines[n].startswith("Channels")), len(lines))
        head = _header(lines[begin:end], separator)
        yield _segment(lines, end + 1, stop, head, (separator, decimal, columns))
        begin = stop


def _header(lines: Sequence[str], separator: str) -> Mapping[str, list[str]]:
    """Return the fields of each keyword, in lower case."""
    split = [line.split(separator) for line in _plain(lines)]
    return {fields[0].strip().lower(): [field.strip() for field in fields[1:]] for fields in split}


def _plain(lines: Sequence[str]) -> Iterator[str]:
    """Yield the lines that are neither empty nor within a special block."""
    special = False
    for line in lines:
        special = (special or line.startswith(_SPECIAL[0])) and not line.startswith(_SPECIAL[1])
        if line.strip() and not special and not line.startswith(_SPECIAL[1]):
            yield line


def _segment(
    lines: Sequence[str], start: int, stop: int, head: Mapping[str, list[str]], form: tuple[str, str, str]
) -> _Segment:
    """Return a segment.

    Parameters
    ----------
    lines : sequence of str
        Those of the file.
    start, stop : int
        Index of the line with the names, and of the line below the last row.
    head : mapping of str to list of str
        Fields of its header by keyword.
    form : tuple of str
        Separator, decimal sign and X_Columns.
    """
    separator, decimal, columns = form
    number = _number((head.get("channels") or [""])[0], "Channels")
    if not number <= _MOST:
        raise ValueError(f"Channels: {number:g} are too many")
    count = int(number)
    body = [(n + 1, lines[n].split(separator)) for n in range(start, stop) if lines[n].strip()]
    at = range(1, 2 * count, 2) if columns == "multi" else range(1, count + 1)
    titles = body.pop(0)[1] if body else []
    if count < 1 or not body or len(titles) <= at[-1]:
        raise ValueError(f"line {start + 1}: there are no names and values of {count} channels")
    values = np.array([_column(body, i, decimal) for i in at])
    x = [_column(body, i - 1, decimal) for i in (at if columns == "multi" else at[:1]) if columns != "no"]
    if columns == "no":
        step = {(_get(head, "x0", i, decimal), _get(head, "delta_x", i, decimal)) for i in range(count)}
        x = [begin + interval * np.arange(values.shape[1]) for begin, interval in step]
    if any(not np.array_equal(x[0], other) for other in x[1:]):
        raise ValueError("its channels have different x values; write them with one column of time")
    dimension = (head.get("x_dimension") or ["Time"])[0] or "Time"
    units = [*head.get("y_unit_label", []), *[""] * count]
    return _Segment(
        tuple(titles[i].strip() for i in at),
        tuple(units[:count]),
        x[0],
        "s" if dimension.lower() == "time" else dimension,
        values,
        _begin(head),
    )


def _column(body: Sequence[tuple[int, list[str]]], index: int, decimal: str) -> Array:
    """Return a column of rows, each with the number of its line."""
    return np.array(
        [_number(row[index] if index < len(row) else "", f"line {n}", decimal) for n, row in body]
    )


def _get(head: Mapping[str, list[str]], keyword: str, index: int, decimal: str) -> float:
    """Return the number of a channel in a header."""
    fields = head.get(keyword, [])
    return _number(fields[index] if index < len(fields) else "", keyword, decimal)


def _number(text: str, where: str, decimal: str = ".") -> float:
    text = text.strip()
    if not is_number(text, decimal):
        raise ValueError(
            f"{where}: {text[:40]!r} is not a number" if text else f"{where}: a number is missing"
        )
    return to_float(text, decimal)


def _begin(head: Mapping[str, list[str]]) -> datetime | None:
    """Return the date and time of day at which a segment begins, or None."""
    written = " ".join((head.get(key) or [""])[0] for key in ("date", "time")).replace(",", ".")
    whole, _, fraction = written.partition(" ")[2].partition(".")
    for date in _DATES:
        try:
            found = datetime.strptime(f"{written.partition(' ')[0]} {whole}", f"{date} %H:%M:%S")
        except ValueError:
            continue
        return found.replace(microsecond=round(1e6 * float(f"0.{fraction[:6] or 0}")) % 1_000_000)
    return None


def _joined(segments: Sequence[_Segment]) -> _Segment | None:
    """Return segments with the same channels as one, if their times increase; else None."""
    first = segments[0]
    if any(
        (one.names, one.units, one.x_unit) != (first.names, first.units, first.x_unit) for one in segments
    ):
        return None
    shifts = [0.0] * len(segments)
    if any(a.x[-1] >= b.x[0] for a, b in pairwise(segments)):
        # The x values of each segment count from its own begin.
        if first.x_unit != "s" or any(one.begin is None for one in segments):
            return None
        shifts = [(one.begin - first.begin).total_seconds() for one in segments]  # type: ignore[operator]
    x = np.concatenate([one.x + shift for one, shift in zip(segments, shifts, strict=True)])
    if (np.diff(x) <= 0).any() and len(segments) > 1:
        return None
    values = np.concatenate([one.values for one in segments], axis=1)
    return _Segment(first.names, first.units, x, first.x_unit, values, first.begin)


def _part(name: str, segment: _Segment) -> FilePart:
    columns = [segment.x, *segment.values]
    title = "time" if segment.x_unit == "s" else "x"
    names, units = [title, *segment.names], [segment.x_unit, *segment.units]
    return FilePart(name, names, units, len(segment.x), columns.__getitem__)


READER = Reader(
    name="a LabVIEW measurement file (.lvm)",
    recognises=lambda head, suffix: head.removeprefix(b"\xef\xbb\xbf").startswith(_MARK.encode()),
    opened=_opened,
)
