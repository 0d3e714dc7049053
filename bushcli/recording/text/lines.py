"""Lines of a text file, and their fields."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from bushcli.errors import Problem, RecordingError
from bushcli.recording.text.fields import begins_with_missing, is_grouped, is_number, only_numbers

COMMENTS = ("#", "%", "//")
#: Bound on the work: a line of a thousand columns has some ten thousand characters.
LONGEST_LINE = 20_000
#: A quotation mark that begins a field, and one that ends it; an inch (") stands behind a name instead.
_OPEN, _CLOSED = re.compile(r'(?:^|[,;\t])\s*"[^"]*$'), re.compile(r'^[^"]*"\s*(?:$|[,;\t])')
#: Most line breaks within the names of a header: judgement, two for each of twenty columns.
_BREAKS = 40


@dataclass(frozen=True)
class Line:
    """A line that is not empty: its number from 1, its text, and whether it is a comment."""

    number: int
    text: str
    comment: bool

    @property
    def content(self) -> str:
        """The text without the signs that make it a comment."""
        return re.sub(r"^\s*(#|%(?=\s)|//)+", "", self.text)


class Dialect(NamedTuple):
    """Delimiter and decimal sign of a text."""

    delimiter: str
    decimal: str


@dataclass(frozen=True)
class Sheet:
    """The lines of a table while its rows are told from its header: all, and those that are no comments as fields.

    Attributes
    ----------
    path : Path
    lines : list of Line
    body : list of Line
        Lines that are no comments.
    split : list of list of str
        Their fields.
    dialect : Dialect
    start : int
        Index, in the body, of the first row of numbers.
    """

    path: Path
    lines: list[Line]
    body: list[Line]
    split: list[list[str]]
    dialect: Dialect
    start: int = 0

    @property
    def first_row_line(self) -> int:
        """Number of the line of the first row."""
        return self.body[self.start].number

    @property
    def above(self) -> list[Line]:
        """Lines above it."""
        return [line for line in self.lines if line.number < self.first_row_line]

    def refusal(self, line: int, what: str, remedy: str) -> RecordingError:
        """Return an error about a line."""
        return RecordingError(Problem(f"{self.path}:{line}", what, "", remedy))


def lines_of(path: Path, text: str, first: int = 1) -> list[Line]:
    """Return the lines of a text that have more than blanks and delimiters."""
    lines, physical, index = list[Line](), text.split("\n"), 0
    while index < len(physical):
        line, number = physical[index], index + first
        index += 1
        if line.count('"') % 2 and _OPEN.search(line):
            # A line break within quotation marks, as in a cell of Excel, is a blank.
            for end in range(index, min(index + _BREAKS, len(physical))):
                whole = " ".join([line, *physical[index : end + 1]])
                if whole.count('"') % 2 == 0 and _CLOSED.search(physical[end]):
                    line, index = whole, end + 1
                    break
        if len(line) > LONGEST_LINE:
            what = f"has {len(line)} characters"
            expected = f"at most {LONGEST_LINE} in a line: is this a recording, and does it have line ends?"
            raise RecordingError(Problem(f"{path}:{number}", what, "", expected))
        # An empty row of a spreadsheet has delimiters only.
        if line.strip(" \t\r\f\v;,|"):
            comment = line.lstrip().startswith(COMMENTS) and not begins_with_missing(line)
            lines.append(Line(number, line, comment))
    return lines


def split_line(text: str, delimiter: str) -> list[str]:
    """Return the fields of a line."""
    if delimiter == " ":
        text = text.replace("\t", " ").strip()
    if delimiter == "|":
        # A table in Markdown begins and ends its rows with the delimiter.
        text = text.strip().removeprefix("|").removesuffix("|")
    # In a row of units, a single quotation mark means an inch.
    if text.count('"') % 2 == 0 and '"' in text:
        try:
            fields = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
            return [f.strip() for f in fields if f.strip() or delimiter != " "]
        except (csv.Error, StopIteration):
            pass
    return text.split() if delimiter == " " else [field.strip() for field in text.split(delimiter)]


def trim_end(fields: list[str]) -> list[str]:
    """Return the fields without empty ones at the end: trailing delimiters."""
    end = len(fields)
    while end and not fields[end - 1]:
        end -= 1
    return fields[:end]


def numbers_in(fields: list[str], decimal: str) -> int:
    """Return how many of the fields of a line are numbers."""
    return (
        len(fields) - fields.count("")
        if only_numbers(fields, decimal)
        else sum(is_number(field, decimal) or is_grouped(field, decimal) for field in fields)
    )
