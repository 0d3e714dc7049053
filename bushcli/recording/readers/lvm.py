"""LabVIEW measurement files (.lvm): segments of text, each with a header of its own below that of the file.

The header of the file gives the decimal sign, and whether the x values, usually the time, have no column, one, or one
for each channel (``X_Columns``). The header of a segment has a field for each column: unit, start and interval of the x
values, date and time of day. Channels that differ in these or in their x values are tables of their own. Segments with
the same channels, as LabVIEW appends them while it measures, are one table if their times increase.

References
----------
NI, Specification for the LabVIEW Measurement File (.lvm), https://www.ni.com/en/support/documentation/supplemental/06/
specification-for-the-labview-measurement-file---lvm-.html
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader, unique_names
from bushcli.recording.text.clock_times import Instant
from bushcli.recording.text.decode import read_text
from bushcli.recording.text.fields import is_number, to_float

Array = NDArray[np.float64]

#: Fields of a header by keyword; rows with the numbers of their lines.
_Head = Mapping[str, list[str]]
_Body = Sequence[tuple[int, list[str]]]
_MARK, _END = "LabVIEW Measurement", "***End_of_Header***"
_SPECIAL = ("***Start_Special***", "***End_Special***")
_KEY = "Separator"
#: Channels of a file; more are a slip.
_MOST = 10_000
#: LabVIEW's instant zero, the beginning of 1904, from which absolute times count.
_ZERO = Instant("UTC", 0)
#: Forms of the date and of the time of day; seconds have up to 19 digits.
_DATES = ("%Y/%m/%d", "%Y-%m-%d", "%m/%d/%Y", "%d.%m.%Y")


@dataclass(frozen=True)
class _Segment:
    """Channels of a segment with one clock: names and units, x values (n,), values (channels, n), begin as written.

    The x values count from the begin, or without one as the file says (`origin`).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    x: Array
    x_unit: str
    values: Array
    begin: datetime | None
    origin: Instant | None


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the segments, those that continue each other as one."""
    segments = list(_segments(read_text(path).splitlines()))
    if not segments:
        raise ValueError("holds no segment with channels")
    # The first clock of a segment continues that of the segment before.
    joined = [_join_segments(clocks) for clocks in zip(*segments, strict=False)]
    if len({len(clocks) for clocks in segments}) == 1 and None not in joined:
        labelled = [("", clock) for clock in joined if clock is not None]
    else:
        labelled = [(f"segment {i + 1}", clock) for i, clocks in enumerate(segments) for clock in clocks]
    labels = [label for label, _ in labelled]
    longer = [", ".join(filter(None, (label, *clock.names)))[:80] for label, clock in labelled]
    names = [a if labels.count(a) == 1 else b for a, b in zip(labels, longer, strict=True)]
    parts = []
    for name, (_, clock) in zip(unique_names(names), labelled, strict=True):
        columns, origin = [clock.x, *clock.values], clock.origin
        titles = ["time" if clock.x_unit == "s" else "x", *clock.names]
        if clock.begin is not None and clock.x_unit == "s":
            origin = Instant.of(clock.begin, "date")
        units = [clock.x_unit, *clock.units]
        parts.append(FilePart(name, titles, units, len(clock.x), columns.__getitem__, origin=origin))
    yield parts


def _segments(lines: Sequence[str]) -> Iterator[list[_Segment]]:
    """Yield the segments of a file, its lines given, each by clock."""
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
    absolute = "".join(file.get("time_pref", ())[:1]).lower() == "absolute"
    start = ends[0] + 1
    for i, end in enumerate(ends[1:], start=1):
        # The next segment's header begins after the last row of this one, at its line "Channels".
        last = ends[i + 1] if i + 1 < len(ends) else len(lines)
        stop = next((n for n in range(end + 1, last) if lines[n].startswith("Channels")), len(lines))
        head = _header(lines[start:end], separator)
        yield _segment(lines, end + 1, stop, head, _Form(separator, decimal, columns, absolute))
        start = stop


def _header(lines: Sequence[str], separator: str) -> _Head:
    """Return the fields of each keyword, in lower case; special blocks are left out."""
    head, special = dict[str, list[str]](), False
    for line in lines:
        special = (special or line.startswith(_SPECIAL[0])) and not line.startswith(_SPECIAL[1])
        if line.strip() and not special and not line.startswith(_SPECIAL[1]):
            keyword, *fields = (field.strip() for field in line.split(separator))
            head[keyword.lower()] = fields
    return head


class _Form(NamedTuple):
    """Separator, decimal sign, X_Columns in lower case, and whether times count from LabVIEW's instant zero."""

    separator: str
    decimal: str
    columns: str
    absolute: bool


