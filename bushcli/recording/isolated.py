"""Run another library's parser in a separate process, with limits on time and memory, and return what it read.

A file from a rig may be damaged; a parser of a binary format may then loop, take all memory, or crash. In a separate
process that becomes an ordinary error. The child process runs `main` of this module; it writes one line of JSON
and the columns as raw bytes to its standard output.
"""

from __future__ import annotations

import importlib.util
import json
import resource
import subprocess
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.name import heading, named_columns
from bushcli.recording.header.units import tabulated_unit
from bushcli.recording.reader import FilePart, Reader, readers
from bushcli.recording.text.clock_times import Instant
from bushcli.recording.text.table import ArrayTable, Table
from bushcli.recording.text_file import table_of_fields
from bushcli.runtime.extras import remedy

#: Processor time, s, and bytes of address space that a child may take; below, the factor of the clock time on a busy
#: machine.
LONGEST, MOST_MEMORY = 60, 6_000_000_000
_WAITING = 5
#: Numbers up to which all columns of a file are read; of larger files only the columns that may be needed.
_MOST_NUMBERS = 5_000_000
#: Largest number of samples of a table, and of all numbers that are read.
MOST_SAMPLES, _MOST_IN_ALL = 5_000_000, 40_000_000
_MOST_PARTS, _MOST_NAMES = 2_000, 20_000
_FAILED = "bushcli failed: "
#: Columns that were read; None where one was not.
_Columns = Sequence[NDArray[Any] | None]
_ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class FileContents:
    """Contents of a file.

    Attributes
    ----------
    tables : tuple of Table
    failed : mapping of str to RecordingError
        Errors of the sheets without a valid table, by name.
    """

    tables: tuple[Table, ...]
    failed: Mapping[str, RecordingError]

    @property
    def size(self) -> int:
        """Memory that it takes, in numbers of 8 bytes."""
        return sum(len(table) * len(table.names) for table in self.tables)


def read_tables(path: Path, format_name: str, wanted: Collection[str | int]) -> FileContents:
    """Return the tables of a binary file."""
    reader = readers()[format_name]
    if not reader.library:
        try:
            with reader.open_parts(path) as parts:
                return _file_contents(path, ((part, _columns(part, wanted, True)) for part in parts))
        except (OSError, ValueError, OverflowError, MemoryError) as error:
            raise _damage_error(path, reader, str(error)) from None
    if importlib.util.find_spec(reader.library) is None:
        what = f"is {reader.name}; {reader.library}, which reads it, is not installed"
        raise RecordingError(Problem(str(path), what, "", remedy("rig")))
    return _file_contents(path, _parts_of_answer(child_output(path, reader, format_name, wanted)))


def child_output(path: Path, reader: Reader, format_name: str, wanted: Collection[str | int]) -> bytes:
    """Return what a child writes that reads a file, see `main`."""
    # -P, because a file in the user's folder may have the name of a module. The path to the packages is appended for a
    # checkout that is not installed.
    start = f"import sys; sys.path.append({str(_ROOT)!r}); from {__name__} import main; main(*sys.argv[1:])"
    command = [sys.executable, "-P", "-W", "ignore", "-c", start, format_name, str(path)]
    command.append(json.dumps(list(wanted)))
    try:
        process = subprocess.run(
            command, capture_output=True, timeout=_WAITING * LONGEST, stdin=subprocess.DEVNULL, check=False
        )
    except subprocess.TimeoutExpired:
        raise _damage_error(path, reader, f"reading it takes more than {_WAITING * LONGEST} s") from None
    if process.returncode:
        # Other lines that a failing parser prints are not the reason.
        lines = process.stderr.decode("utf-8", "replace").splitlines()
        messages = [line.removeprefix(_FAILED) for line in lines if line.startswith(_FAILED)]
        crashed = "its parser crashes or needs too much time"
        raise _damage_error(path, reader, messages[0] if messages else crashed)
    return process.stdout


def _file_contents(path: Path, parts: Iterable[tuple[FilePart, _Columns]]) -> FileContents:
    tables, failed = list[Table](), {}
    for part, columns in parts:
        if part.cells is None:
            table = ArrayTable(
                path=path,
                names=tuple(" ".join(name.split()) for name in part.names),
                units=tuple(part.units),
                part=part.name,
                columns=tuple(columns),
                remarks=tuple(part.remarks),
                origin=None if part.origin is None else Instant(*part.origin),
            )
            tables.append(table)
            continue
        try:
            sheet = table_of_fields(path, part.name, part.cells)
        except RecordingError as error:
            failed[part.name] = error
            continue
        # A date above the header is none of the column.
        dates = {column: Instant(*first) for column, count, first in part.dates if count >= len(sheet)}
        tables.append(replace(sheet, dates=dates))
    return FileContents(tuple(tables), failed)


