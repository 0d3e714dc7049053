"""Rows of a study on disk, complete at every moment: whole blocks as Parquet, the other rows as a journal.

A row is appended to the journal as soon as it is known. When all designs of a block have rows, they are written as one
Parquet file in the order of their numbers and removed from the journal. A process that is killed loses only the designs
that it was working on; a row found both in a block and in the journal is read once.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from bushcli.errors import InputError, Problem
from bushcli.runtime.extras import remedy
from bushcli.study.task import CONDITIONS, DESIGN, KIND, REASON, SECONDS, STATUS, Row

#: Designs of a block.
BLOCK = 1000
DEFINITION, JOURNAL = "study.json", "journal.jsonl"
_TEXTS = (STATUS, KIND, REASON, CONDITIONS)


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

    Raises
    ------
    InputError
        The folder cannot be written, or holds another study.
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
        self._waiting: dict[int, Row] = {}
        self._writer, self._parquet = parquet()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if resume:
                self._check(definition)
            else:
                self._empty()
            self._replace(folder / DEFINITION, json.dumps(definition).encode())
            self._read()
            self._journal = (folder / JOURNAL).open("ab")
        except OSError as error:
            raise _unwritable(error, folder) from None

    def add(self, rows: Sequence[Row]) -> None:
        """Save rows, except those of designs that have a row already.

        Parameters
        ----------
        rows : sequence of Row
        """
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
        """Yield the blocks as Arrow tables, in the order of the designs; only one is in memory at a time.

        Parameters
        ----------
        columns : sequence of str or None
            None: all.
        """
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
        """Write all rows as one Parquet file.

        Parameters
        ----------
        path : Path
        """
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
        self._parquet.write_table(
            self._table([self._waiting[n] for n in self._numbers(block)]), fresh, compression="zstd"
        )
        _synced(fresh)
        fresh.replace(file)
        for number in self._numbers(block):
            del self._waiting[number]
        self._journal.close()
        text = b"".join(json.dumps(row).encode() + b"\n" for row in self._waiting.values())
        self._replace(self.folder / JOURNAL, text)
        self._journal = (self.folder / JOURNAL).open("ab")

    def _replace(self, path: Path, content: bytes) -> None:
        fresh = path.with_suffix(".part")
        fresh.write_bytes(content)
        _synced(fresh)
        fresh.replace(path)

    def _check(self, definition: Mapping[str, Any]) -> None:
        file = self.folder / DEFINITION
        if not file.exists():
            return
        try:
            before = json.loads(file.read_text(encoding="utf-8"))
        except ValueError:
            before = None
        now = json.loads(json.dumps(definition))
        if before == now:
            return
        known = before if isinstance(before, dict) else {}
        names = sorted(name for name in now.keys() | known.keys() if now.get(name) != known.get(name))
        what = f"holds another study: {', '.join(names) or 'its definition'} differ"
        wanted = "repeat the options of that run, or leave out --resume to start again"
        raise InputError(Problem(str(self.folder), what, "", wanted))

    def _empty(self) -> None:
        for file in [*self.folder.glob("part-*"), self.folder / JOURNAL, self.folder / DEFINITION]:
            file.unlink(missing_ok=True)

    def _read(self) -> None:
        for block in range(-(-self.count // BLOCK)):
            file = self._file(block)
            try:
                found = self._parquet.read_table(file, columns=[DESIGN])[DESIGN].to_pylist()
            except FileNotFoundError:
                continue
            except (OSError, ValueError, KeyError):
                found = []
            if found != list(self._numbers(block)):
                # Damaged: its designs are solved again.
                file.unlink(missing_ok=True)
                continue
            self.done.update(found)
        journal = self.folder / JOURNAL
        whole: list[bytes] = []
        for line in journal.read_bytes().splitlines() if journal.exists() else []:
            with suppress(ValueError, KeyError, TypeError):
                row = json.loads(line)  # the last line may be cut short
                if row[DESIGN] not in self.done:
                    self._waiting[row[DESIGN]] = row
                    self.done.add(row[DESIGN])
                    whole.append(line + b"\n")
        self._replace(journal, b"".join(whole))
        for block in sorted({number // BLOCK for number in self._waiting}):
            if all(number in self._waiting for number in self._numbers(block)):
                self._journal = journal.open("ab")
                self._settle(block)
                self._journal.close()


def _synced(file: Path) -> None:
    with file.open("rb") as opened:
        os.fsync(opened.fileno())


def _unwritable(error: OSError, folder: Path) -> InputError:
    place = str(error.filename or folder)
    return InputError(
        Problem(
            place, f"cannot be written: {error.strerror or error}", "", "free some space, or give another -o"
        )
    )


def columns_of(keys: Mapping[str, bool], answers: Sequence[str], curves: Sequence[str]) -> dict[str, str]:
    """Return the columns of a study, in the order of the table.

    Parameters
    ----------
    keys : mapping of str to bool
        Varied keys, and whether the values of each are numbers.
    answers, curves : sequence of str
        Names of columns of numbers, and of columns of lists of numbers.
    """
    columns = {DESIGN: "int"} | {key: "float" if number else "text" for key, number in keys.items()}
    columns |= dict.fromkeys((STATUS, KIND, REASON), "text") | dict.fromkeys(answers, "float")
    return columns | {CONDITIONS: "text", SECONDS: "float"} | dict.fromkeys(curves, "floats")
