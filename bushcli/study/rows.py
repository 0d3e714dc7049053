"""Rows of a study on disk, complete at every moment: whole blocks as Parquet, the other rows as a journal.

A row is appended to the journal as soon as it is known. When all designs of a block have rows, they are written as one
Parquet file in the order of their numbers and removed from the journal. A process that is killed loses only the designs
that it was working on; a row found both in a block and in the journal is read once.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from bushcli.errors import InputError, Problem
from bushcli.runtime.bounded import read_bounded
from bushcli.runtime.extras import remedy
from bushcli.study.task import CONDITIONS, DESIGN, KIND, REASON, SECONDS, STATUS, Row

#: Designs of a block.
BLOCK = 1000
DEFINITION, JOURNAL = "study.json", "journal.jsonl"
_TEXTS = (STATUS, KIND, REASON, CONDITIONS)
# Files that a study writes into its folder; others are left alone.
_OWN = re.compile(r"part-\d{6,}\.(parquet|part)|(study|journal)\.(jsonl?|part)")
# Largest admissible sizes of the definition and of a file of rows, bytes: curves of 1000 designs have some 10 MB.
_LARGEST_DEFINITION, _LARGEST = 10_000_000, 1_000_000_000
# Errors of JSON and Parquet for overwritten bytes.
_DAMAGED = (OSError, ValueError, TypeError, LookupError, ArithmeticError, RuntimeError, MemoryError)


def parquet() -> tuple[Any, Any]:
    """Return the modules that read and write Parquet.

    Raises
    ------
    InputError
        They are not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        what = "writes Parquet with pyarrow, which is not installed"
        raise InputError(Problem("study", what, "", remedy("study"))) from None
    return pyarrow, pyarrow.parquet


