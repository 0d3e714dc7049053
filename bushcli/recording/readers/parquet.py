"""Parquet, by pyarrow: one table; units in the metadata of a column, or in those that pandas writes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.reader import FilePart, Reader, unit_of
from bushcli.recording.text.clock_times import UTC


@contextmanager
def open_parts(path: Path) -> Iterator[Sequence[FilePart]]:
    """Yield the only table."""
    import pyarrow.parquet as parquet

    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        # The units by column that were in `DataFrame.attrs["units"]`.
        attributes: Any = {}
        with suppress(ValueError):
            attributes = json.loads((schema.metadata or {}).get(b"PANDAS_ATTRS", b"{}"))
        stated = attributes.get("units", attributes.get("unit")) if isinstance(attributes, dict) else None
        common = stated if isinstance(stated, dict) else {}
        units = []
        for field in schema:
            metadata = field.metadata or {}
            unit = unit_of(metadata.get(b"unit") or metadata.get(b"units") or common.get(field.name))
            if str(field.type).startswith(("timestamp", "duration")):
                unit = UTC if getattr(field.type, "tz", None) else "s"  # `Table.clock` converts the stamps
            units.append(unit)
        names = schema.names

        def load(index: int) -> NDArray[Any]:
            table = file.read(columns=[names[index]], use_threads=False)
            # Selected by number, because two columns may have the same name.
            return np.asarray(table.column(names[:index].count(names[index])).to_numpy())

        yield [FilePart("", names, units, file.metadata.num_rows, load)]


READER = Reader(
    name="a Parquet file",
    recognises=lambda head, suffix: head.startswith(b"PAR1"),
    open_parts=open_parts,
    library="pyarrow",
)