def _segment(lines: Sequence[str], start: int, stop: int, head: _Head, form: _Form) -> list[_Segment]:
    """Return the channels of a segment, by clock."""
    number = _number((head.get("channels") or [""])[0], "Channels")
    if not number <= _MOST:
        raise ValueError(f"Channels: {number:g} are too many")
    count, multi = int(number), form.columns == "multi"
    body = [(n + 1, lines[n].split(form.separator)) for n in range(start, stop) if lines[n].strip()]
    columns = range(1, 2 * count, 2) if multi else range(1, count + 1)
    titles = body.pop(0)[1] if body else []
    if count < 1 or not body or len(titles) <= columns[-1]:
        raise ValueError(f"line {start + 1}: there are no names and values of {count} channels")
    units = [*head.get("y_unit_label", []), *[""] * count]
    clocks: dict[tuple[object, ...], list[int]] = {}
    x: list[Array] = []
    for i, place in enumerate(columns):
        filled = (n for n, (_, row) in enumerate(body, 1) if "".join(row[place : place + 1]).strip())
        last = max(filled, default=0)
        x.append(_x_values(body[:last], head, i, place - 1 if multi else 0, form))
        if not len(x[i]):
            continue
        # Of channels with equal x values the begin may differ, or what the values are.
        key = (x[i].tobytes(), _x_unit(head, i), None if form.absolute else _begin(head, i))
        clocks.setdefault(key, []).append(i)
    return [
        _Segment(
            tuple(titles[columns[i]].strip() for i in members),
            tuple(units[i] for i in members),
            x[members[0]],
            _x_unit(head, members[0]),
            np.array([_column(body[: len(x[i])], columns[i], form.decimal) for i in members]),
            None if form.absolute else _begin(head, members[0]),
            _ZERO if form.absolute else None,
        )
        for members in clocks.values()
    ]


def _x_values(body: _Body, head: _Head, channel: int, column: int, form: _Form) -> Array:
    """Return the x values (n,) of a channel."""
    stated = [_field(head, key, i) for i in (0, channel) for key in ("x0", "delta_x")]
    if form.columns == "no" or (form.columns == "one" and stated[:2] != stated[2:]):
        first, step = (_number(_field(head, key, channel), key, form.decimal) for key in ("x0", "delta_x"))
        if not math.isfinite(first + step * len(body)):
            what = f"X0 = {first:g} and Delta_X = {step:g} of channel {channel + 1}"
            raise ValueError(f"{what} give no finite times")
        return np.asarray(first + step * np.arange(len(body)))
    return _column(body, column, form.decimal)


def _x_unit(head: _Head, channel: int) -> str:
    dimension = _field(head, "x_dimension", channel) or _field(head, "x_dimension", 0) or "Time"
    return "s" if dimension.lower() == "time" else dimension


def _field(head: _Head, keyword: str, channel: int) -> str:
    """Return the field of a channel in a header; an empty text where there is none."""
    return "".join(head.get(keyword, [])[channel : channel + 1])


def _column(body: _Body, index: int, decimal: str) -> Array:
    """Return a column of rows, each with the number of its line."""
    return np.array([_number("".join(row[index : index + 1]), f"line {n}", decimal) for n, row in body])


def _number(text: str, where: str, decimal: str = ".") -> float:
    text = text.strip()
    if not is_number(text, decimal):
        what = f"{text[:40]!r} is not a number" if text else "a number is missing"
        raise ValueError(f"{where}: {what}")
    return to_float(text, decimal)


def _begin(head: _Head, channel: int) -> datetime | None:
    """Return the date and time of day at which a channel of a segment begins, or None."""
    fields = [_field(head, key, channel) or _field(head, key, 0) for key in ("date", "time")]
    written = " ".join(fields).replace(",", ".")
    whole, _, fraction = written.partition(" ")[2].partition(".")
    for date in _DATES:
        try:
            begin = datetime.strptime(f"{written.partition(' ')[0]} {whole}", f"{date} %H:%M:%S")
        except ValueError:
            continue
        return begin.replace(microsecond=round(1e6 * float(f"0.{fraction[:6] or 0}")) % 1_000_000)
    return None


def _join_segments(segments: Sequence[_Segment]) -> _Segment | None:
    """Return segments with the same channels as one table if their times increase; else None."""
    first = segments[0]
    if any((s.names, s.units, s.x_unit) != (first.names, first.units, first.x_unit) for s in segments):
        return None
    shifts = [0.0] * len(segments)
    if any(a.x[-1] >= b.x[0] for a, b in pairwise(segments)):
        # The x values of each segment count from its own begin.
        if first.x_unit != "s" or any(segment.begin is None for segment in segments):
            return None
        shifts = [(segment.begin - first.begin).total_seconds() for segment in segments]  # type: ignore[operator]
    x = np.concatenate([segment.x + shift for segment, shift in zip(segments, shifts, strict=True)])
    if (np.diff(x) <= 0).any() and len(segments) > 1:
        return None
    values = np.concatenate([segment.values for segment in segments], axis=1)
    return replace(first, x=x, values=values)


READER = Reader(
    name="a LabVIEW measurement file (.lvm)",
    recognises=lambda head, suffix: head.removeprefix(b"\xef\xbb\xbf").startswith(_MARK.encode()),
    open_parts=open_parts,
)
