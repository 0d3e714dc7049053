"""Rows of a table of dynamic stiffness: merged cells, and several directions or specimens one below the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import count_of
from bushcli.recording.dynamic.columns import ERRORS, MEASURED
from bushcli.recording.header.vocabulary import plain_name
from bushcli.recording.quantities import word_set
from bushcli.recording.several import BESIDE_LABELS, LABELS, rows_key
from bushcli.recording.text.rows import SplitRows
from bushcli.recording.text.table import Table, TextTable

#: Words of a column of tests: rows of several are one table, unless they repeat a condition.
_OF_TESTS = word_set("id test run curve part versuch kurve messung essai prova ensayo")
#: Words of a column of directions and specimens, the rows of which are never one table.
_ALWAYS_APART = (LABELS - _OF_TESTS) | word_set(
    "direction dir richtung axis achse orientation bushing buchse"
)
#: And of one whose rows are one table unless they repeat a condition: a rig has a mode for each range of frequencies.
_APART = _ALWAYS_APART | word_set("mode channel kanal part")


def with_merged_cells(table: Table, taken: Mapping[int, str]) -> Table:
    """Return a table with a value in each empty field of merged cells: that above it.

    Cells are merged where at least half of a column is empty, and no value stands directly below the same one. Only
    conditions, and the names of directions, specimens and tests, are filled so. An amplitude may be empty as one of a
    small vibration, so that single empty fields among its values are none of merged cells.

    Parameters
    ----------
    table : Table
    taken : mapping of int to str
        Quantity by column, from 0.
    """
    if not isinstance(table, TextTable):
        return table
    rows, width, remarks = range(len(table)), len(table.names), list[str]()
    filled: dict[int, list[str]] = {}
    for column in range(width):
        texts = [table.text(row, column) for row in rows]
        empty = texts.count("")
        merged = (
            texts[:1] != [""] and len(texts) <= 2 * empty and all(a != b or not a for a, b in pairwise(texts))
        )
        if taken.get(column) == "amplitude":
            merged &= any(not a and not b for a, b in pairwise(texts))
        if merged and (
            taken[column] not in (*MEASURED, *ERRORS) if column in taken else _label_words(table, column)
        ):
            for row in rows[1:]:
                texts[row] = texts[row] or texts[row - 1]
            filled[column] = texts
            above = "hold the value above them, as merged cells do"
            remarks.append(f"{table.label(column)}: {count_of(empty, 'empty field')} {above}")
    if not filled:
        return table
    fields = [[filled[c][row] if c in filled else table.text(row, c) for c in range(width)] for row in rows]
    parts = (SplitRows(fields, [table.line(row) for row in rows]),)
    return replace(table, parts=parts, remarks=(*table.remarks, *remarks))


def refuse_mixed_rows(table: Table, unused: Sequence[int], levels: Sequence[NDArray[np.intp]]) -> None:
    """Refuse a table with several directions, channels or specimens, which a column that is not used tells apart.

    Only a column whose name has a word for them, or for tests, does so: a status or a note of each row does not. Unless
    it is one of directions or specimens, rows of the same conditions must have different labels.

    Parameters
    ----------
    table : Table
        n rows.
    unused : sequence of int
        Columns, from 0.
    levels : sequence of (n,) arrays
        Number of the level of each condition, see `bushcli.recording.dynamic.table.level_numbers`.
    """
    rows = range(len(table))
    conditions = [tuple(int(level[row]) for level in levels) for row in rows]
    for column in unused:
        texts = [table.text(row, column) for row in rows]
        labels = list(dict.fromkeys(text for text in texts if text))
        named = set(plain_name(table.names[column]).split()) & (_APART | LABELS)
        always = bool(_label_words(table, column) & _ALWAYS_APART)
        # What differs from row to row is a time or a count; numbers may be those of repeated runs.
        are_labels = named & _APART or any(text[:1].isalpha() for text in labels)
        if not (named and are_labels and 1 < len(labels) <= len(table) / 2):
            continue
        of_condition: dict[tuple[int, ...], set[str]] = {}
        for condition, text in zip(conditions, texts, strict=True):
            of_condition.setdefault(condition, set()).update({text} - {""})
        if always or any(len(several) > 1 for several in of_condition.values()):
            shown = ", ".join(labels[:4]) + (", ..." if len(labels) > 4 else "")
            what = f"{table.label(column)} tells rows apart ({shown}), and one recording has one of them"
            remedy = (
                f"{rows_key(table.names[column], labels[0])} in the recording's table, and a table for each"
            )
            raise table.refusal(what, f"{remedy}; or delete the column, if it says something else")


def _label_words(table: Table, column: int) -> set[str]:
    """Return the words of the name of a column of directions, specimens or tests; nothing for other columns."""
    words = set(plain_name(table.names[column]).split()) - BESIDE_LABELS
    return words if words <= _APART | LABELS else set()