def _damage_error(path: Path, reader: Reader, reason: str) -> RecordingError:
    what = f"cannot be read as {reader.name}: {reason[:300]}"
    return RecordingError(Problem(str(path), what, "", "is it complete? if so, export it again or as CSV"))


def _parts_of_answer(answer: bytes) -> Iterator[tuple[FilePart, _Columns]]:
    head, _, content = answer.partition(b"\n")
    offset = 0
    for shown in json.loads(head):
        columns = list[NDArray[Any] | None]()
        for kind in shown.pop("kinds"):
            columns.append(None if kind is None else np.frombuffer(content, kind, shown["samples"], offset))
            offset += 0 if columns[-1] is None else columns[-1].nbytes
        yield FilePart(**shown), columns


def _columns(part: FilePart, wanted: Collection[str | int], all_of_them: bool) -> list[NDArray[Any] | None]:
    """Return the columns of a part that hold numbers; None for others and, unless all are wanted, for unneeded ones."""
    columns: list[NDArray[Any] | None] = []
    for i, name in enumerate(part.names):
        values, texts = None, (part.units[i], *heading(name).written)
        meant = named_columns([name]) > 0 or any(tabulated_unit(text) is not None for text in texts)
        if part.load and (all_of_them or i + 1 in wanted or name in wanted or meant):
            values = part.load(i)
            if values.dtype.kind not in "iufbmM" or values.ndim != 1:
                values = None
        columns.append(values)
    return columns


def main(format_name: str, path: str, wanted: str) -> None:
    """Run as the child: read a file and write its contents to standard output, or to standard error why not."""
    try:
        # asammdf prints a greeting and pyarrow warnings to the standard output, where the columns are expected.
        output, sys.stdout = sys.stdout.buffer, sys.stderr
        for what, soft, hard in (
            (resource.RLIMIT_CPU, LONGEST, LONGEST + 5),
            (resource.RLIMIT_AS, MOST_MEMORY, MOST_MEMORY),
            (resource.RLIMIT_CORE, 0, 0),
        ):
            # A limit of the shell may be narrower, and nobody may widen it.
            most = resource.getrlimit(what)[1]
            most = hard if most == resource.RLIM_INFINITY else min(hard, most)
            resource.setrlimit(what, (min(soft, most), most))
        copy_contents(format_name, Path(path), json.loads(wanted), output)
    except MemoryError:
        _fail(f"reading it takes more than {MOST_MEMORY / 1e9:g} GB")
    except Exception as error:  # noqa: BLE001 - a parser may raise anything for a damaged file
        _fail(" ".join(str(error).split()) or type(error).__name__)


def _fail(reason: str) -> None:
    sys.stderr.write(f"\n{_FAILED}{reason}\n")
    sys.exit(1)


def copy_contents(format_name: str, path: Path, wanted: Collection[str | int], output: BinaryIO) -> None:
    """Read a file in this process, and write its contents as the child does."""
    shown, arrays = [], []
    with readers()[format_name].open_parts(path) as parts:
        if len(parts) > _MOST_PARTS or sum(len(part.names) for part in parts) > _MOST_NAMES:
            raise ValueError(f"has more than {_MOST_PARTS} groups or {_MOST_NAMES} columns")
        longest = max((part.samples for part in parts), default=0)
        if longest > MOST_SAMPLES:
            most = f"at most {MOST_SAMPLES}: every tenth is enough for a fit"
            raise ValueError(f"has {longest} samples; {most}")
        whole = sum(part.samples * len(part.names) for part in parts) <= _MOST_NUMBERS
        for part in parts:
            columns = _columns(part, wanted, whole)
            arrays += [column for column in columns if column is not None]
            if sum(map(len, arrays)) > _MOST_IN_ALL:
                numbers = f"{_MOST_IN_ALL / 1e6:g} million numbers"
                raise ValueError(f"has more than {numbers}; export only those needed")
            described = {f.name: getattr(part, f.name) for f in fields(part) if f.name != "load"}
            shown.append(described | {"kinds": [None if c is None else c.dtype.str for c in columns]})
    output.write(json.dumps(shown).encode() + b"\n")
    for array in arrays:
        output.write(np.ascontiguousarray(array).view(np.uint8).data)
    output.flush()
