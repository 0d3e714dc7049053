"""The tables of a case file for files with dynamic stiffness: ``bushcli init --from FILES``.

What a file does not say, the reader asks with the keys that would answer it: the first answer is written, with a mark.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from bushcli.case.identified import inline
from bushcli.errors import Problem, RecordingError, count_of
from bushcli.recording.dynamic.columns import MEASURED, meanings
from bushcli.recording.dynamic.lines import states_condition
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.recording.find_table import tables_of_file
from bushcli.recording.guess import modes_of_name
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache
from bushcli.recording.text.table import Table
from cases.mode import modes

# An answer as a problem proposes it.
_PROPOSAL = re.compile(r'\w+ = (?:"[^"]*"|\{\w+ = "[^"]*"\})')


@dataclass(frozen=True)
class DynamicEntry:
    """A file with a table of dynamic stiffness: its source, what was read with it, and remarks on what was guessed."""

    source: DynamicSource
    table: DynamicTable
    remarks: tuple[str, ...]

    @property
    def file(self) -> Path:
        """The file."""
        return self.source.files[0]

    @property
    def mode(self) -> str:
        """Name of the mode."""
        return self.source.mode


def dynamic_entry(file: Path, tables: TableCache) -> DynamicEntry | None:
    """Return how a file with a table of dynamic stiffness is to be read; None if it has no such table.

    Parameters
    ----------
    file : Path
    tables : TableCache
        Cache of the files that the caller reads.

    Raises
    ------
    RecordingError
        It has such a table, which no mode can read.
    """
    try:
        contents = tables_of_file(Source("axial", file, between=states_condition), (), tables)
    except RecordingError:
        return None
    sheets = [contents] if isinstance(contents, Table) else contents.tables
    quantities = [{column.quantity for column in meanings(table)} for table in sheets]
    if not any("frequency" in names and names & set(MEASURED) for names in quantities):
        return None
    named = [mode for specimen in ("bushing", "coupon") for mode in modes_of_name(file.stem, specimen)]
    usual = [mode.name for mode in modes().values() if mode.is_usual and mode.words]
    errors: list[RecordingError] = []
    for mode in dict.fromkeys((*named, *usual)):
        source, remarks = DynamicSource(mode, (file,)), list[str]()
        if mode not in named or len(named) > 1:
            remarks.append("<-- mode: the file name does not state it")
        for _ in fields(source):
            try:
                return DynamicEntry(source, read_dynamic(source, tables), tuple(remarks))
            except RecordingError as error:
                last = error
            source, doubts = _answered(source, last.problems)
            if not doubts:
                break
            remarks += doubts
        errors.append(last)
    raise errors[0]


def _answered(source: DynamicSource, problems: tuple[Problem, ...]) -> tuple[DynamicSource, list[str]]:
    """Return a source with the first answer that each problem proposes, and what was asked; nothing if one has none."""
    remarks = []
    for problem in problems:
        proposal = _PROPOSAL.match(problem.expected)
        if proposal is None:
            return source, []
        ((key, answer),) = tomllib.loads(proposal[0]).items()
        given: Any = getattr(source, key, key)
        if given if not isinstance(answer, dict) else set(answer) & set(given):
            return source, []
        answers: dict[str, Any] = {key: {**given, **answer} if isinstance(answer, dict) else answer}
        source = replace(source, **answers)
        remarks.append(f"<-- {key}: {problem.what}")
    return source, remarks


def dynamic_text(entry: DynamicEntry, name: str, file: str) -> list[str]:
    """Return the lines of a file's table in the case file, given the name of its channel and of the file there."""
    section = "recordings" if modes()[entry.mode].specimen == "bushing" else "coupons"
    curves = len(entry.table.conditions())
    lines = [
        f"# a table of dynamic stiffness: {count_of(len(entry.table), 'row')}, {count_of(curves, 'curve')}"
    ]
    lines += [f"[[{section}]]", f'mode = "{entry.mode}"', 'kind = "dynamic"']
    if name:
        lines.append(f"name = {inline(name)}")
    lines.append(f"file = {inline(file)}")
    for key in ("amplitude_is", "stiffness_is", "loss_angle_is", "across", "quantity"):
        if (answer := getattr(entry.source, key)) is not None:
            lines.append(f'{key} = "{answer}"')
    for key, answers in (("units", entry.source.units), ("rows", entry.source.rows)):
        if answers:
            inside = ", ".join(f"{name} = {inline(answer)}" for name, answer in answers.items())
            lines.append(f"{key} = {{ {inside} }}")
    return [
        *lines,
        *(f"# {remark}" for remark in entry.remarks),
        *(f"# {text}" for text in entry.table.remarks),
    ]
