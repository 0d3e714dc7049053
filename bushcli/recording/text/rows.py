"""Rows of a text: fields line by line, and long runs of lines of numbers, which are recognised and parsed in bulk."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.text.fields import NUMBER, is_grouped, is_number, only_numbers, to_float
from bushcli.recording.text.lines import COMMENTS, Line, lines_of, split_line, trim_end

Array = NDArray[np.float64]
Index = NDArray[np.int_]

#: Lines of a file, at its beginning, from which the form of its rows is taken, and least number of lines of a run: up
#: to these, reading line by line takes a tenth of a second.
HEAD = 2_000
#: Lines before the end of the head that must have that form.
_ALIKE = 200
#: Characters that are parsed at a time, so that the fields of a large file are never in memory together.
_PIECE = 1_000_000


@dataclass(frozen=True)
class Form:
    """The form of a row: delimiter, decimal sign, fields, empty ones at its end, and which of them are numbers."""

    delimiter: str
    decimal: str
    empty: int
    numeric: tuple[bool, ...]

    @staticmethod
    def of_head(head: Sequence[Line], delimiter: str, decimal: str) -> Form | None:
        """Return the form that the last lines of a head have; None where they differ, or have one only by lines."""
        rows = [split_line(line.text, delimiter) for line in head[-_ALIKE:]]
        filled = {len(trim_end(fields)) for fields in rows}
        if len({len(fields) for fields in rows}) != 1 or len(filled) != 1 or delimiter in (decimal, "|"):
            return None
        width = filled.pop()
        columns = list(zip(*(fields[:width] for fields in rows), strict=True))
        numeric = tuple(all(re.fullmatch(NUMBER[decimal], t, re.ASCII) for t in column) for column in columns)
        for texts, plain in zip(columns, numeric, strict=True):
            if not plain and any(is_grouped(text, decimal) or is_number(text, decimal) for text in texts):
                return None
        # A row has two numbers, and not more texts than numbers.
        numbers = sum(numeric)
        if numbers < 2 or 2 * numbers < len(numeric):
            return None
        return Form(delimiter, decimal, len(rows[0]) - len(numeric), numeric)

    @cached_property
    def lines(self) -> re.Pattern[str]:
        """Consecutive lines of the form, each with its end; without backtracking, so that the work is proportional."""
        blanks, number = ("[ ]*+", NUMBER[self.decimal])
        number = rf'{blanks}(?:{number}|"{number}"){blanks}'
        text = rf'[^{self.delimiter}\n"]*+'
        between = re.escape(self.delimiter)
        if self.delimiter == " ":
            number, text, between = NUMBER[self.decimal], r'[^\s"]++', "[ \t]++"
        fields = between.join(number if plain else text for plain in self.numeric)
        end = rf"(?:{between}[ ]*+){{{self.empty}}}" if self.empty else ""
        end += "[ \t]*+" if self.delimiter == " " else ""
        lead = r"[ \t]*+" if self.delimiter == " " else ""
        comment = "" if self.numeric[0] else rf"(?!\s*+(?:{'|'.join(map(re.escape, COMMENTS))}))"
        return re.compile(rf"(?:{comment}{lead}{fields}{end}\n)*+", re.ASCII)


@dataclass(frozen=True, eq=False)
class SplitRows:
    """Rows of fields without surrounding blanks, and the number of the line of each, from 1."""

    fields: list[list[str]] = field(repr=False)
    lines: list[int] = field(repr=False)

    def __len__(self) -> int:
        return len(self.fields)

    @property
    def size(self) -> int:
        """Memory that it takes, in numbers of 8 bytes: about eight for each field."""
        return 8 * sum(map(len, self.fields))

    def line(self, row: int) -> int:
        """Return the number of the line of a row, from 0."""
        return self.lines[row]

    def text(self, row: int, column: int) -> str:
        """Return a field; an empty text where the row has fewer."""
        fields = self.fields[row]
        return fields[column] if column < len(fields) else ""

    def texts(self, column: int) -> list[str]:
        """Return the fields of a column."""
        return [fields[column] if column < len(fields) else "" for fields in self.fields]

    def parse_column(self, column: int, decimal: str) -> tuple[Array, bool]:
        """Return the fields of a column as numbers (n,), nan where they are none, and whether all are numbers."""
        texts = self.texts(column)
        return np.array([to_float(text, decimal) for text in texts]), only_numbers(texts, decimal)

    def of_rows(self, rows: Index) -> SplitRows:
        """Return some rows, by their indices (n,) from 0."""
        return SplitRows([self.fields[i] for i in rows], [self.lines[i] for i in rows])


@dataclass(frozen=True, eq=False)
class AlikeRows:
    """Consecutive lines of one form: characters ``begin:end`` of the text, the first of which is line `at`, from 1."""

    whole: str = field(repr=False)
    begin: int
    end: int
    at: int
    form: Form

    @cached_property
    def _ends(self) -> NDArray[np.int64]:
        lengths = [np.fromiter(map(len, piece.split("\n")[:-1]), dtype=np.int64) for piece in self._pieces()]
        return self.begin - 1 + np.cumsum(np.concatenate([*lengths, [0]])[:-1] + 1)

    @cached_property
    def _count(self) -> int:
        return self.whole.count("\n", self.begin, self.end)

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> int:
        """Memory that it takes, in numbers of 8 bytes."""
        return (self.end - self.begin) // 8

    def line(self, row: int) -> int:
        """Return the number of the line of a row, from 0."""
        return self.at + row

    def text(self, row: int, column: int) -> str:
        """Return a field; an empty text where the row has fewer."""
        start = self.begin if row == 0 else int(self._ends[row - 1]) + 1
        fields = split_line(self.whole[start : int(self._ends[row])], self.form.delimiter)
        return fields[column] if column < len(fields) else ""

    def _pieces(self) -> Iterator[str]:
        position = self.begin
        while position < self.end:
            end = self.whole.rfind("\n", position, min(position + _PIECE, self.end)) + 1
            yield self.whole[position:end]
            position = end

    def texts(self, column: int) -> list[str]:
        """Return the fields of a column."""
        if column >= len(self.form.numeric):
            return [""] * len(self)
        lines = (line for piece in self._pieces() for line in piece.split("\n")[:-1])
        return [split_line(line, self.form.delimiter)[column] for line in lines]

    def parse_column(self, column: int, decimal: str) -> tuple[Array, bool]:
        """Return the fields of a column as numbers (n,), nan where they are none, and whether all are numbers."""
        if column >= len(self.form.numeric) or not self.form.numeric[column]:
            return np.full(len(self), np.nan), False
        numbers = []
        for piece in self._pieces():
            # What stands in other columns is not parsed.
            text = piece.replace("D", "e").replace("d", "e").replace('"', "")
            lines = (text.replace(",", ".") if self.form.decimal == "," else text).split("\n")[:-1]
            delimiter = None if self.form.delimiter == " " else self.form.delimiter
            numbers.append(np.loadtxt(lines, usecols=column, delimiter=delimiter, comments=None, ndmin=1))
        return np.concatenate(numbers), True

    def of_rows(self, rows: Index) -> AlikeRows | SplitRows:
        """Return some rows, by their indices (n,) from 0; consecutive ones remain a run."""
        if len(rows) and rows[-1] - rows[0] == len(rows) - 1:
            start = self.begin if rows[0] == 0 else int(self._ends[rows[0] - 1]) + 1
            return replace(self, begin=start, end=int(self._ends[rows[-1]]) + 1, at=self.at + int(rows[0]))
        width = len(self.form.numeric)
        fields = [[self.text(i, k) for k in range(width)] for i in rows]
        return SplitRows(fields, [self.line(int(i)) for i in rows])


def end_of_head(text: str) -> int:
    """Return where the line behind the head of a long text begins; 0 in a text that has no room for a run."""
    position = 0
    for _ in range(HEAD):
        position = text.find("\n", position) + 1
        if not position:
            return 0
    return position if text.count("\n", position) > HEAD else 0


def split_runs(path: Path, text: str, begin: int, form: Form) -> tuple[list[Line], list[AlikeRows]]:
    """Return the runs of a form behind a head, and all other lines; the last line of a run is one of these."""
    lines: list[Line] = []
    runs: list[AlikeRows] = []
    rest, number, position = 0, 1, begin
    while position < len(text):
        match = form.lines.match(text, position)
        end = match.end() if match else position
        if end > position and (count := text.count("\n", position, end)) > HEAD:
            lines += lines_of(path, text[rest:position], number)
            number += text.count("\n", rest, position)
            rest = text.rfind("\n", position, end - 1) + 1
            runs.append(AlikeRows(text, position, rest, number, form))
            number += count - 1
        position = (text.find("\n", end) + 1) or len(text)
    return [*lines, *lines_of(path, text[rest:], number)], runs