class Rows:
    """The rows of a study in a folder.

    Parameters
    ----------
    folder : Path
    definition : mapping
        What identifies the study, JSON-ready: rows of another study are not mixed with its rows.
    columns : mapping of str to str
        Column -> "int", "float", "text" or "floats".
    count : int
        Number of designs.
    resume : bool
        Keep the rows in the folder; otherwise the folder is emptied.

    Attributes
    ----------
    done : set of int
        Numbers of the designs that have a row.
    damaged : int
        Number of saved rows that were found damaged: their designs are solved again.

    Raises
    ------
    InputError
        The folder cannot be written, holds another study, or has symbolic links in place of its files.
    """

    def __init__(
        self,
        folder: Path,
        definition: Mapping[str, Any],
        columns: Mapping[str, str],
        count: int,
        resume: bool = False,
    ) -> None:
        self.folder, self.columns, self.count = folder, dict(columns), count
        self.done: set[int] = set()
        self.damaged = 0
        self._waiting: dict[int, Row] = {}
        self._writer, self._parquet = parquet()
        try:
            _refuse_link(folder)
            folder.mkdir(parents=True, exist_ok=True)
            self._own = [file for file in folder.iterdir() if _OWN.fullmatch(file.name)]
            for file in self._own:
                _refuse_link(file)
            if resume:
                self._check(definition)
            else:
                for file in self._own:
                    file.unlink(missing_ok=True)
            self._replace(folder / DEFINITION, json.dumps(definition).encode())
            self._read()
            self._journal = (folder / JOURNAL).open("ab")
        except OSError as error:
            raise _unwritable(error, folder) from None

    def add(self, rows: Sequence[Row]) -> None:
        """Save rows, except those of designs that have a row already."""
        fresh = [row for row in rows if row[DESIGN] not in self.done]
        try:
            for row in fresh:
                self._journal.write(json.dumps(row).encode() + b"\n")
                self._waiting[row[DESIGN]] = row
                self.done.add(row[DESIGN])
            self._journal.flush()
            os.fsync(self._journal.fileno())
            for block in sorted({row[DESIGN] // BLOCK for row in fresh}):
                if all(number in self._waiting for number in self._numbers(block)):
                    self._settle(block)
        except OSError as error:
            raise _unwritable(error, self.folder) from None

    def close(self) -> None:
        """Close the journal."""
        with suppress(OSError):
            self._journal.close()

    def tables(self, columns: Sequence[str] | None = None) -> Iterator[Any]:
        """Yield the blocks as Arrow tables, in the order of the designs; only one is in memory at a time."""
        for block in range(-(-self.count // BLOCK)):
            file = self._file(block)
            if file.exists():
                yield self._parquet.read_table(file, columns=None if columns is None else list(columns))
                continue
            rows = [self._waiting[n] for n in self._numbers(block) if n in self._waiting]
            if rows:
                table = self._table(rows)
                yield table if columns is None else table.select(list(columns))

    def write(self, path: Path) -> None:
        """Write all rows as one Parquet file."""
        with self._parquet.ParquetWriter(path, self._schema, compression="zstd") as writer:
            for table in self.tables():
                writer.write_table(table)

    # -- on disk -------------------------------------------------------------------------------------------------

    @property
    def _schema(self) -> Any:
        kinds = {
            "int": self._writer.int64(),
            "float": self._writer.float64(),
            "text": self._writer.string(),
            "floats": self._writer.list_(self._writer.float64()),
        }
        return self._writer.schema([(name, kinds[kind]) for name, kind in self.columns.items()])

    def _table(self, rows: Sequence[Row]) -> Any:
        columns = {name: [row.get(name) for row in rows] for name in self.columns}
        return self._writer.Table.from_pydict(columns, schema=self._schema)

    def _numbers(self, block: int) -> range:
        return range(block * BLOCK, min((block + 1) * BLOCK, self.count))

    def _file(self, block: int) -> Path:
        return self.folder / f"part-{block:06d}.parquet"

    def _settle(self, block: int) -> None:
        """Write a block, and the journal without it."""
        file = self._file(block)
        fresh = file.with_suffix(".part")
        fresh.unlink(missing_ok=True)
        with fresh.open("xb") as out:
            rows = self._table([self._waiting[n] for n in self._numbers(block)])
            self._parquet.write_table(rows, out, compression="zstd", write_page_checksum=True)
        _sync(fresh)
        fresh.replace(file)
        for number in self._numbers(block):
            del self._waiting[number]
        self._journal.close()
        text = b"".join(json.dumps(row).encode() + b"\n" for row in self._waiting.values())
        self._replace(self.folder / JOURNAL, text)
        self._journal = (self.folder / JOURNAL).open("ab")

    def _replace(self, path: Path, content: bytes) -> None:
        fresh = path.with_suffix(".part")
        fresh.unlink(missing_ok=True)
        with fresh.open("xb") as out:
            out.write(content)
        _sync(fresh)
        fresh.replace(path)

    def _check(self, definition: Mapping[str, Any]) -> None:
        """Refuse to resume another study, or one that cannot be identified."""
        file = self.folder / DEFINITION
        expected = "restore the file, or leave out --resume, which begins rows of its own"
        if file not in self._own:
            if any(other.suffix != ".part" for other in self._own):
                what = "is missing: it is not known to which study the saved designs belong"
                raise InputError(Problem(str(file), what, "", expected))
            return
        try:
            before = dict(json.loads(read_bounded(file, _LARGEST_DEFINITION)))
        except (*_DAMAGED, RecursionError) as error:
            what = f"is damaged ({str(error)[:200]})"
            raise InputError(Problem(str(file), what, "", expected)) from None
        now = json.loads(json.dumps(definition))
        if before == now:
            return
        names = sorted(name for name in now.keys() | before.keys() if now.get(name) != before.get(name))
        what = f"holds another study: {', '.join(names)} differ"
        wanted = "repeat the options of that run, or leave out --resume, which begins rows of its own"
        raise InputError(Problem(str(self.folder), what, "", wanted))

    def _read(self) -> None:
        for block in range(-(-self.count // BLOCK)):
            file, numbers = self._file(block), self._numbers(block)
            if not os.path.lexists(file):
                continue
            if self._is_whole(file, numbers):
                self.done.update(numbers)
            else:
                self.damaged += len(numbers)
                file.unlink()
        journal = self.folder / JOURNAL
        lines = list(self._read_journal(journal))
        self._replace(journal, b"".join(lines))
        for block in sorted({number // BLOCK for number in self._waiting}):
            if all(number in self._waiting for number in self._numbers(block)):
                self._journal = journal.open("ab")
                self._settle(block)
                self._journal.close()

    def _is_whole(self, file: Path, numbers: range) -> bool:
        """Whether a block has the rows of these designs, undamaged in all columns."""
        try:
            content = self._writer.BufferReader(read_bounded(file, _LARGEST))
            table = self._parquet.read_table(content, page_checksum_verification=True)
            return bool(
                table.schema.equals(self._schema)
                and table[DESIGN].to_pylist() == list(numbers)
                and not any(table[name].null_count for name in (*_TEXTS, SECONDS))
            )
        except _DAMAGED:
            return False

    def _read_journal(self, journal: Path) -> Iterator[bytes]:
        """Take rows from the journal, and yield their lines."""
        try:
            content = read_bounded(journal, _LARGEST) if os.path.lexists(journal) else b""
        except (OSError, ValueError):
            self.damaged += 1
            return
        for line in content.splitlines(keepends=True):
            try:
                row = dict(json.loads(line))
                number = self._number(row)
            except (*_DAMAGED, RecursionError):
                # A process that is killed cuts its last line short, which is no damage.
                self.damaged += line.endswith(b"\n")
                continue
            if number not in self.done:
                self._waiting[number] = row
                self.done.add(number)
                yield line.rstrip(b"\r\n") + b"\n"

    def _number(self, row: Row) -> int:
        """Return the number of a row's design; raise an error if the row lacks columns of the study."""
        self._table([row])
        number = row[DESIGN]
        if not (type(number) is int and 0 <= number < self.count):
            raise ValueError(number)
        if any(row[name] is None for name in (*_TEXTS, SECONDS)):
            raise ValueError(number)
        return number


def is_defined(folder: Path, definition: Mapping[str, Any]) -> bool:
    """Whether a folder holds the rows of the study with this definition."""
    try:
        saved = json.loads(read_bounded(folder / DEFINITION, _LARGEST_DEFINITION))
    except (*_DAMAGED, RecursionError):
        return False
    return bool(saved == json.loads(json.dumps(definition)))


def _refuse_link(path: Path) -> None:
    if path.is_symlink():
        what = "is a symbolic link, which is not followed"
        raise InputError(Problem(str(path), what, "", "give another -o, or delete the link"))


def _sync(file: Path) -> None:
    with file.open("rb") as opened:
        os.fsync(opened.fileno())


def _unwritable(error: OSError, folder: Path) -> InputError:
    place, what = str(error.filename or folder), f"cannot be written: {error.strerror or error}"
    return InputError(Problem(place, what, "", "free some space, or give another -o"))


def columns_of(keys: Mapping[str, bool], answers: Sequence[str], curves: Sequence[str]) -> dict[str, str]:
    """Return the columns of a study, in the order of the table."""
    columns = {DESIGN: "int"} | {key: "float" if number else "text" for key, number in keys.items()}
    columns |= dict.fromkeys((STATUS, KIND, REASON), "text") | dict.fromkeys(answers, "float")
    return columns | {CONDITIONS: "text", SECONDS: "float"} | dict.fromkeys(curves, "floats")
