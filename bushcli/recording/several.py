"""Several recordings in one table, with a column that says to which recording a row belongs."""

from __future__ import annotations

import re
from itertools import groupby

import numpy as np

from bushcli.recording.header.columns import Column, chosen_index
from bushcli.recording.header.name import heading
from bushcli.recording.quantities import word_set
from bushcli.recording.source import Source
from bushcli.recording.text.fields import to_float
from bushcli.recording.text.table import Table

#: Words of a column that names recordings, and words beside them.
LABELS = word_set(
    "id specimen sample test run curve part serial probe prüfling probekörper versuch kurve messung éprouvette essai "
    "provino prova probeta ensayo"
)
BESIDE_LABELS = word_set("id no nr number name label code nummer bezeichnung numéro nom nome numero número")
#: Fewest rows of a recording on average: a column with as many labels counts the samples.
_FEWEST = 3


def own_rows(table: Table, source: Source) -> Table:
    """Return the rows of a table that belong to a recording by `Source.rows`."""
    mask = np.ones(len(table), dtype=bool)
    for name, value in source.rows.items():
        index = chosen_index(table, int(name) if name.isdigit() else name)
        texts, number = _texts(table, index), to_float(str(value), table.decimal)
        fits = [text == str(value) or to_float(text, table.decimal) == number for text in texts]
        if not any(fits):
            shown_value = f"{value:g}" if isinstance(value, float) else value
            shown = ", ".join(list(dict.fromkeys(texts))[:8])
            raise table.refusal(f"{table.label(index)} has no row with {shown_value}", f"it has {shown}")
        mask &= fits
    if not mask.any():
        raise table.refusal("has no row with all values of `rows`", "values that stand in one row")
    return table if mask.all() else table.of_rows(np.flatnonzero(mask))


def refuse_several(table: Table, stamps: Column | None) -> None:
    """Refuse a table with several recordings one below the other: its time, if any, goes back where one begins."""
    for index, name in enumerate(table.names):
        words = heading(name).words
        if not words or words[0] not in LABELS or not all(word in LABELS | BESIDE_LABELS for word in words):
            continue
        blocks = [(label, len(list(group))) for label, group in groupby(_texts(table, index))]
        labels = list(dict.fromkeys(label for label, _ in blocks))
        begins = np.cumsum([count for _, count in blocks])[:-1]
        restarts = stamps is None or bool((np.diff(stamps.values)[begins - 1] <= 0.0).any())
        if 1 < len(labels) == len(blocks) <= len(table) / _FEWEST and restarts:
            shown = ", ".join(labels[:4]) + (", ..." if len(labels) > 4 else "")
            what = f"{table.label(index)} names {len(labels)} recordings one below the other ({shown})"
            raise table.refusal(
                what, f"choose one in each table of the case file: {rows_key(name, labels[0])}"
            )


def rows_key(name: str, label: str) -> str:
    """Return the key of the case file that chooses the rows with a label in a column."""
    key = name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{name}"'
    return f'rows = {{{key} = "{label}"}}'


def _texts(table: Table, index: int) -> list[str]:
    return [table.text(row, index) for row in range(len(table))]
